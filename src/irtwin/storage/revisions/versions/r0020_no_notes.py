"""Changes of rows are no longer noted by triggers: a mapping reads all rows."""

import sqlalchemy as sa
from alembic import op

revision = "0020"
down_revision = "0019"
TABLES = "2dbc6504738b6e8b"


def upgrade() -> None:
    """Drop the triggers, what they call and the notes."""
    connection = op.get_bind()
    if connection.dialect.name == "sqlite":
        triggers = sa.text(
            "SELECT name FROM sqlite_master WHERE type = 'trigger' AND name LIKE 'irtwin\\_%' ESCAPE '\\'"
        )
        for name in connection.execute(triggers).scalars().all():
            op.execute(f'DROP TRIGGER "{name}"')
    else:
        op.execute("DROP FUNCTION IF EXISTS irtwin_note_rows CASCADE")
    op.execute("DROP TABLE IF EXISTS row_change")
