"""Robots say the cutoff that their data set states; twins and diagnoses say theirs, and why."""

import sqlalchemy as sa
from alembic import op

revision = "0011"
down_revision = "0010"
TABLES = "7f334fc6c36dc223"


def upgrade() -> None:
    """Add the columns: nobody said any of it before but twins their cutoff."""
    with op.batch_alter_table("robot") as robot:
        robot.add_column(sa.Column("cutoff_hz", sa.Float(), nullable=True))
    with op.batch_alter_table("twin") as twin:
        twin.add_column(sa.Column("cutoff_why", sa.String(), nullable=True))
    with op.batch_alter_table("gap_diagnosis") as diagnosis:
        diagnosis.add_column(sa.Column("cutoff_hz", sa.Float(), nullable=True))
        diagnosis.add_column(sa.Column("cutoff_why", sa.String(), nullable=True))
