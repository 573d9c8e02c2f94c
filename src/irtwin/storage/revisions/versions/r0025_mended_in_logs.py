"""A diagnosis keeps what was wrong with the logs that it read."""

import sqlalchemy as sa
from alembic import op

revision = "0025"
down_revision = "0024"
TABLES = "64bbcdfd248c5290"  # of all columns, see tests/storage/test_migration.py

TABLE, COLUMN = "gap_diagnosis", "mended"


def upgrade() -> None:
    """Add its column."""
    op.add_column(TABLE, sa.Column(COLUMN, sa.String()))
