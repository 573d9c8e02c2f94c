"""Figures of the case study as Plotly data and layout, made from series of samples."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import cycle

import numpy as np

from irtwin.report.colours import HELD_OUT, MEASURED, MODELLED, PALETTE, RESIDUAL
from irtwin.report.explorer import Columns
from irtwin.report.questions import Row
from irtwin.report.traces import Figure, axis, plain, trace
from irtwin.signals.channels import CHANNELS

_TIME = {"type": "linear", "title": {"text": "time, s"}, "zeroline": False}


_VALIDATED = slice(1, 4)  # joints 2 to 4


def figures(series: Mapping[str, Columns], joints: Sequence[Row]) -> dict[str, Figure]:
    """Return the figures by name, of the series "plan", "run" and "validation": motions, power and energy over them."""
    plan, run, validation = (series[name] for name in ("plan", "run", "validation"))
    return {
        "validation_motion": _motion(validation, joints[_VALIDATED]),
        "validation_power": _compared(validation, "power", "power", "W"),
        "planned_motion": _motion(plan, joints),
        "measured_motion": _motion(run, joints),
        "power": _compared(run, "power", "power", "W", plan),
        "energy": _compared(run, "energy", "energy used so far", "J", plan),
    }


def _motion(series: Columns, joints: Sequence[Row]) -> Figure:
    """Draw joint positions over time, rotations in degrees."""
    data = []
    for colour, row in zip(cycle(PALETTE), joints, strict=False):
        slides = row["kind"] == "prismatic"
        values = series[CHANNELS["q"].column(row["joint"])]
        drawn = values if slides else np.degrees(values)
        data.append(_line(plain(row["joint"]), series, drawn, "m" if slides else "°", colour))
    return {"data": data, "layout": {"xaxis": _TIME, "yaxis": {"title": {"text": "joint position, °"}}}}


def _compared(run: Columns, name: str, title: str, unit: str, plan: Columns | None = None) -> Figure:
    """Draw what was measured, what the twin makes of the measured motion, and what it made of the plan, if any."""
    data = [
        _line("measured", run, run[name], unit, MEASURED),
        _line("modelled, along the measured motion", run, run[f"{name}_model"], unit, MODELLED),
        _line("measured less modelled", run, run[name] - run[f"{name}_model"], unit, RESIDUAL),
    ]
    if plan is not None:
        data.append(_line("planned, before it moved", plan, plan[f"{name}_model"], unit, HELD_OUT, dash="dot"))
    return {"data": data, "layout": {"xaxis": _TIME, "yaxis": axis(title, unit)}}


def _line(name: str, series: Columns, values: np.ndarray, unit: str, colour: str, dash: str = "solid") -> Figure:
    time = series["time"] - series["time"][0]
    known = np.isfinite(values)
    x = [round(float(at), 4) for at in time[known]]
    y = [float(f"{value:.5g}") for value in values[known]]
    return trace(name, x, y, unit, line={"color": colour, "width": 2, "dash": dash})
