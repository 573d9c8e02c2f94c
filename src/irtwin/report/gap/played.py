"""A diagnosis by playing, for the terminal: how far the simulator misses the robot, by what, and what closes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from irtwin.document.document import Document
from irtwin.document.played import Played
from irtwin.knowledge.store.table import Table
from irtwin.report.wording import listed

_DIGITS = 3
_MILLI = 1e3  # of m and rad


def line(diagnosis: Document) -> str:
    """Return the verdict, and tracking error before and after."""
    played = diagnosis.played
    assert played is not None
    before = f"{_milli(played.before):g} mrad"
    if diagnosis.verdict == "no_gap":
        return f"no_gap: the simulator agrees with the robot, to {before}."
    if not played.numbers:
        return f"unexplained: the simulator misses the robot by {before}, and no number of its servos explains that."
    named = listed([cause.effect.replace("_", " ") for cause in diagnosis.causes])
    return (
        f"{diagnosis.verdict}: the simulator misses the robot by {before}; with the robot's {named} it misses it by "
        f"{_milli(played.after):g} mrad{_held_out(played)}."
    )


def _held_out(played: Played) -> str:
    return "" if played.held_out is None else f", by {_milli(played.held_out):g} mrad on motions that were held out"


def tables(diagnosis: Document) -> list[Table]:
    """Return the tables that have rows: error by run, with each effect added, by time since begun anew; numbers."""
    played = diagnosis.played
    assert played is not None
    return [one for one in (_runs(played), _added(played), _restarted(played), _numbers(played)) if one]


def _runs(played: Played) -> Table:
    columns = ("run", "simulator, mrad", "robot's numbers, mrad", "held out, mrad", "flange, mm", "then, mm")
    return _table(
        columns,
        [
            (
                name,
                _milli(run.before.rms),
                _milli(run.after.rms),
                None if run.held_out is None else _milli(run.held_out.rms),
                _milli(run.before.flange),
                _milli(run.after.flange),
            )
            for name, run in played.runs.items()
        ],
    )


def _added(played: Played) -> Table:
    rows = [(one.effect.replace("_", " "), _milli(one.before), _milli(one.after)) for one in played.added]
    return _table(("the robot's", "without, mrad", "with, mrad"), rows)


def _restarted(played: Played) -> Table:
    rows = [(one.seconds, _milli(one.before), _milli(one.after)) for one in played.restarted]
    return _table(("s after it was begun anew", "simulator, mrad", "robot's numbers, mrad"), rows)


def _numbers(played: Played) -> Table:
    rows = []
    for one in played.numbers:
        lower, upper = one.interval95 or (None, None)
        values = (one.simulator, one.robot, lower, upper, one.change)
        numbers = [None if value is None else _short(value) for value in values]
        rows.append((one.name, one.joint, *numbers, "" if one.unit == "1" else one.unit))
    return _table(("number", "joint", "simulator", "robot", "95 % from", "to", "change", "unit"), rows)


def _table(columns: Sequence[str], rows: Iterable[Sequence[str | float | None]]) -> Table:
    return Table(tuple(columns), tuple(dict(zip(columns, row, strict=True)) for row in rows))


def _milli(value: float) -> float:
    return _short(_MILLI * value)


def _short(value: float) -> float:
    return float(f"{value:.{_DIGITS}g}")
