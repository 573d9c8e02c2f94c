"""Two runs, or two times, of one robot side by side: energy, standby and joints before and after a change."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from operator import itemgetter

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
    sides = [{row["energy_from"]: row for row in answers["energy"].rows} for answers in (before, after)]
    names = sorted(sides[0].keys() | sides[1].keys(), key=lambda name: (not kind(name).electrical, name))
    joints = [{row["joint_name"]: row for row in answers["joints"].rows} for answers in (before, after)]
    return Comparison(
        pairs=_pairs(_OF_ANY, before["standstill"].first, after["standstill"].first),
        kinds=tuple((kind(name), _of_energy(kind(name), *(of.get(name) for of in sides))) for name in names),
        joints=tuple(
            ComparedPair(name, "W", *(_mean_power(of.get(name)) for of in joints)) for name in joints[0] | joints[1]
        ),
        apart=not sides[0].keys() & sides[1].keys(),
    )


def to_sheet(compared: Comparison) -> Sheet:
    """Return a comparison as a table."""
    rows = [("", pair) for pair in compared.pairs]
    rows += [(of.name, pair) for of, pairs in compared.kinds for pair in pairs]
    rows += [("by the twin", pair) for pair in compared.joints]
    columns = ("known_from", "quantity", "unit", "before", "after", "difference", "difference_percent")
    return Sheet(
        columns,
        [(of, pair.name, pair.unit, pair.before, pair.after, pair.difference, pair.percent) for of, pair in rows],
    )


def _of_energy(of: EnergyKind, before: Row | None, after: Row | None) -> tuple[ComparedPair, ...]:
    return _pairs((*_OF_ENERGY, _STANDBY) if of.electrical else _OF_ENERGY, before, after)


def _pairs(quantities: Iterable[Quantity], before: Row | None, after: Row | None) -> tuple[ComparedPair, ...]:
    """Return quantities on both sides, in their order."""
    return tuple(
        ComparedPair(name, unit, *(value(row) if row else None for row in (before, after)))
        for name, unit, value in quantities
    )


def _mean_power(row: Row | None) -> float | None:
    return share(row["energy_j"], row["time_s"]) if row else None


def _percent(part: float | None, whole: float | None) -> float | None:
    value = share(part, whole)
    return None if value is None else 100.0 * value


Quantity = tuple[str, str, Callable[[Row], float | None]]  # name, unit, and its value of a row
_OF_ANY: tuple[Quantity, ...] = (
    ("runs", "", itemgetter("runs")),
    ("time", "s", itemgetter("time_s")),
    ("stands still, of time", "%", lambda row: _percent(row["idle_s"], row["known_s"])),
)
_OF_ENERGY: tuple[Quantity, ...] = (
    ("runs with it", "", itemgetter("runs")),
    ("energy", "J", itemgetter("energy_j")),
    ("mean power", "W", _mean_power),
    ("peak power", "W", itemgetter("peak_w")),
    ("given back by braking joints", "J", itemgetter("returned_j")),
)
_STANDBY: Quantity = (
    "standby, of what the twin models", "%", lambda row: _percent(row["standby_j"], row["modelled_j"]),
)  # fmt: skip
