"""The unit of a live gap is as QUDT names it, so that its IRI is made of it; a use says by which term of PROV."""

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"
TABLES = "f0312c5d9c596980"


def upgrade() -> None:
    """Write "N m" as "N-M" ("N" and "W" are the same in both); an activity is informed by a run, and uses the rest."""
    for name in ("gap_state", "gap_excursion"):
        table = sa.table(name, sa.column("unit"))
        op.execute(table.update().where(table.c.unit == "N m").values(unit="N-M"))
    with op.batch_alter_table("activity_use") as use:
        use.add_column(sa.Column("relation", sa.String(), nullable=False, server_default="used"))
    table = sa.table("activity_use", sa.column("entity"), sa.column("relation"))
    op.execute(table.update().where(table.c.entity.startswith("run/")).values(relation="wasInformedBy"))
    with op.batch_alter_table("activity_use") as use:
        use.alter_column("relation", server_default=None)
