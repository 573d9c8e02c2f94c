"""The tables of irtwin 0.1: where older workspaces begin, which say no revision."""

revision = "0001"
down_revision = None
TABLES = "7d840b3236023832"  # of all columns, see tests/storage/test_migration.py


def upgrade() -> None:
    """Change nothing: these tables are made whole in a new workspace."""
