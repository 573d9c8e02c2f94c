"""The robot in three dimensions: a page fragment in which it performs a run, with the energy it uses beside it."""

from __future__ import annotations

import base64
import json
from functools import cache
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
import pinocchio as pin
from markupsafe import Markup

from irtwin.robot.description import Robot
from irtwin.robot.kinematics import flange, link_placements
from irtwin.virtual.skeleton import Part, drawn_parts, joint_axes

_FRAME_RATE = 25.0  # Hz
_MOST_FRAMES = 12_000  # eight minutes; longer runs are shown at a lower rate
_VIEWED = 60  # poses that the camera is fitted to


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
    data = _robot(robot, q) | _run(time, q, energy, power)
    return _template().render(
        title=title,
        robot=robot.name,
        data=_json(data),
        style=_asset("scene.css"),
        player=_asset("scene.js"),
        viewer=_viewer(),
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


def _robot(robot: Robot, q: np.ndarray) -> dict[str, Any]:
    """Return joints, visible parts, flange and the ball that the motion fills."""
    model = robot.model
    tip = model.frames[model.getFrameId(flange(robot), pin.FrameType.BODY)]
    return {
        "joints": [
            {
                "name": joint.name,
                "unit": joint.unit,
                "parent": int(model.parents[column + 1]) - 1,  # Pinocchio's joint 0 is the base
                "placement": _column_major(model.jointPlacements[column + 1].homogeneous),
                "axis": np.round(axis, 9).tolist(),
                "lower": float(max(joint.lower, q[:, column].min() - 0.1) if joint.lower < -20 else joint.lower),
                "upper": float(min(joint.upper, q[:, column].max() + 0.1) if joint.upper > 20 else joint.upper),
            }
            for column, (joint, axis) in enumerate(zip(robot.joints, joint_axes(robot), strict=True))
        ],
        "parts": [_part(part) for part in drawn_parts(robot)],
        "flange": {"joint": tip.parentJoint - 1, "placement": _column_major(tip.placement.homogeneous)},
        "view": _view(robot, q),
    }


def _view(robot: Robot, q: np.ndarray) -> dict[str, Any]:
    """Return centre (m) and radius of what the run fills, and the height of the floor under it."""
    shown = q[np.unique(np.linspace(0, len(q) - 1, _VIEWED).astype(int))]
    points = np.array([place[:3, 3] for sample in shown for place in link_placements(robot, sample).values()])
    centre = (points.min(axis=0) + points.max(axis=0)) / 2
    return {
        "centre": np.round(centre, 4).tolist(),
        "radius": round(max(0.05, float(np.linalg.norm(points - centre, axis=1).max())), 4),
        "floor": round(float(min(0.0, points[:, 2].min())), 4),
    }


def _part(part: Part) -> dict[str, Any]:
    return {
        "joint": part.joint,
        "kind": part.kind,
        "size": [round(length, 5) for length in part.size],
        "placement": _column_major(part.placement),
        "colour": list(part.colour),
    }


def _column_major(placement: np.ndarray) -> list[float]:
    return [float(value) for value in np.round(placement.T.ravel(), 7)]


def _packed(values: np.ndarray) -> str:
    return base64.b64encode(np.ascontiguousarray(values, dtype="<f4").tobytes()).decode("ascii")


def _json(data: dict[str, Any]) -> Markup:
    """Return JSON that no name in it can break out of: without `<`, `>` and `&`."""
    text = json.dumps(data, allow_nan=False, separators=(",", ":"))
    return Markup(text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026"))


def _asset(name: str) -> Markup:
    return Markup(files("irtwin.virtual").joinpath(name).read_text(encoding="utf-8"))


@cache
def _viewer() -> Markup:
    """Return MeshCat's bundle, which holds three.js. The Python package is not imported: that would start ZeroMQ."""
    package = find_spec("meshcat")
    if package is None or package.origin is None:
        raise ModuleNotFoundError("meshcat is not installed")
    bundle = Path(package.origin).parent / "viewer" / "dist" / "main.min.js"
    return Markup(bundle.read_text(encoding="utf-8"))


@cache
def _template() -> jinja2.Template:
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    return environment.from_string(_asset("scene.html.jinja"))
