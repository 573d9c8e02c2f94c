"""The tables of irtwin 0.2: where workspaces begin."""

revision = "0021"
down_revision = None


def upgrade() -> None:
    """Change nothing: these tables are made whole in a new workspace."""
