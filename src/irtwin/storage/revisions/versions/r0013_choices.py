"""Twins say which effects were chosen by what data show, and what each is worth."""

import sqlalchemy as sa
from alembic import op

revision = "0013"
down_revision = "0012"
TABLES = "69f5dc0db2ea147d"


def upgrade() -> None:
    """Add the table."""
    op.create_table(
        "twin_choice",
        sa.Column("choice_id", sa.String(), primary_key=True),
        sa.Column("twin_id", sa.String(), sa.ForeignKey("twin.twin_id"), nullable=False),
        sa.Column("effect", sa.String(), nullable=False),
        sa.Column("joints", sa.String(), nullable=True),
        sa.Column("chosen", sa.Boolean(), nullable=False),
        sa.Column("probability", sa.Float(), nullable=False),
        sa.Column("rivals", sa.String(), nullable=True),
        sa.Column("rmse_unit", sa.String(), nullable=True),
        sa.Column("rmse_without", sa.Float(), nullable=True),
        sa.Column("rmse_with", sa.Float(), nullable=True),
        sa.Column("energy_error_without_percent", sa.Float(), nullable=True),
        sa.Column("energy_error_with_percent", sa.Float(), nullable=True),
        sa.Column("activity_id", sa.String(), sa.ForeignKey("activity.activity_id"), nullable=False),
    )
