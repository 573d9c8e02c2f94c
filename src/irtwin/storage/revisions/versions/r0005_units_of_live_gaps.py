"""The unit of a live gap is as QUDT names it, so that its IRI is made of it."""

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0003"
TABLES = "9f172c1ae75f7d33"


def upgrade() -> None:
    """Write "N m" as "N-M"; "N" and "W" are the same in both."""
    for name in ("gap_state", "gap_excursion"):
        table = sa.table(name, sa.column("unit"))
        op.execute(table.update().where(table.c.unit == "N m").values(unit="N-M"))
