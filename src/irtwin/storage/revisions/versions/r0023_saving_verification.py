"""What a saving action saved is kept, as a provider works it out."""

import sqlalchemy as sa
from alembic import op

revision = "0023"
down_revision = "0022"
TABLES = "1bd915a30434db7a"  # of all columns, see tests/storage/test_migration.py

TABLE = "saving_verification"


def upgrade() -> None:
    """Make its table."""
    op.create_table(
        TABLE,
        sa.Column("action", sa.String(), primary_key=True),
        sa.Column("robot_id", sa.String(), nullable=False),
        sa.Column("result", sa.String(), nullable=False),
        sa.Column("runs_before", sa.Integer(), nullable=False),
        sa.Column("runs_after", sa.Integer(), nullable=False),
        sa.Column("compared_for", sa.String()),
        *(
            sa.Column(name, sa.Float())
            for name in ("adjusted_baseline_j", "saving_j", "saving_lower_j", "saving_upper_j")
        ),
        sa.Column("activity_id", sa.String(), sa.ForeignKey("activity.activity_id"), nullable=False),
    )
