"""Figures of the gap report: numbers by the questions, curves alone from the evidence file that the graph names."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence

from irtwin.document.curves import Curves, Followed, PlannedMotion
from irtwin.report import wording
from irtwin.report.colours import LIMIT, MEASURED, PALETTE, effect_colour
from irtwin.report.questions import Answers, Row
from irtwin.report.traces import TIME, Figure, axis, band, bars, beside, level, plain, trace

BEFORE, AFTER, FLOOR = MEASURED, PALETTE[2], LIMIT
_SHADES = [[0.0, "#FFFFFF"], [0.25, "#FDE3C4"], [0.6, "#EE9A4D"], [1.0, "#E07020"]]
_BANDED = 0.25
_TICKS = (0, 1, 3, 10, 30, 100, 300)
_DECADES = (0, 10, 100, 1000, 10_000, 100_000, 1_000_000)
_WIDE = 2.6  # decades of excess
_LEAST_TOP = 3.0  # excess at which the scale ends where there is none larger: noise must not look like a gap
_JOINTS_DRAWN = 7
_CURVES = 3  # of one effect


def figures(answers: Answers, curves: Curves) -> dict[str, Figure]:
    """Return every figure that there is something to draw for, by name."""
    drawn: dict[str, Figure | None] = {}
    drawn["heat_map"] = heat_map(answers["regime_excess"].rows)
    for place, curve in enumerate(curves.follows):
        unit = "W" if curve.channel == "power" else effort_unit(curve.joint, answers)
        drawn[f"follows_{place}"] = follows(curve, unit, effect_names(answers))
    for measure, joint in (("torque", foremost_joint(answers)), ("power", None), ("position", None), ("flange", None)):
        wanted = (f"{measure}_rmse", joint)
        drawn[f"runs_{measure}"] = runs(
            [row for row in answers["run_changes"].rows if (row["measure"], row["joint"]) == wanted]
        )
    drawn["horizons"] = horizons(answers["horizons"].rows)
    drawn["by_cause"] = by_cause(answers)
    if curves.experiment is not None:
        drawn["experiment"] = experiment(curves.experiment)
    return {name: figure for name, figure in drawn.items() if figure is not None}


def foremost_joint(answers: Answers) -> str | None:
    """Return the joint with the largest share of the gap, None where no torque shows one."""
    joints = (row["joint"] for row in answers["locations"].rows if row["channel"] == "torque" and row["joint"])
    return next(joints, None)


def effort_unit(joint: str | None, answers: Answers) -> str:
    """Return the unit of a joint's effort: a force where it slides, a torque where it turns."""
    return "N" if any(row["joint"] == joint for row in answers["sliding_joints"].rows) else "N m"


def heat_map(given: Sequence[Row]) -> Figure | None:
    """Draw the excess of each joint in each regime, None where it is known of none."""
    known = [row["excess"] for row in given if row["excess"] is not None]
    if not known:
        return None
    regimes = [plain(name) for name in dict.fromkeys(row["regime"] for row in given)]
    joints: dict[str, list[float | None]] = {}
    for row in given:
        joints.setdefault(row["joint"], []).append(row["excess"])
    values = list(joints.values())
    top = math.log10(1 + max(_LEAST_TOP, *known))
    ticks = [tick for tick in (_TICKS if top < _WIDE else _DECADES) if math.log10(1 + tick) <= top]
    cells = {
        "type": "heatmap", "x": regimes, "y": [plain(name) for name in joints], "zmin": 0, "zmax": top,
        "z": [[None if value is None else math.log10(1 + max(value, 0.0)) for value in row] for row in values],
        "customdata": values, "colorscale": _SHADES, "xgap": 2, "ygap": 2, "hoverongaps": False,
        "text": [[_cell(value) for value in row] for row in values], "texttemplate": "%{text}",
        "colorbar": {
            "title": {"text": "excess"}, "thickness": 10, "outlinewidth": 0, "tickmode": "array",
            "tickvals": [math.log10(1 + tick) for tick in ticks], "ticktext": [f"{tick:,}" for tick in ticks],
        },
        "hovertemplate": "%{y}, %{x}<br>excess %{customdata:.3~g}<extra></extra>",
    }  # fmt: skip
    axes = {
        "xaxis": {"type": "category", "side": "top", "tickangle": -55},
        "yaxis": {"type": "category", "autorange": "reversed"},
    }
    return {"data": [cells], "layout": {**axes, "hovermode": "closest", "margin": {"l": 80, "r": 12, "t": 95, "b": 12}}}


def foremost_curves(curves: Sequence[Followed], answers: Answers) -> list[Followed]:
    """Return the curves of each effect at the joints where most of the gap lies; an arm has too many to show all.

    Effects that close little have none.
    """
    causes = [(wording.local_name(row["effect"]), row["told"]) for row in answers["causes"].rows]
    little = {effect for effect, _ in causes} - {effect for effect, told in causes if told}
    order = list(dict.fromkeys(row["joint"] for row in answers["locations"].rows))
    first = {joint: place for place, joint in enumerate(order)}
    of_effect: dict[str | None, list[int]] = {}
    for place, curve in enumerate(curves):
        if curve.effect in little:
            continue
        of_effect.setdefault(curve.effect, []).append(place)
    kept = [
        place
        for places in of_effect.values()
        for place in sorted(places, key=lambda k: first.get(curves[k].joint, len(first)))[:_CURVES]
    ]
    return [curves[place] for place in sorted(kept)]


