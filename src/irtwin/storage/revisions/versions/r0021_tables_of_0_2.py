"""The tables of irtwin 0.2: where workspaces begin."""

revision = "0021"
down_revision = None
TABLES = "24aec3e6c34bbe20"  # of all columns, see tests/storage/test_migration.py


def upgrade() -> None:
    """Change nothing: these tables are made whole in a new workspace."""
