"""What a simulator wrote is no consumption; earlier replays cannot be told from live runs, and stay as they are."""

import sqlalchemy as sa
from alembic import op

revision = "0009"
down_revision = "0008"
TABLES = "fb6565eeeb3a6f29"


def upgrade() -> None:
    """Let a run have an energy and no consumption; take the consumption off simulated runs."""
    with op.batch_alter_table("run_energy") as energy:
        energy.alter_column("energy_consumption_j", existing_type=sa.Float(), nullable=True)
    simulated = "SELECT run_id FROM run WHERE role = 'simulated'"
    op.execute(f"UPDATE run_energy SET energy_consumption_j = NULL WHERE run_id IN ({simulated})")
