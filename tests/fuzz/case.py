"""A case: what is there, how it is spoilt, and the commands that are tried on it. Kept as JSON, it is a test."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, dataclass, field, fields, is_dataclass
from typing import Any, TypeVar

from hypothesis import strategies as st
from tests.fuzz.drawn_robots import Axis, RobotPlan
from tests.fuzz.logs import DataPlan, RunPlan, data_sets
from tests.fuzz.peers import OF_ROBOT, OF_WEB
from tests.fuzz.streams import StreamPlan, streams
from tests.fuzz.ways import spoils

_PLAIN = DataPlan(RobotPlan((Axis("revolute"),)), (RunPlan(samples=160, csv=True),))
_T = TypeVar("_T")
_MOST = 12  # times as often is drawn what was tried least


@dataclass(frozen=True)
class Case:
    """What is tried, in order. `sound`: the parts of `Sound` that are there; `peer`: who answers, and its seed."""

    data: DataPlan = _PLAIN
    spoils: tuple[tuple[str, int], ...] = ()
    commands: tuple[str, ...] = ()
    stream: StreamPlan = field(default_factory=StreamPlan)
    sound: tuple[str, ...] = ()
    peer: tuple[str, int] | None = None

    def to_json(self) -> str:
        """Return the case as text; the inverse of `read_case`."""
        return json.dumps(_plain(self), indent=1, ensure_ascii=False) + "\n"


@dataclass(frozen=True)
class Kind:
    """What cases of a kind have in common: commands that come `first`, and some of those `then`."""

    first: tuple[str, ...] = ()
    then: tuple[str, ...] = ()
    sound: tuple[str, ...] = ()
    spoilt: tuple[str, ...] = ("data",)
    always_spoilt: bool = False
    peers: Sequence[str] = ()

    @property
    def draws_data(self) -> bool:
        """Whether its data set is drawn."""
        return not self.sound and self.spoilt == ("data",)

    def tried(self, tried: Mapping[str, int]) -> int:
        """Return how often its rarest command was tried."""
        return min(tried.get(command, 0) for command in self.first + self.then)


_ASKING = ("status", "query", "query json", "questions", "alarms", "alarms of the robot", "explain", "export", "docs")
_ASKING += ("backup", "export for ROS", "predict into workspace", "live replay", "fleet run")
_CHANGING = ("repair", "adopt", "drop", "drop a run", "reason into workspace", "run", "improve", "live", "optimise")
_CHANGING += ("diagnose into workspace", "alarms follow", "serve", "live controller", "map", "plan into workspace")
_HERE = ("workspace", "data")
KINDS = (
    *(Kind(first) for first in (("diagnose",), ("check",), ("diagnose with page and twin", "predict"), ("excite",))),
    *(Kind((word,)) for word in ("plan", "robot dh", "robot urdf", "robot ros", "robot equations", "init")),
    Kind(("run", "query", "export", "live", "diagnose into workspace", "query")),
    Kind(("run", "map", "explain", "export", "reason", "backup", "restore", "repair", "drop")),
    Kind(("run", "diagnose into workspace", "adopt", "query")),
    Kind(("run", "export for ROS", "live replay")),
    Kind(("import", "check of what was imported")),
    Kind(("run", "live", "alarms", "alarms of the robot")),
    Kind(("fleet diagnose", "fleet status", "fleet run", "fleet status of runs")),
    Kind(("run", "predict into workspace", "improve", "query")),
    Kind(then=(*_ASKING, *_CHANGING), sound=_HERE),
    Kind(("restore", "status"), _ASKING + _CHANGING, ("given.zip", "data"), ("archive",), always_spoilt=True),
    Kind(("import", "check of what was imported"), ("run of what was imported",), spoilt=("log",), always_spoilt=True),
    Kind(("live",), ("live", "alarms", "query", "status"), _HERE, ()),
    Kind(("live controller",), ("query", "status"), _HERE, (), peers=tuple(OF_ROBOT)),
    Kind(("trust", "alarms follow"), ("alarms follow", "alarms"), _HERE, (), peers=tuple(OF_WEB)),
    Kind(("trust",), _ASKING + _CHANGING, _HERE, ("extension",), always_spoilt=True),
    Kind((), ("trust", *_ASKING, *_CHANGING), _HERE, ("extension", "workspace"), always_spoilt=True),
    Kind(("status",), ("trust", *_ASKING), _HERE, ("workspace",), always_spoilt=True),
    Kind((), _CHANGING, _HERE, ("workspace",), always_spoilt=True),
    Kind(("fleet status",), ("fleet diagnose",), ("fleet",), ("fleet",), always_spoilt=True),
)
OF_DATA = tuple(kind for kind in KINDS if kind.draws_data)


def read_case(text: str) -> Case:
    """Read a case that was kept."""
    said = _tuples(json.loads(text))
    stream = StreamPlan(**said.pop("stream", {}))
    data = said.pop("data", None)
    return Case(_PLAIN if data is None else _data(data), stream=stream, **said)


def _data(said: dict[str, Any]) -> DataPlan:
    robot = said.pop("robot")
    axes = tuple(Axis(**axis) for axis in robot.pop("axes"))
    runs = tuple(RunPlan(**run) for run in said.pop("runs"))
    return DataPlan(RobotPlan(axes, **robot), runs, **said)


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
def cases(draw: st.DrawFn, kinds: Sequence[Kind] = KINDS, tried: Mapping[str, int] = Counter()) -> Case:
    """Draw a case, the more often the less its commands were `tried`; data sets are small nine times in ten,
    and where much is tried on them.

    One in three data sets is spoilt.
    """
    kind = draw(_rather(kinds, [one.tried(tried) for one in kinds]))
    some = _rather(kind.then, [tried.get(command, 0) for command in kind.then])
    then = draw(st.lists(some, min_size=1, max_size=3, unique=True)) if kind.then else []
    commands = (*kind.first, *then)
    large = len(commands) < 3 and draw(st.integers(0, 9)) == 9
    spoilt = kind.always_spoilt or (kind.spoilt and draw(st.integers(0, 2)) == 0)
    return Case(
        draw(data_sets(large)) if kind.draws_data else _PLAIN,
        draw(spoils(*kind.spoilt, least=int(kind.always_spoilt))) if spoilt else (),
        commands,
        draw(streams()) if "live" in commands else StreamPlan(),
        kind.sound,
        (draw(st.sampled_from(kind.peers)), draw(st.integers(0, 999_999))) if kind.peers else None,
    )


def _rather(options: Sequence[_T], counts: Sequence[int]) -> st.SearchStrategy[_T]:
    """Draw one of some options, of which each came so often, rather one that came seldom."""
    least = min(counts, default=0)
    weights = [max(1, round(_MOST * (least + 1) / (count + 1))) for count in counts]
    return st.sampled_from([one for one, weight in zip(options, weights, strict=True) for _ in range(weight)])
