"""The robot in three dimensions: a page fragment in which it performs a run, with the energy it uses beside it."""

from __future__ import annotations

import base64
from functools import cache
from typing import Any

import jinja2
import numpy as np

from irtwin.robot.description import Robot
from irtwin.virtual.robot_data import asset, embedded_json, robot_data, viewer_script

_FRAME_RATE = 25.0  # Hz
_MOST_FRAMES = 12_000  # eight minutes; longer runs are shown at a lower rate


def scene_html(
    robot: Robot,
    time: np.ndarray,
    q: np.ndarray,
    energy: np.ndarray,
    power: np.ndarray | None = None,
    *,
    title: str = "",
) -> str:
    """Return an HTML fragment, with its style and scripts, in which the robot performs a run; it loads nothing.

    time: (N,) s, rising; q: (N, n) rad or m; energy: (N,) J used so far; power: (N,) W, else the slope of `energy`.
    While it plays it dispatches `irtwin:time` on document ({detail: {time, source}}), and follows the same from others.
    Raises ValueError where the arrays do not fit together or hold values that are not finite.
    """
    if power is None:
        power = np.gradient(energy, time)
    _check(robot, time, q, energy, power)
    data = robot_data(robot, q) | _run(time, q, energy, power)
    return _template().render(
        title=title,
        robot=robot.name,
        data=embedded_json(data),
        style=asset("scene.css"),
        robot_script=asset("robot.js"),
        player=asset("scene.js"),
        viewer=viewer_script(),
    )


def _check(robot: Robot, time: np.ndarray, q: np.ndarray, energy: np.ndarray, power: np.ndarray) -> None:
    count = len(time)
    shapes = {"time": (count,), "q": (count, len(robot.joints)), "energy": (count,), "power": (count,)}
    for (name, shape), values in zip(shapes.items(), (time, q, energy, power), strict=True):
        if values.shape != shape:
            raise ValueError(f"{name} has the shape {values.shape}, not {shape}")
        if not np.isfinite(values).all():
            raise ValueError(f"{name} holds values that are not finite")
    if count < 2 or not (np.diff(time) > 0).all():
        raise ValueError("time does not rise over at least two samples")


def _run(time: np.ndarray, q: np.ndarray, energy: np.ndarray, power: np.ndarray) -> dict[str, Any]:
    """Return the signals at even frames; power is the mean over a frame, so that no peak falls between two."""
    length = float(time[-1] - time[0])
    count = int(np.clip(round(length * _FRAME_RATE) + 1, 2, _MOST_FRAMES))
    frames = np.linspace(time[0], time[-1], count)
    step = length / (count - 1)
    edges = np.clip(np.concatenate([frames - step / 2, frames[-1:] + step / 2]), time[0], time[-1])
    work = np.concatenate([[0.0], np.cumsum((power[1:] + power[:-1]) / 2 * np.diff(time))])
    return {
        "start": float(time[0]),
        "step": step,
        "q": _packed(np.column_stack([np.interp(frames, time, column) for column in q.T])),
        "energy": _packed(np.interp(frames, time, energy)),
        "power": _packed(np.diff(np.interp(edges, time, work)) / np.diff(edges)),
    }


def _packed(values: np.ndarray) -> str:
    return base64.b64encode(np.ascontiguousarray(values, dtype="<f4").tobytes()).decode("ascii")


@cache
def _template() -> jinja2.Template:
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    return environment.from_string(asset("scene.html.jinja"))
