"""Notes of a data set are rows, so that each can be asked for; before, a robot had one JSON object."""

import json

import sqlalchemy as sa
from alembic import op

revision = "0006"
down_revision = "0005"
HAVE_TERMS = (  # in the graph already
    "name", "urdf", "dh", "manufacturer", "type", "weight", "ambient_temperature", "power_at", "rated_payload",
    "arm_movement_type", "simulated", "joint",
)  # fmt: skip
TABLES = "c48f49eeeb1d535b"


def upgrade() -> None:
    """Make the table and fill it from the notes that robots have."""
    notes = op.create_table(
        "robot_note",
        sa.Column("robot_id", sa.String(), sa.ForeignKey("robot.robot_id"), primary_key=True),
        sa.Column("name", sa.String(), primary_key=True),
        sa.Column("number", sa.Integer(), primary_key=True),
        sa.Column("text", sa.String(), nullable=False),
    )
    robots = op.get_bind().execute(sa.text("SELECT robot_id, notes FROM robot")).all()
    rows = [
        {"robot_id": robot, "name": name, "number": number, "text": text}
        for robot, said in robots
        for name, number, text in _flat(json.loads(said), "")
        if name not in HAVE_TERMS
    ]
    if rows:
        op.bulk_insert(notes, rows)


def _flat(said: object, name: str) -> list[tuple[str, int, str]]:
    if isinstance(said, dict):
        return [row for key, value in said.items() for row in _flat(value, f"{name}.{key}" if name else key)]
    if isinstance(said, list):
        return [(name, place, _text(one)) for place, one in enumerate(said, start=1)]
    return [(name, 1, _text(said))]


def _text(value: object) -> str:
    return value if isinstance(value, str) else json.dumps(value)
