"""A base of individuals for each workspace; activities name them below it."""

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"
TABLES = "b56375b28e013b82"
BASE = "https://w3id.org/irtwin/id/"


def upgrade() -> None:
    """Make the table of the base, and take the one that there was off the names of individuals."""
    op.create_table("individuals", sa.Column("base_iri", sa.String(), primary_key=True))
    for table, column in (("activity", "subject"), ("activity_use", "entity")):
        short = f"substr({column}, {len(BASE) + 1})"
        op.execute(f"UPDATE {table} SET {column} = {short} WHERE {column} LIKE '{BASE}%'")
