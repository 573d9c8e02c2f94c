"""Figures of a page as Plotly data and layout, made from the rows of its questions."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from typing import Any

from irtwin.report import wording
from irtwin.report.colours import MEASURED, MODELLED, PALETTE, effect_colour
from irtwin.report.questions import Answers, Row, effect_name, limits
from irtwin.report.traces import Figure, axis, bars, beside, level, plain

ROBOT_WIDE = "whole robot"
_HATCHED = {
    "color": "#FFFFFF",
    "line": {"color": PALETTE[0], "width": 1},
    "pattern": {"shape": "/", "fgcolor": PALETTE[0], "size": 6, "solidity": 0.25},
}


def figures(answers: Answers) -> dict[str, Figure | None]:
    """Return every bar figure by name, of energies in J; None where the graph has nothing to draw.

    Of one run alone the figure by joint and effect shows all that those by run would.
    """
    per_joint, per_effect = answers["energy_per_joint"].rows, answers["energy_per_effect"].rows
    joints = {name: PALETTE[place % len(PALETTE)] for place, name in enumerate(dict.fromkeys(map(_joint, per_joint)))}
    effects = _effect_colours(per_effect)
    places = sorted(answers["energy_per_joint_and_effect"].rows, key=lambda row: row["joint"] is None)  # robot's last
    return {
        "energy_per_day": _per_day(answers["energy_per_day"].rows),
        "energy_per_run": _per_run(answers["energy_per_run"].rows),
        "energy_error": _errors(answers["energy_per_run"].rows, limits(answers)["seed_energy_error"]),
        "energy_per_joint": _of_several_runs(per_joint, _joint, joints),
        "energy_per_effect": _of_several_runs(per_effect, effect_name, effects),
        "energy_per_joint_and_effect": _stack(
            [{**row, "joint": row["joint"] or ROBOT_WIDE} for row in places], "joint", effect_name, effects
        ),
    }


def _per_day(rows: Sequence[Row]) -> Figure | None:
    """Draw energy per calendar day; None for a single day, which a sentence says better."""
    if len(rows) < 2:
        return None
    size, unit = wording.energy_unit(row["energy_j"] for row in rows)
    days = bars("energy", [row["day"] for row in rows], _scaled(rows, "energy_j", size), unit, PALETTE[0])
    return {"data": [days], "layout": {"xaxis": {"type": "category"}, "yaxis": axis("energy", unit)}}


def _per_run(rows: Sequence[Row]) -> Figure | None:
    """Draw measured beside modelled energy of each run."""
    if not rows:
        return None
    size, unit = wording.energy_unit(row[key] for row in rows for key in ("measured_j", "modelled_j"))
    runs = _labels(rows, "run_name")
    data = [bars("modelled by the twin", runs, _scaled(rows, "modelled_j", size), unit, MODELLED)]
    if any(row["measured_j"] is not None for row in rows):
        data.insert(0, bars("measured", runs, _scaled(rows, "measured_j", size), unit, MEASURED))
    return {"data": data, "layout": {"barmode": "group", "yaxis": axis("energy", unit)}}


def _errors(of_runs: Sequence[Row], seed_error: float) -> Figure | None:
    """Draw the energy error (%) of each run beside the one that the seed paper reached."""
    rows = [row for row in of_runs if row["error_percent"] is not None]
    if not rows:
        return None
    kinds: tuple[tuple[str, bool, dict[str, Any]], ...] = (
        ("held out of the fit", True, {"color": PALETTE[0]}),
        ("took part in the fit", False, _HATCHED),
    )
    data = []
    for name, is_held_out, marker in kinds:
        of_part = [row for row in rows if (row["part"] in ("held_out", "both")) is is_held_out]
        if of_part:
            drawn = bars(name, _labels(of_part, "run_name"), [row["error_percent"] for row in of_part], "%", "")
            data.append({**drawn, "marker": marker})
    order = {"categoryorder": "array", "categoryarray": _labels(rows, "run_name")}
    lines = [level(seed_error), level(-seed_error)]
    lines = lines if any(row["error_percent"] < 0 for row in rows) else lines[:1]
    layout = {"barmode": "overlay", "xaxis": order, "yaxis": axis("energy error", "%"),
              "shapes": lines, "annotations": [beside(seed_error, f"seed paper: {seed_error} %")]}  # fmt: skip
    return {"data": data, "layout": layout}


def _of_several_runs(rows: Sequence[Row], series: Callable[[Row], str], colours: dict[str, str]) -> Figure | None:
    return _stack(rows, "run_name", series, colours) if len({row["run_name"] for row in rows}) > 1 else None


def _stack(rows: Sequence[Row], category: str, series: Callable[[Row], str], colours: dict[str, str]) -> Figure | None:
    """Draw the energy of each category, stacked by series in the order of their colours."""
    if not rows:
        return None
    totals: dict[str, float] = defaultdict(float)
    for row in rows:
        totals[row[category]] += max(row["energy_j"], 0.0)
    size, unit = wording.energy_unit(totals.values())
    data = []
    for name, colour in colours.items():
        if of_series := [row for row in rows if series(row) == name]:
            values = _scaled(of_series, "energy_j", size)
            data.append(bars(plain(name), _labels(of_series, category), values, unit, colour))
    order = {"categoryorder": "array", "categoryarray": list(dict.fromkeys(_labels(rows, category)))}
    return {"data": data, "layout": {"barmode": "relative", "xaxis": order, "yaxis": axis("energy", unit)}}


def _labels(rows: Iterable[Row], name: str) -> list[str]:
    return [plain(row[name]) for row in rows]


def _scaled(rows: Iterable[Row], name: str, size: float) -> list[float | None]:
    return [None if row[name] is None else float(f"{row[name] / size:.5g}") for row in rows]


def _joint(row: Row) -> str:
    return str(row["joint"])


def _effect_colours(rows: Iterable[Row]) -> dict[str, str]:
    """Return a colour for each effect's label, that which takes the most energy first."""
    taken: dict[str, float] = defaultdict(float)
    colours: dict[str, str] = {}
    for row in rows:
        label = effect_name(row)
        taken[label] += row["energy_j"]
        colours[label] = effect_colour(wording.local_name(row["effect"]))
    return {label: colours[label] for label in sorted(taken, key=lambda label: taken[label], reverse=True)}
