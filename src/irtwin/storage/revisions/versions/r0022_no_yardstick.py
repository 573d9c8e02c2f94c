"""What a flexible regression could close of a gap is told no more."""

from alembic import op

revision = "0022"
down_revision = "0021"
TABLES = "c35ce4f6539306e8"  # of all columns, see tests/storage/test_migration.py


def upgrade() -> None:
    """Drop its table."""
    op.drop_table("gap_closeable")
