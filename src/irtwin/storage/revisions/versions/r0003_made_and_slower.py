"""Runs say what they made; plans say the run that they are a slower motion of, and what that saves."""

from typing import Literal

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"
TABLES = "9f172c1ae75f7d33"


def upgrade() -> None:
    """Add the columns: nobody said any of it before. SQLite adds a foreign key only to a table made anew."""
    recreate: Literal["always", "never"] = "always" if op.get_bind().dialect.name == "sqlite" else "never"
    scaled = sa.ForeignKey("run.run_id", name="run_time_scaling_of_fkey", deferrable=True, initially="DEFERRED")
    with op.batch_alter_table("run", recreate=recreate) as run:
        run.add_column(sa.Column("time_scaling_of", sa.String(), scaled, nullable=True))
        run.add_column(sa.Column("time_scale", sa.Float(), nullable=True))
        run.add_column(sa.Column("product", sa.String(), nullable=True))
        run.add_column(sa.Column("pieces", sa.Integer(), nullable=True))
        run.add_column(sa.Column("cycles", sa.Integer(), nullable=True))
    with op.batch_alter_table("run_price") as price:
        for name in ("saving_j", "saving_lower_j", "saving_upper_j"):
            price.add_column(sa.Column(name, sa.Float(), nullable=True))
