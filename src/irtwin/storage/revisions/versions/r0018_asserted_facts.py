"""What users assert is kept, with its author and time."""

import sqlalchemy as sa
from alembic import op

revision = "0018"
down_revision = "0017"
TABLES = "2848dd6e1bceb484"


def upgrade() -> None:
    """Add the table."""
    op.create_table(
        "asserted_fact",
        sa.Column("fact_id", sa.String(), primary_key=True),
        sa.Column("about_robot", sa.String(), sa.ForeignKey("robot.robot_id", ondelete="CASCADE"), nullable=True),
        sa.Column("subject", sa.String(), nullable=False),
        sa.Column("predicate", sa.String(), nullable=False),
        sa.Column("value", sa.String(), nullable=True),
        sa.Column("kind", sa.String(), nullable=False),
        sa.Column("graph", sa.String(), nullable=False),
        sa.Column("author", sa.String(), nullable=False),
        sa.Column("time", sa.DateTime(), nullable=False),
        sa.Column("replaced", sa.String(), nullable=True),
        sa.Column("place", sa.String(), nullable=True),
        sa.Column("row_key", sa.String(), nullable=True),
    )
