"""A diagnosis keeps by how much friction differs from run to run."""

import sqlalchemy as sa
from alembic import op

revision = "0026"
down_revision = "0025"
TABLES = "fe06183edd7ea986"  # of all columns, see tests/storage/test_migration.py

TABLE, COLUMNS = "gap_diagnosis", ("dry_friction_spread", "viscous_friction_spread")


def upgrade() -> None:
    """Add its columns."""
    for column in COLUMNS:
        op.add_column(TABLE, sa.Column(column, sa.Float()))
