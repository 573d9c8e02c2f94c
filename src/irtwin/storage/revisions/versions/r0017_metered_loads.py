"""Runs that a meter alone logged say their load; their supply's states are by no twin."""

import sqlalchemy as sa
from alembic import op

revision = "0017"
down_revision = "0015"
TABLES = "e57115596fe7c8d1"


def upgrade() -> None:
    """Add the table, and let states of a supply be without a twin."""
    op.create_table(
        "metered_load",
        sa.Column("run_id", sa.String(), sa.ForeignKey("run.run_id"), primary_key=True),
        sa.Column("standby_power_w", sa.Float(), nullable=True),
        sa.Column("cycle_count", sa.Integer(), nullable=True),
        sa.Column("cycle_time_s", sa.Float(), nullable=True),
        sa.Column("cycle_energy_j", sa.Float(), nullable=True),
        sa.Column("first_hour", sa.DateTime(), nullable=False),
        sa.Column("energy_by_hour_j", sa.String(), nullable=False),
        sa.Column("activity_id", sa.String(), sa.ForeignKey("activity.activity_id"), nullable=False),
    )
    with op.batch_alter_table("supply_state") as state:
        state.alter_column("modelled_power_w", existing_type=sa.Float(), nullable=True)
