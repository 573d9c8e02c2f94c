"""Two runs, or two times, of one robot side by side: energy, standby and joints before and after a change."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pyoxigraph import Literal

from irtwin.knowledge.vocabulary import ID
from irtwin.report.plant.choice import day
from irtwin.report.plant.energies import EnergyKind, kind, share
from irtwin.report.plant.sheet import Sheet
from irtwin.report.questions import Answers, Row

_LITTLE = 1e-4  # of the greater side
_ALWAYS = ("0001-01-01", "9999-12-31")


@dataclass(frozen=True)
class Side:
    """What is looked at on one side: a run, or the days from `first` to `last`."""

    run: str | None
    first: str
    last: str

    def bindings(self) -> dict[str, str | Literal]:
        """Return what the questions of `reports/plant/comparison` are asked of, beside the robot."""
        days: dict[str, str | Literal] = {"first": Literal(self.first), "last": Literal(self.last)}
        return days if self.run is None else {**days, "run": self.run}


@dataclass(frozen=True)
class ComparedPair:
    """A quantity on both sides; `digits` as significant ones. There is no difference where one side lacks it."""

    name: str
    unit: str
    before: float | None
    after: float | None

    @property
    def difference(self) -> float | None:
        """After less before."""
        return None if self.before is None or self.after is None else self.after - self.before

    @property
    def same(self) -> bool:
        """Whether the sides differ by nothing that anybody would tell."""
        return self.difference is not None and abs(self.difference) <= _LITTLE * max(
            abs(self.before or 0.0), abs(self.after or 0.0)
        )

    @property
    def percent(self) -> float | None:
        """The difference as part of what was before, %."""
        return None if self.difference is None or not self.before else 100.0 * self.difference / abs(self.before)


@dataclass(frozen=True)
class Comparison:
    """Pairs that may be held against each other: of both sides, and for each kind of energy by itself."""

    pairs: tuple[ComparedPair, ...]
    kinds: tuple[tuple[EnergyKind, tuple[ComparedPair, ...]], ...]
    joints: tuple[ComparedPair, ...]
    apart: bool  # the two sides have no kind of energy in common


def side(asked: Mapping[str, str], which: str, base: str = ID) -> Side | None:
    """Read what a form says of side `a` or `b`; None where it says nothing. InputError where it is no date.

    base: what the IRIs of runs begin with.
    """
    if asked.get("by") == "run":
        run = asked.get(f"{which}_run", "")
        return Side(f"{base}run/{run}", *_ALWAYS) if run else None
    first, last = asked.get(f"{which}_from", "").strip(), asked.get(f"{which}_to", "").strip()
    if not (first or last):
        return None
    return Side(None, day(first) if first else _ALWAYS[0], day(last) if last else _ALWAYS[1])


def comparison(before: Answers, after: Answers) -> Comparison:
    """Hold the answers to the questions of both sides against each other."""
    kinds = {name: (_of(before, name), _of(after, name)) for name in _kinds(before) | _kinds(after)}
    return Comparison(
        pairs=tuple(_common(before["standstill"].first, after["standstill"].first)),
        kinds=tuple(
            (kind(name), tuple(_energy(kind(name), *kinds[name])))
            for name in sorted(kinds, key=lambda name: (not kind(name).electrical, name))
        ),
        joints=tuple(_joints(before["joints"].rows, after["joints"].rows)),
        apart=not _kinds(before) & _kinds(after),
    )


def to_sheet(compared: Comparison) -> Sheet:
    """Return a comparison as a table."""
    rows = [("", pair) for pair in compared.pairs]
    rows += [(of.name, pair) for of, pairs in compared.kinds for pair in pairs]
    rows += [("by the twin", pair) for pair in compared.joints]
    columns = ("known_from", "quantity", "unit", "before", "after", "difference", "difference_percent")
    return Sheet(
        columns, [(of, one.name, one.unit, one.before, one.after, one.difference, one.percent) for of, one in rows]
    )


def _common(before: Row | None, after: Row | None) -> list[ComparedPair]:
    def both(name: str) -> tuple[Any, Any]:
        return tuple(row[name] if row else None for row in (before, after))  # type: ignore[return-value]

    standing = [share(row["idle_s"], row["known_s"]) if row else None for row in (before, after)]
    return [
        ComparedPair("runs", "", *both("runs")),
        ComparedPair("time", "s", *both("time_s")),
        ComparedPair("stands still, of time", "%", *(_percent(value) for value in standing)),
    ]


def _energy(of: EnergyKind, before: Row | None, after: Row | None) -> list[ComparedPair]:
    def both(value: Any) -> tuple[Any, Any]:
        return tuple(value(row) if row else None for row in (before, after))  # type: ignore[return-value]

    pairs = [
        ComparedPair("runs with it", "", *both(lambda row: row["runs"])),
        ComparedPair("energy", "J", *both(lambda row: row["energy_j"])),
        ComparedPair("mean power", "W", *both(lambda row: share(row["energy_j"], row["time_s"]))),
        ComparedPair("peak power", "W", *both(lambda row: row["peak_w"])),
        ComparedPair("given back by braking joints", "J", *both(lambda row: row["returned_j"])),
    ]
    if of.electrical:
        standby = both(lambda row: _percent(share(row["standby_j"], row["modelled_j"])))
        pairs.append(ComparedPair("standby, of what the twin models", "%", *standby))
    return pairs


def _joints(before: tuple[Row, ...], after: tuple[Row, ...]) -> list[ComparedPair]:
    """Return the mean power of each joint, by the twin."""
    sides = [{row["joint_name"]: share(row["energy_j"], row["time_s"]) for row in rows} for rows in (before, after)]
    return [ComparedPair(name, "W", *(of.get(name) for of in sides)) for name in dict.fromkeys([*sides[0], *sides[1]])]


def _kinds(answers: Answers) -> set[str]:
    return {row["energy_from"] for row in answers["energy"].rows}


def _of(answers: Answers, name: str) -> Row | None:
    return next((row for row in answers["energy"].rows if row["energy_from"] == name), None)


def _percent(value: float | None) -> float | None:
    return None if value is None else 100.0 * value
