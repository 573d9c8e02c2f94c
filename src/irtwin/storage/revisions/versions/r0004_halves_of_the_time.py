"""Diagnoses say why a gap is unexplained; causes say what halves of the time show of them."""

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"
TABLES = "0e77b12c96ffac9b"


def upgrade() -> None:
    """Add the columns: nobody said any of it before."""
    with op.batch_alter_table("gap_diagnosis") as diagnosis:
        diagnosis.add_column(sa.Column("unexplained_because", sa.String(), nullable=True))
    with op.batch_alter_table("gap_cause") as cause:
        for name in ("p_remembered", "part_that_repeats"):
            cause.add_column(sa.Column(name, sa.Float(), nullable=True))
        for name in ("first_half_shows_it", "last_half_shows_it"):
            cause.add_column(sa.Column(name, sa.Boolean(), nullable=True))
