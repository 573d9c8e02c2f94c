"""Energies by what they are known from: electrical ones beside each other, mechanical ones by themselves."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from irtwin.report.questions import Row


@dataclass(frozen=True)
class EnergyKind:
    """What an energy is known from, as `irt:Energy_From` says it; only an electrical one has a price."""

    name: str
    title: str
    meaning: str
    electrical: bool = True


MEASURED = EnergyKind("measured", "Electrical energy, measured", "From logged power.")
MODELLED = EnergyKind(
    "modelled", "Electrical energy by the twin", "No power was logged: this is what the twin says it takes."
)
MECHANICAL = EnergyKind(
    "mechanical",
    "Mechanical energy by the twin",
    "Work of the joints alone, without losses of motors and drives and without standby. It is not what the meter "
    "shows, so it has no price and does not stand beside electrical energy.",
    electrical=False,
)
KINDS = {kind.name: kind for kind in (MEASURED, MODELLED, MECHANICAL)}


def kwh(joules: float | None) -> float | None:
    """Return an energy (J) in kWh."""
    return None if joules is None else joules / 3.6e6


@dataclass(frozen=True)
class Bar:
    """A day's energy; `height` is its part of the greatest, 0 to 1."""

    day: str
    energy_j: float
    height: float


Days = tuple[Bar, ...]
"""Energy by day, oldest first, drawn as bars."""


def kind(name: str | None) -> EnergyKind:
    """Return a kind by its name; one that the project does not know stands by itself, without a price."""
    return KINDS.get(name or "") or EnergyKind(name or "unknown", "Energy of unknown origin", "", electrical=False)


def share(part: float | None, whole: float | None) -> float | None:
    """Return what part of a whole something is, None where that says nothing."""
    return part / whole if part is not None and whole else None


def days(energies: Mapping[str, float], most: int) -> Days | None:
    """Return the newest days as bars, `most` of them; None for fewer than two, which are no trend."""
    newest = sorted(energies.items())[-most:]
    if len(newest) < 2:
        return None
    greatest = max(energy for _, energy in newest)
    return tuple(Bar(day, energy, max(energy, 0.0) / greatest if greatest > 0 else 0.0) for day, energy in newest)


def by_day(rows: Iterable[Row]) -> dict[tuple[str, str], dict[str, float]]:
    """Gather the answers to `days.rq`: robot and kind to the energy (J) of each day."""
    daily: dict[tuple[str, str], dict[str, float]] = defaultdict(dict)
    for row in rows:
        if row["energy_j"] is not None:
            daily[row["robot"], row["energy_from"]][row["day"]] = row["energy_j"]
    return daily


def added_up(energies: Iterable[Mapping[str, float]]) -> dict[str, float]:
    """Add the days of several robots up."""
    total: dict[str, float] = defaultdict(float)
    for of_one in energies:
        for day, energy in of_one.items():
            total[day] += energy
    return total
