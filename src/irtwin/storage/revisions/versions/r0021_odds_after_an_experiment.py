"""Questions of an experiment say by their odds alone how far they are answered."""

from alembic import op

revision = "0021"
down_revision = "0020"
TABLES = "24aec3e6c34bbe20"
GONE = "not_imitated_now", "expected_not_imitated", "visibility_now", "expected_visibility"


def upgrade() -> None:
    """Drop what was said of imitation and visibility."""
    with op.batch_alter_table("gap_experiment_question") as question:
        for name in GONE:
            question.drop_column(name)
