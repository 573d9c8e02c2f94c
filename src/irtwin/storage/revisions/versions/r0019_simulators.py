"""Diagnoses say the simulator that runs were held against, its numbers, and how its tracking error grows."""

import sqlalchemy as sa
from alembic import op

revision = "0019"
down_revision = "0018"
TABLES = "2dbc6504738b6e8b"


def upgrade() -> None:
    """Add the table and the columns."""
    with op.batch_alter_table("gap_diagnosis") as diagnosis:
        diagnosis.add_column(sa.Column("simulator_model", sa.String(), nullable=True))
    with op.batch_alter_table("gap_cause_parameter") as parameter:
        parameter.add_column(sa.Column("simulator_value", sa.Float(), nullable=True))
        parameter.add_column(sa.Column("robot_value", sa.Float(), nullable=True))
    op.create_table(
        "gap_horizon",
        sa.Column("diagnosis_id", sa.String(), sa.ForeignKey("gap_diagnosis.diagnosis_id"), primary_key=True),
        sa.Column("number", sa.Integer(), primary_key=True),
        sa.Column("seconds", sa.Float(), nullable=False),
        sa.Column("before", sa.Float(), nullable=False),
        sa.Column("after", sa.Float(), nullable=False),
        sa.Column("measure", sa.String(), nullable=False),
        sa.Column("unit", sa.String(), nullable=False),
        sa.Column("activity_id", sa.String(), sa.ForeignKey("activity.activity_id"), nullable=False),
    )
