"""Twins say how sure the scale of their torque is; their parameters have a second interval that holds it."""

import sqlalchemy as sa
from alembic import op

revision = "0007"
down_revision = "0006"
TABLES = "ce58be8c7b3b9aa5"


def upgrade() -> None:
    """Add the columns: nobody said any of it before."""
    with op.batch_alter_table("twin") as twin:
        twin.add_column(sa.Column("torque_scale_uncertainty", sa.Float(), nullable=True))
        twin.add_column(sa.Column("torque_scale_why", sa.String(), nullable=True))
    for table in ("parameter", "base_parameter"):
        with op.batch_alter_table(table) as parameter:
            for name in ("scaled_lower", "scaled_upper"):
                parameter.add_column(sa.Column(name, sa.Float(), nullable=True))
