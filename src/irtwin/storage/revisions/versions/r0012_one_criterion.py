"""Causes no longer say what power told of them apart: it takes part in their odds."""

from alembic import op

revision = "0012"
down_revision = "0011"
TABLES = "33b0944d621ce8b1"

APART = ("power_on_explained_torque_says", "power_says", "gain_in_power", "t_in_power")


def upgrade() -> None:
    """Drop it."""
    with op.batch_alter_table("gap_cause") as cause:
        for name in APART:
            cause.drop_column(name)
