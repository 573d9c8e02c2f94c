"""Shares of energy have intervals, and those that data do not part have one together."""

import sqlalchemy as sa
from alembic import op

revision = "0014"
down_revision = "0013"
TABLES = "0107016c123b5442"


def upgrade() -> None:
    """Add columns and table."""
    with op.batch_alter_table("energy_share") as share:
        share.add_column(sa.Column("lower_j", sa.Float(), nullable=True))
        share.add_column(sa.Column("upper_j", sa.Float(), nullable=True))
        share.add_column(sa.Column("inseparable", sa.Integer(), nullable=True))
    op.create_table(
        "inseparable_energy",
        sa.Column("run_id", sa.String(), sa.ForeignKey("run.run_id"), primary_key=True),
        sa.Column("number", sa.Integer(), primary_key=True),
        sa.Column("robot_id", sa.String(), nullable=False),
        sa.Column("energy_j", sa.Float(), nullable=False),
        sa.Column("lower_j", sa.Float(), nullable=False),
        sa.Column("upper_j", sa.Float(), nullable=False),
        sa.Column("activity_id", sa.String(), sa.ForeignKey("activity.activity_id"), nullable=False),
    )
