"""Figures of the gap report: curves and maps come from the diagnosis' evidence, which the graph names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from irtwin.report import wording
from irtwin.report.figures import MEASURED, PALETTE, Figure, plain
from irtwin.report.questions import Answers

Evidence = Mapping[str, Any]

BEFORE, AFTER, FLOOR = MEASURED, PALETTE[2], "#8C2D04"
_SHADES = [[0.0, "#FFFFFF"], [0.25, "#FDE3C4"], [0.6, "#EE9A4D"], [1.0, "#E07020"]]
_BANDED = 0.25


def figures(answers: Answers, evidence: Evidence) -> dict[str, Figure]:
    """Return every figure that there is evidence for, by name."""
    drawn = {"heat_map": heat_map(evidence.get("heat_map") or {})}
    for place, curve in enumerate(evidence.get("follows") or []):
        drawn[f"follows_{place}"] = follows(curve, effect_names(answers))
    for name, joint in (("runs_torque", foremost_joint(answers)), ("runs_power", None)):
        if name == "runs_power" or joint is not None:
            drawn[name] = runs(evidence.get("runs") or [], joint)
    drawn["by_cause"] = by_cause(answers)
    return {name: figure for name, figure in drawn.items() if figure is not None}


def foremost_joint(answers: Answers) -> str | None:
    """Return the joint with the largest share of the gap, None where no torque shows one."""
    joints = (row["joint"] for row in answers["locations"].rows if row["channel"] == "torque" and row["joint"])
    return next(joints, None)


def heat_map(given: Evidence) -> Figure | None:
    """Draw the excess of each joint in each regime."""
    if not given.get("joints") or not given.get("regimes"):
        return None
    values = given["excess"]
    known = [value for row in values for value in row if value is not None]
    if not known:
        return None
    regimes = [plain(name.replace("_", " ")) for name in given["regimes"]]
    cells = {
        "type": "heatmap", "x": regimes, "y": [plain(name) for name in given["joints"]], "z": values, "zmin": 0,
        "zmax": max(1.0, *known), "colorscale": _SHADES, "xgap": 2, "ygap": 2, "hoverongaps": False,
        "text": [[_cell(value) for value in row] for row in values], "texttemplate": "%{text}",
        "colorbar": {"title": {"text": "excess"}, "thickness": 12, "outlinewidth": 0},
        "hovertemplate": "%{y}, %{x}<br>excess %{z:.3~g}<extra></extra>",
    }  # fmt: skip
    axes = {"xaxis": {"type": "category", "side": "top"}, "yaxis": {"type": "category", "autorange": "reversed"}}
    return {"data": [cells], "layout": {**axes, "hovermode": "closest", "margin": {"l": 80, "r": 12, "t": 40, "b": 12}}}


def effect_names(answers: Answers) -> dict[str, str]:
    """Return what the ontology calls the effects that are causes, by their ids."""
    return {wording.local_name(row["effect"]): row["label"] for row in answers["causes"].rows if row["label"]}


def follows(curve: Evidence, names: Mapping[str, str]) -> Figure:
    """Draw the residual against the variable that it follows, and the effect's curve on it."""
    unit = "W" if curve.get("channel") == "power" else "N m"
    x, data = list(curve["x"]), []
    if curve.get("low") and curve.get("high"):
        edge = {
            "type": "scatter",
            "mode": "lines",
            "x": x,
            "line": {"width": 0},
            "hoverinfo": "skip",
            "showlegend": False,
        }
        band = {"fill": "tonexty", "fillcolor": f"rgba(95,109,122,{_BANDED})", "name": "spread", "showlegend": True}
        data += [{**edge, "y": list(curve["low"])}, {**edge, "y": list(curve["high"]), **band}]
    left = f"%{{y:.3~g}} {unit}<extra></extra>"
    data.append(
        {
            "type": "scatter",
            "mode": "markers",
            "name": "what the twin leaves",
            "x": x,
            "y": list(curve["residual"]),
            "marker": {"color": MEASURED, "size": 5},
            "hovertemplate": f"residual {left}",
        }
    )
    if curve.get("fitted"):
        effect = curve.get("effect") or "fitted_curve"
        name = plain(names.get(effect, effect.replace("_", " ")))
        line = {"color": PALETTE[5], "width": 2.5}
        data.append(
            {
                "type": "scatter",
                "mode": "lines",
                "name": name,
                "x": x,
                "y": list(curve["fitted"]),
                "line": line,
                "hovertemplate": f"{name} {left}",
            }
        )
    variable = curve["variable"].replace("_", " ")
    unit_of_x = wording.unit_symbol(curve.get("unit"))
    title = f"{variable}, {unit_of_x}" if unit_of_x else variable
    xaxis = {"type": "linear", "title": {"text": plain(title)}, "zeroline": True}
    return {"data": data, "layout": {"xaxis": xaxis, "yaxis": {"title": {"text": f"residual, {unit}"}}}}


