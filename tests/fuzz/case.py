"""A case: a data set, how it is spoilt, and the commands that are tried on it. Kept as JSON, it is a test."""

from __future__ import annotations

import json
from dataclasses import MISSING, dataclass, field, fields, is_dataclass
from typing import Any

from hypothesis import strategies as st
from tests.fuzz.drawn_robots import Axis, RobotPlan
from tests.fuzz.logs import DataPlan, RunPlan, data_sets
from tests.fuzz.spoil import spoils
from tests.fuzz.streams import StreamPlan, streams

BRIEF = ("diagnose",)
CHECKED = ("check",)
ALONE = ("diagnose with page and twin", "predict")
MOTION = ("excite",)
PLANNED = ("plan",)
DESCRIBED = ("robot dh", "robot urdf", "robot ik", "robot ros")
IN_SYMBOLS = ("robot equations",)
WITH_WORKSPACE = ("run", "query", "export", "live", "diagnose into workspace", "query")
KEPT_AND_MOVED = ("run", "map", "explain", "export", "reason", "backup", "restore", "repair", "drop")
ADOPTED = ("run", "diagnose into workspace", "adopt", "query")
FOR_ROS = ("run", "export for ROS", "export MCAP", "export bag", "live replay")
BROUGHT = ("import", "check of what was imported")
TOLD = ("run", "live", "alarms", "alarms of the robot")
OF_MANY = ("fleet diagnose", "fleet status", "fleet run", "fleet status of runs")
BETTERED = ("run", "predict into workspace", "improve", "query")
_LONG = (WITH_WORKSPACE, KEPT_AND_MOVED, ADOPTED, FOR_ROS, BETTERED, TOLD, OF_MANY)
_SHORT = (
    (BRIEF,) * 36 + (ALONE,) * 16 + (CHECKED,) * 8 + (MOTION,) * 4 + (PLANNED,) * 4 + (DESCRIBED,) * 4 + (BROUGHT,) * 8
)
_TRIED = (*_SHORT, IN_SYMBOLS, IN_SYMBOLS, *_LONG)


@dataclass(frozen=True)
class Case:
    """What is tried, in order."""

    data: DataPlan
    spoils: tuple[tuple[str, int], ...] = ()
    commands: tuple[str, ...] = ALONE
    stream: StreamPlan = field(default_factory=StreamPlan)

    def to_json(self) -> str:
        """Return the case as text; the inverse of `read_case`."""
        return json.dumps(_plain(self), indent=1, ensure_ascii=False) + "\n"


def read_case(text: str) -> Case:
    """Read a case that was kept."""
    said = _tuples(json.loads(text))
    data = said.pop("data")
    robot = data.pop("robot")
    axes = tuple(Axis(**axis) for axis in robot.pop("axes"))
    runs = tuple(RunPlan(**run) for run in data.pop("runs"))
    stream = StreamPlan(**said.pop("stream", {}))
    return Case(DataPlan(RobotPlan(axes, **robot), runs, **data), stream=stream, **said)


def _plain(value: Any) -> Any:
    """Return a plan as JSON has it, without what is at its default."""
    if is_dataclass(value):
        return {
            it.name: _plain(own)
            for it in fields(value)
            if (own := getattr(value, it.name))
            != (it.default_factory() if it.default_factory is not MISSING else it.default)
        }
    return list(map(_plain, value)) if isinstance(value, tuple) else value


def _tuples(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _tuples(inner) for key, inner in value.items()}
    return tuple(map(_tuples, value)) if isinstance(value, list) else value


@st.composite
def cases(draw: st.DrawFn) -> Case:
    """Draw a case, small nine times in ten; one in three data sets is spoilt, one in twenty goes into a workspace."""
    large = draw(st.integers(0, 9)) == 9
    spoilt = draw(spoils()) if draw(st.integers(0, 2)) == 0 else ()
    commands = draw(st.sampled_from(_TRIED))
    stream = draw(streams()) if "live" in commands else StreamPlan()
    return Case(draw(data_sets(large)), spoilt, commands, stream)
