"""Runs say the states of the supply, and the power in each."""

import sqlalchemy as sa
from alembic import op

revision = "0015"
down_revision = "0014"
TABLES = "bdd38b81e469a2e1"


def upgrade() -> None:
    """Add the table."""
    op.create_table(
        "supply_state",
        sa.Column("run_id", sa.String(), sa.ForeignKey("run.run_id"), primary_key=True),
        sa.Column("number", sa.Integer(), primary_key=True),
        sa.Column("robot_id", sa.String(), nullable=False),
        sa.Column("state", sa.String(), nullable=False),
        sa.Column("seconds", sa.Float(), nullable=False),
        sa.Column("power_w", sa.Float(), nullable=True),
        sa.Column("modelled_power_w", sa.Float(), nullable=False),
        sa.Column("modelled_power_lower_w", sa.Float(), nullable=True),
        sa.Column("modelled_power_upper_w", sa.Float(), nullable=True),
        sa.Column("differs", sa.Boolean(), nullable=False),
        sa.Column("activity_id", sa.String(), sa.ForeignKey("activity.activity_id"), nullable=False),
    )