def runs(given: Sequence[Evidence], joint: str | None) -> Figure | None:
    """Draw the RMSE of each held-out run before and after, with its noise floor; power where `joint` is None."""
    rows = [row for row in given if row.get("joint") == joint]
    if not rows:
        return None
    unit = "W" if joint is None else "N m"
    names = [plain(row["run"]) for row in rows]
    data: list[dict[str, Any]] = [
        {
            "type": "bar", "name": name, "x": names, "y": [row.get(key) for row in rows], "marker": {"color": colour},
            "hovertemplate": f"{name} %{{y:.3~g}} {unit}<extra></extra>",
        }
        for name, key, colour in (("before", "before", BEFORE), ("with the causes added", "after", AFTER))
    ]  # fmt: skip
    if any(row.get("floor") is not None for row in rows):
        marker = {"symbol": "line-ew", "size": 34, "line": {"color": FLOOR, "width": 2}}
        data.append(
            {
                "type": "scatter",
                "mode": "markers",
                "name": "noise floor",
                "x": names,
                "y": [row.get("floor") for row in rows],
                "marker": marker,
                "hovertemplate": f"noise floor %{{y:.3~g}} {unit}<extra></extra>",
            }
        )
    yaxis = {"title": {"text": f"RMSE, {unit}"}, "rangemode": "tozero"}
    return {"data": data, "layout": {"barmode": "group", "yaxis": yaxis}}


def by_cause(answers: Answers) -> Figure | None:
    """Draw the RMSE that is left with each cause alone, and with all causes but it; the foremost channel's."""
    of_any = answers["changes_by_cause"].rows
    rows = [row for row in of_any if row["measure"] == of_any[0]["measure"]]
    if not rows:
        return None
    unit = rows[0]["unit"]
    data = []
    for name, part, colour in (("alone", "alone", AFTER), ("all causes but it", "without", PALETTE[4])):
        of_part = [row for row in rows if row["part"] == part]
        bars = {
            "type": "bar", "name": name, "x": [plain(f"{row['rank']}. {row['label']}") for row in of_part],
            "y": [row["after"] for row in of_part], "marker": {"color": colour},
            "hovertemplate": f"{name} %{{y:.3~g}} {unit}<extra></extra>",
        }  # fmt: skip
        data.append(bars)
    line = {"color": BEFORE, "width": 1.5, "dash": "dash"}
    before = rows[0]["before"]
    shape = {"type": "line", "xref": "paper", "x0": 0, "x1": 1, "y0": before, "y1": before, "line": line}
    note = {
        "x": 0.995, "xref": "paper", "xanchor": "right", "y": before, "yanchor": "bottom", "showarrow": False,
        "text": "before", "font": {"color": BEFORE}, "bgcolor": "rgba(255,255,255,0.85)",
    }  # fmt: skip
    yaxis = {"title": {"text": f"RMSE, {unit}"}, "rangemode": "tozero"}
    return {"data": data, "layout": {"barmode": "group", "yaxis": yaxis, "shapes": [shape], "annotations": [note]}}


def _cell(value: float | None) -> str:
    return "" if value is None else f"{value:.2f}"
