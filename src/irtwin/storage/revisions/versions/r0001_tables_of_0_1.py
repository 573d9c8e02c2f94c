"""The tables of irtwin 0.1: where older workspaces begin, which say no revision."""

revision = "0001"
down_revision = None
TABLES = "380ecfb67b8c2da8"  # of all columns, see tests/storage/test_migration.py


def upgrade() -> None:
    """Change nothing: these tables are made whole in a new workspace."""
