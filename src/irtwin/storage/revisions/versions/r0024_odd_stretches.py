"""A diagnosis keeps the stretches of runs of which its twin leaves most."""

import sqlalchemy as sa
from alembic import op

revision = "0024"
down_revision = "0023"
TABLES = "4962e18c75b7a378"  # of all columns, see tests/storage/test_migration.py

TABLE, JOINTS = "gap_odd_stretch", "gap_odd_stretch_joint"


def _key() -> tuple[sa.Column[str], sa.Column[str]]:
    return (
        sa.Column("diagnosis_id", sa.String(), sa.ForeignKey("gap_diagnosis.diagnosis_id"), primary_key=True),
        sa.Column("stretch_id", sa.String(), primary_key=True),
    )


def _made() -> sa.Column[str]:
    return sa.Column("activity_id", sa.String(), sa.ForeignKey("activity.activity_id"), nullable=False)


def upgrade() -> None:
    """Make its tables."""
    op.create_table(
        TABLE,
        *_key(),
        sa.Column("rank", sa.Integer(), nullable=False),
        sa.Column("run_id", sa.String(), sa.ForeignKey("run.run_id"), nullable=False),
        sa.Column("start", sa.Float(), nullable=False),
        sa.Column("stop", sa.Float(), nullable=False),
        sa.Column("robot_id", sa.String(), nullable=False),
        _made(),
    )
    op.create_table(
        JOINTS,
        *_key(),
        sa.Column("joint", sa.String(), primary_key=True),
        sa.Column("robot_id", sa.String(), nullable=False),
        _made(),
    )
