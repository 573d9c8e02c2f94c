"""Figures of a page as Plotly data and layout, made from the rows of its questions."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from typing import Any

from irtwin.report import wording
from irtwin.report.colours import MEASURED, MODELLED, PALETTE, effect_colour
from irtwin.report.questions import Answer, Answers, Row, limits
from irtwin.report.traces import Figure, axis, bars, beside, level, plain

ROBOT_WIDE = "whole robot"


def figures(answers: Answers) -> dict[str, Figure | None]:
    """Return every bar figure by name; None where the graph has nothing to draw."""
    colours = _effect_colours(answers)
    return {
        "energy_per_day": energy_per_day(answers["energy_per_day"]),
        "energy_per_run": energy_per_run(answers["energy_per_run"]),
        "energy_error": energy_error(answers["energy_per_run"], limits(answers)["seed_energy_error"]),
        "energy_per_joint": energy_per_joint(answers["energy_per_joint"]),
        "energy_per_effect": energy_per_effect(answers["energy_per_effect"], colours),
        "energy_per_joint_and_effect": energy_per_joint_and_effect(answers["energy_per_joint_and_effect"], colours),
    }


def energy_per_day(answer: Answer) -> Figure | None:
    """Draw energy (J) per calendar day; None for a single day, which a sentence says better."""
    rows = answer.rows
    if len(rows) < 2:
        return None
    size, unit = wording.energy_unit(row["energy_j"] for row in rows)
    days = bars("energy", _column(rows, "day"), _scaled(_column(rows, "energy_j"), size), unit, PALETTE[0])
    return {"data": [days], "layout": {"xaxis": {"type": "category"}, "yaxis": axis("energy", unit)}}


def energy_per_run(answer: Answer) -> Figure | None:
    """Draw measured beside modelled energy (J) of each run."""
    rows = answer.rows
    if not rows:
        return None
    size, unit = wording.energy_unit(row[key] for row in rows for key in ("measured_j", "modelled_j"))
    runs = _labels(rows, "run_name")
    data = [bars("modelled by the twin", runs, _scaled(_column(rows, "modelled_j"), size), unit, MODELLED)]
    if any(row["measured_j"] is not None for row in rows):
        data.insert(0, bars("measured", runs, _scaled(_column(rows, "measured_j"), size), unit, MEASURED))
    return {"data": data, "layout": {"barmode": "group", "yaxis": axis("energy", unit)}}


def energy_error(answer: Answer, seed_error: float) -> Figure | None:
    """Draw the energy error (%) of each run beside the one that the seed paper reached."""
    rows = [row for row in answer.rows if row["error_percent"] is not None]
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
            drawn = bars(name, _labels(of_part, "run_name"), _column(of_part, "error_percent"), "%", "")
            data.append({**drawn, "marker": marker})
    order = {"categoryorder": "array", "categoryarray": _labels(rows, "run_name")}
    lines = [level(seed_error), level(-seed_error)]
    lines = lines if any(row["error_percent"] < 0 for row in rows) else lines[:1]
    layout = {"barmode": "overlay", "xaxis": order, "yaxis": axis("energy error", "%"),
              "shapes": lines, "annotations": [beside(seed_error, f"seed paper: {seed_error} %")]}  # fmt: skip
    return {"data": data, "layout": layout}


def energy_per_joint(answer: Answer) -> Figure | None:
    """Draw the energy (J) of each joint, stacked, run by run; None for one run, which the other figure shows."""
    return (
        None
        if _one_run(answer)
        else _stack(answer.rows, "run_name", _by_joint, _palette(_by_joint(row) for row in answer.rows))
    )


def energy_per_effect(answer: Answer, colours: dict[str, str]) -> Figure | None:
    """Draw the energy (J) of each effect, stacked, run by run; None for one run, which the other figure shows."""
    return None if _one_run(answer) else _stack(answer.rows, "run_name", _by_effect, colours)


def energy_per_joint_and_effect(answer: Answer, colours: dict[str, str]) -> Figure | None:
    """Draw the energy (J) of all runs: a bar for each joint and one for the whole robot, stacked by effect."""
    rows = sorted(answer.rows, key=lambda row: row["joint"] is None)  # effects of the whole robot come last
    return _stack([{**row, "joint": row["joint"] or ROBOT_WIDE} for row in rows], "joint", _by_effect, colours)


def _one_run(answer: Answer) -> bool:
    return len({row["run_name"] for row in answer.rows}) < 2


_HATCHED = {
    "color": "#FFFFFF",
    "line": {"color": PALETTE[0], "width": 1},
    "pattern": {"shape": "/", "fgcolor": PALETTE[0], "size": 6, "solidity": 0.25},
}


def _stack(rows: Sequence[Row], category: str, series: Callable[[Row], str], colours: dict[str, str]) -> Figure | None:
    if not rows:
        return None
    totals: dict[str, float] = defaultdict(float)
    for row in rows:
        totals[row[category]] += max(row["energy_j"], 0.0)
    size, unit = wording.energy_unit(totals.values())
    data = []
    present = {series(row) for row in rows}
    for name in (name for name in colours if name in present):
        of_series = [row for row in rows if series(row) == name]
        values = _scaled(_column(of_series, "energy_j"), size)
        data.append(bars(plain(name), _labels(of_series, category), values, unit, colours[name]))
    order = {"categoryorder": "array", "categoryarray": list(dict.fromkeys(_labels(rows, category)))}
    return {"data": data, "layout": {"barmode": "relative", "xaxis": order, "yaxis": axis("energy", unit)}}


def _column(rows: Iterable[Row], name: str) -> list[Any]:
    return [row[name] for row in rows]


def _labels(rows: Iterable[Row], name: str) -> list[str]:
    return [plain(row[name]) for row in rows]


def _scaled(values: Iterable[float | None], size: float) -> list[float | None]:
    return [None if value is None else float(f"{value / size:.5g}") for value in values]


def _by_joint(row: Row) -> str:
    return str(row["joint"])


def _by_effect(row: Row) -> str:
    return row["label"] or wording.local_name(row["effect"]).replace("_", " ")


def _effect_colours(answers: Answers) -> dict[str, str]:
    """Return a colour for each effect's label, that which takes the most energy first."""
    taken: dict[str, float] = {}
    colours: dict[str, str] = {}
    for row in answers["energy_per_effect"].rows:
        label = _by_effect(row)
        taken[label] = taken.get(label, 0.0) + row["energy_j"]
        colours[label] = effect_colour(wording.local_name(row["effect"]))
    return {label: colours[label] for label in sorted(taken, key=lambda label: taken[label], reverse=True)}


def _palette(names: Iterable[str]) -> dict[str, str]:
    return {name: PALETTE[index % len(PALETTE)] for index, name in enumerate(dict.fromkeys(names))}
