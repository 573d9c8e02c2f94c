"""Runs say when they took place, from start to end, where their logs say when they began."""

from datetime import timedelta

import sqlalchemy as sa
from alembic import op

revision = "0008"
down_revision = "0007"
TABLES = "6fa957baa6eef031"


def upgrade() -> None:
    """Add the columns; live runs are in the database once they are over."""
    with op.batch_alter_table("run") as run:
        for name in ("started", "ended"):
            run.add_column(sa.Column(name, sa.DateTime(), nullable=True))
    times = [sa.column(name, sa.DateTime()) for name in ("start_time", "started", "ended")]
    names = [sa.column(name, sa.String()) for name in ("run_id", "start_time_from")]
    table = sa.table("run", *names, *times, sa.column("run_time_s", sa.Float()))
    connection = op.get_bind()
    known = sa.select(table.c.run_id, table.c.start_time, table.c.run_time_s).where(table.c.start_time_from == "log")
    found = [
        {"of": run_id, "start": start, "end": start + timedelta(seconds=length)}
        for run_id, start, length in connection.execute(known)
    ]
    if found:
        one = table.update().where(table.c.run_id == sa.bindparam("of"))
        connection.execute(one.values(started=sa.bindparam("start"), ended=sa.bindparam("end")), found)
