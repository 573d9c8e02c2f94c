"""What figures on pages are drawn of, as Plotly's traces, axes and lines."""

from __future__ import annotations

import html
from collections.abc import Sequence
from typing import Any

from irtwin.report.colours import LIMIT

Figure = dict[str, Any]  # {"data": [...], "layout": {...}}
TIME: Figure = {"type": "linear", "title": {"text": "time, s"}, "zeroline": False}  # an axis


def plain(text: str) -> str:
    """Return a name as Plotly must see it, which takes `<` for markup."""
    return html.escape(text, quote=False)


def trace(name: str, x: Sequence[Any], y: Sequence[Any], unit: str, mode: str = "lines", **look: Any) -> Figure:
    """Return a curve, or points."""
    return {
        "type": "scatter", "mode": mode, "name": name, "x": list(x), "y": list(y), **look,
        "hovertemplate": f"{name} %{{y:.4~g}} {unit}<extra></extra>",
    }  # fmt: skip


def bars(name: str, x: Sequence[Any], y: Sequence[Any], unit: str, colour: str) -> Figure:
    """Return upright bars of one colour."""
    return {
        "type": "bar", "name": name, "x": list(x), "y": list(y), "marker": {"color": colour},
        "hovertemplate": f"%{{x}}<br>{name}: %{{y:.4~g}} {unit}<extra></extra>",
    }  # fmt: skip


def band(x: Sequence[Any], low: Sequence[Any], high: Sequence[Any], colour: str, **more: Any) -> list[Figure]:
    """Return the traces of the area between two curves."""
    edge = {
        "type": "scatter", "mode": "lines", "x": list(x), "line": {"width": 0}, "hoverinfo": "skip",
        "showlegend": False,
    }  # fmt: skip
    return [{**edge, "y": list(low)}, {**edge, "y": list(high), "fill": "tonexty", "fillcolor": colour, **more}]


def level(value: float, colour: str = LIMIT) -> Figure:
    """Return a dashed line across a figure."""
    line = {"color": colour, "width": 1.5, "dash": "dash"}
    return {"type": "line", "xref": "paper", "x0": 0, "x1": 1, "y0": value, "y1": value, "line": line}


def beside(value: float, text: str, colour: str = LIMIT, side: str = "left") -> Figure:
    """Return what is written at the end of a `level`."""
    return {
        "x": 0.005 if side == "left" else 0.995, "xref": "paper", "xanchor": side, "y": value, "yanchor": "bottom",
        "showarrow": False, "text": text, "font": {"color": colour},
    }  # fmt: skip


def axis(quantity: str, unit: str) -> dict[str, Any]:
    """Return an axis that begins at nothing."""
    return {"title": {"text": f"{quantity}, {unit}"}, "rangemode": "tozero"}
