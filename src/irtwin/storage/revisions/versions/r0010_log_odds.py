"""Causes say their log odds, and rivals their probability; earlier diagnoses keep verdict, causes and confidence."""

import sqlalchemy as sa
from alembic import op

revision = "0010"
down_revision = "0009"
TABLES = "fb9f914e7537c0e3"

JUDGED_BY = ("t_between_groups", "p_adjusted", "p_remembered", "part_that_repeats")
HALVES = ("first_half_shows_it", "last_half_shows_it")


def upgrade() -> None:
    """Drop what the earlier criterion judged by, and rivals by it; keep each cause's gain. Nobody said log odds."""
    with op.batch_alter_table("gap_cause") as cause:
        cause.alter_column("gain_on_groups_left_out", new_column_name="gain", existing_type=sa.Float())
        cause.add_column(sa.Column("log_odds", sa.Float(), nullable=True))
        for name in (*JUDGED_BY, *HALVES):
            cause.drop_column(name)
    op.execute("DELETE FROM gap_cause_competitor")
    with op.batch_alter_table("gap_cause_competitor") as competitor:
        for name in ("gain", "correlation"):
            competitor.drop_column(name)
        competitor.add_column(sa.Column("probability", sa.Float(), nullable=False))
