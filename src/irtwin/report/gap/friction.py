"""Friction of each joint on the gap page: a small figure a joint, and a table of the numbers that people know."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from irtwin.document.curves import FrictionCurve
from irtwin.report import wording
from irtwin.report.colours import MEASURED, MODELLED, PALETTE
from irtwin.report.energy.tables import ParameterCell, ParameterLine, is_unsure
from irtwin.report.traces import Figure, band, plain, trace

_BANDED = "33"  # how opaque a band is, in hexadecimal


def figures(curves: Sequence[FrictionCurve]) -> dict[str, Figure]:
    """Return a figure of each joint's friction, on one side or on two, by the joint's name."""
    joints = dict.fromkeys(curve.joint for curve in reversed(curves))  # the sides that follow hold all of them
    return {joint: _figure([curve for curve in curves if curve.joint == joint]) for joint in reversed(joints)}


def table(curves: Sequence[FrictionCurve], names: Mapping[str, str]) -> tuple[ParameterLine, ...]:
    """Return a line for each number of friction and side, with a cell a joint; `names`: of effects, by their ids."""
    cells: dict[tuple[str, str, str, str], dict[str, ParameterCell]] = {}
    for curve in curves:
        for number in curve.numbers:
            value, interval = wording.interval(number.value, number.lower, number.upper)
            cell = ParameterCell(value, interval, is_unsure(number.value, number.lower, number.upper))
            cells.setdefault((number.effect, number.name, number.unit, curve.role), {})[curve.joint] = cell
    effects = list(dict.fromkeys(effect for effect, *_ in cells))
    several = len({curve.role for curve in curves}) > 1
    lines = []
    for key in sorted(cells, key=lambda key: (effects.index(key[0]), key[1])):
        effect, name, unit, role = key
        label = names.get(effect, effect.replace("_", " "))
        lines.append(ParameterLine(f"{label}, {role}" if several else label, name, unit, cells[key]))
    return tuple(lines)


def _figure(sides: Sequence[FrictionCurve]) -> Figure:
    *former, now = sides
    data = [trace for side in former for trace in _side(side, PALETTE[0], PALETTE[0])]
    data += _side(now, MODELLED, MODELLED if former else MEASURED)
    layout = {
        "title": {"text": plain(now.joint), "font": {"size": 13}, "x": 0, "xref": "paper", "y": 0.97},
        "xaxis": {"type": "linear", "title": {"text": f"speed, {now.speed_unit}"}, "zeroline": True},
        "yaxis": {"title": {"text": f"friction, {now.unit}"}, "zeroline": True},
        "showlegend": bool(former),
        "legend": {"x": 0, "y": 1, "xanchor": "left", "yanchor": "top", "traceorder": "normal"},  # no friction is there
        "hovermode": "closest",
    }
    return {"data": data, "layout": layout}


def _side(curve: FrictionCurve, colour: str, of_points: str) -> list[Figure]:
    """Return the traces of one side: the band, the curve in it, and what was measured."""
    at = f"%{{y:.3~g}} {curve.unit} at %{{x:.3~g}} {curve.speed_unit}<extra></extra>"
    line = trace(curve.role, curve.speed, curve.torque, "", line={"color": colour, "width": 2})
    traces = [
        *band(curve.speed, curve.low, curve.high, colour + _BANDED),
        {**line, "hovertemplate": f"twin {at}"},
    ]
    if (points := curve.measured) is not None:
        spread = {
            "type": "data", "symmetric": False, "thickness": 1, "width": 0,
            "array": [max(high - mean, 0.0) for high, mean in zip(points.high, points.torque, strict=True)],
            "arrayminus": [max(mean - low, 0.0) for low, mean in zip(points.low, points.torque, strict=True)],
        }  # fmt: skip
        traces.append(
            {
                "type": "scatter", "mode": "markers", "x": list(points.speed), "y": list(points.torque),
                "error_y": spread, "marker": {"color": of_points, "size": 5, "opacity": 0.8}, "showlegend": False,
                "hovertemplate": f"measured {at}",
            }
        )  # fmt: skip
    return traces