def effect_names(answers: Answers) -> dict[str, str]:
    """Return what the ontology calls the effects that the diagnosis names, by their ids."""
    questions = ("causes", "not_testable", "refused")
    named = [(row["effect"], row["label"]) for question in questions for row in answers[question].rows]
    named += [(row["rival"], row["rival_label"]) for row in answers["rivals"].rows]
    return {wording.local_name(effect): label for effect, label in named if label}


def follows(curve: Followed, unit: str, names: Mapping[str, str]) -> Figure:
    """Draw the residual, of this unit, against the variable that it follows, and the effect's curve on it."""
    data = [
        *band(curve.x, curve.low, curve.high, f"rgba(95,109,122,{_BANDED})", name="spread", showlegend=True),
        trace("residual", curve.x, curve.residual, unit, mode="markers", marker={"color": MEASURED, "size": 5}),
    ]
    if curve.fitted is not None:
        effect = curve.effect or "fitted_curve"
        name = plain(names.get(effect, effect.replace("_", " ")))
        line = {"color": effect_colour(effect), "width": 2.5}
        data.append(trace(name, curve.x, curve.fitted, unit, line=line))
    variable = curve.variable.replace("_", " ")
    unit_of_x = wording.unit_symbol(curve.unit)
    title = f"{variable}, {unit_of_x}" if unit_of_x else variable
    xaxis = {"type": "linear", "title": {"text": plain(title)}, "zeroline": True}
    return {"data": data, "layout": {"xaxis": xaxis, "yaxis": {"title": {"text": f"residual, {unit}"}}}}


def runs(rows: Sequence[Row]) -> Figure | None:
    """Draw the RMSE of each held-out run before and after, with its floor; None where nothing changed."""
    if all(row["before"] == row["after"] for row in rows):
        return None
    unit = rows[0]["unit"]
    names = _numbered([plain(row["run_name"]) for row in rows])
    data = [
        bars("before", names, [row["before"] for row in rows], unit, BEFORE),
        bars("with the causes added", names, [row["after"] for row in rows], unit, AFTER),
    ]
    if any(row["floor"] is not None for row in rows):
        marker = {"symbol": "line-ew", "size": 34, "line": {"color": FLOOR, "width": 2}}
        data.append(trace("noise floor", names, [row["floor"] for row in rows], unit, mode="markers", marker=marker))
    return {"data": data, "layout": {"barmode": "group", "yaxis": axis("RMSE", unit)}}


def horizons(rows: Sequence[Row]) -> Figure | None:
    """Draw how tracking error grows after a run is begun anew, before and after; None where nothing was played."""
    if not rows:
        return None
    unit = rows[0]["unit"]
    seconds = [row["seconds"] for row in rows]
    data = [
        trace(name, seconds, [row[part] for row in rows], unit, "lines+markers", line={"color": colour, "width": 2.5})
        for name, part, colour in (("simulator", "before", BEFORE), ("with the robot’s numbers", "after", AFTER))
    ]
    xaxis = {"type": "linear", **axis("time since begun anew", "s")}
    return {"data": data, "layout": {"xaxis": xaxis, "yaxis": axis("tracking error", unit)}}


def by_cause(answers: Answers) -> Figure | None:
    """Draw the RMSE that is left with each cause alone, and with all causes but it; the foremost channel's.

    None for a single cause, which the table says.
    """
    of_any = answers["changes_by_cause"].rows
    rows = [row for row in of_any if row["measure"] == of_any[0]["measure"]]
    if len({row["cause"] for row in rows}) < 2:
        return None
    unit = rows[0]["unit"]
    place_of = {row["cause"]: place for place, row in enumerate(answers["causes"].rows, start=1)}
    rows = sorted(rows, key=lambda row: place_of[row["cause"]])
    data = []
    for name, part, colour in (("cause alone", "alone", AFTER), ("all causes but this one", "without", PALETTE[4])):
        of_part = [row for row in rows if row["part"] == part]
        causes = [plain(f"{place_of[row['cause']]}. {row['label']}") for row in of_part]
        data.append(bars(name, causes, [row["after"] for row in of_part], unit, colour))
    before = rows[0]["before"]
    line, note = level(before, BEFORE), beside(before, "before", BEFORE, "right")
    layout = {"barmode": "group", "yaxis": axis("RMSE", unit), "shapes": [line], "annotations": [note]}
    return {"data": data, "layout": layout}


def experiment(curve: PlannedMotion) -> Figure:
    """Draw the positions that the proposed experiment commands."""
    drawn = list(zip(curve.joints, curve.units, curve.q, strict=True))[:_JOINTS_DRAWN]
    lines = [
        trace(plain(joint), curve.time, q, unit, line={"width": 1.5, "color": PALETTE[place % len(PALETTE)]})
        for place, (joint, unit, q) in enumerate(drawn)
    ]
    units = " or ".join(sorted(set(curve.units), reverse=True))
    return {"data": lines, "layout": {"xaxis": TIME, "yaxis": {"title": {"text": f"position, {units}"}}}}


def _numbered(names: Sequence[str]) -> list[str]:
    """Return names with a number where one stands more than once: the stretches of a run."""
    total, count = Counter(names), Counter[str]()
    numbered = []
    for name in names:
        count[name] += 1
        numbered.append(f"{name}, part {count[name]}" if total[name] > 1 else name)
    return numbered


def _cell(value: float | None) -> str:
    """Write an excess short enough for a cell."""
    if value is None:
        return ""
    if abs(value) < 10:
        return f"{round(value, 1) + 0.0:.1f}".replace("-", "\N{MINUS SIGN}")  # no -0.0
    return f"{value:.0f}" if value < 10_000 else f"{value / 1000:.0f}k"
