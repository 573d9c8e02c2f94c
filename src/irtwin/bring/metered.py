"""A meter's energy as power: a column in kWh becomes the mean power from reading to reading."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from irtwin.bring.column_name import said_by
from irtwin.bring.recording import Recording

_ENERGY = re.compile(r"^(?P<name>.*?)[\s_.\-]*[\[(]?(?P<unit>kWh|MWh|Wh|MJ|kJ|J)[\])]?$", re.IGNORECASE)
_JOULES = {"wh": 3.6e3, "kwh": 3.6e6, "mwh": 3.6e9, "j": 1.0, "kj": 1e3, "mj": 1e6}
_NAMED = frozenset(["energy", "energie", "wirkarbeit", "arbeit", "verbrauch", "consumption", "zaehlerstand"])
POWER = "power_of_energy"  # the column's name from then on; W


def is_metered(names: Sequence[str]) -> bool:
    """Whether columns of these names are a meter's: power or energy, and nothing of a joint."""
    fields = {said_by(name).field for name in names}
    takes = "power" in fields or any(_joules(name, None) is not None for name in names)
    return takes and not fields & {"q", "dq", "ddq", "torque", "temperature"}


def with_power(log: Recording) -> Recording:
    """Return a meter's log with power, W, in place of the one column that says energy; as it is where it has power.

    A counter only rises: its steps are the energy from reading to reading. Else each value is the energy since the
    reading before.
    """
    times = [name for name in log.columns if said_by(name, log.units.get(name)).field == "time"]
    if len(times) != 1 or any(said_by(name, log.units.get(name)).field == "power" for name in log.columns):
        return log
    energies = {name: joules for name in log.columns if (joules := _joules(name, log.units.get(name))) is not None}
    if len(energies) != 1:
        return log
    ((name, joules),) = energies.items()
    time, values = _seconds(log.columns[times[0]]), log.columns[name].astype(float) * joules
    steps = np.diff(values)
    counter = bool((steps[np.isfinite(steps)] >= 0).all()) and np.ptp(values[np.isfinite(values)]) > 0
    spent = steps if counter else values[1:]
    with np.errstate(divide="ignore", invalid="ignore"):
        power = spent / np.diff(time)
    power = np.append(power, power[-1:]) if counter else np.insert(power, 0, power[:1])
    columns = {column: of for column, of in log.columns.items() if column != name} | {POWER: power}
    step = "a counter: power is its step over the time to the next reading"
    explanation = step if counter else "of each reading: power is it over the time since the reading before"
    said = (*log.said, f"{log.path}: column {name} is energy, {explanation}")
    return replace(log, columns=columns, units={**log.units, POWER: "W"}, said=said)


def _joules(name: str, unit: str | None) -> float | None:
    """Return how many J one of a column's unit is; None where it says no energy."""
    if unit is not None and unit.lower() in _JOULES:
        return _JOULES[unit.lower()]
    energy = _ENERGY.match(name.strip())
    if energy is None or (len(energy["unit"]) < 3 and not _NAMED & set(said_by(energy["name"]).words)):
        return None
    return _JOULES[energy["unit"].lower()]


def _seconds(time: np.ndarray) -> np.ndarray:
    return time.astype("int64") / 1e9 if time.dtype.kind == "M" else time.astype(float)
