"""A robot in three dimensions as a fragment of a page: it performs runs, or stands beside its simulator."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

import jinja2
import numpy as np
from markupsafe import Markup

from irtwin.packing import Fragment, embedded_json, packed_scripts
from irtwin.robot.description import Robot
from irtwin.robot.meshes import Mesh
from irtwin.virtual.performance import Performance, packed_runs
from irtwin.virtual.robot_data import asset, robot_data, viewer_script
from irtwin.virtual.skeleton import meshes_missing


def scene_html(
    robot: Robot, runs: Sequence[Performance], *, opens: int = 0, meshes: Mapping[str, Mesh] | None = None
) -> Fragment:
    """Return an HTML fragment, with its style and scripts, in which the robot performs runs; it loads nothing.

    It opens on the run at `opens`. While it plays it dispatches `irtwin:time` on document ({detail: {time, source}}),
    and `irtwin:run` ({detail: {run, source}}) where another run is chosen; it follows the same from others. `meshes`
    are those that the robot's description names; other shapes stand in for the rest, and the fragment says so.
    Raises ValueError where a run's arrays do not fit together or hold values that are not finite.
    """
    for run in runs:
        run.check(len(robot.joints))
    data = robot_data(robot, np.concatenate([run.q for run in runs]), meshes)
    return _fragment(
        "scene",
        ("robot.js", "curves.js", "scene.js"),
        {**data, "runs": packed_runs(runs, opens), "opens": opens},
        robot=robot.name,
        runs=[run.name for run in runs],
        opens=opens,
        torque=any(run.torque is not None for run in runs),
        missing=meshes_missing(robot, meshes or {}),
    )


def apart_html(
    robot: Robot, q: np.ndarray, simulators: Mapping[str, np.ndarray], meshes: Mapping[str, Mesh] | None = None
) -> Fragment:
    """Return an HTML fragment in which the robot and its simulator stand at one moment, two that differ in pose alone.

    There is a picture for each of the simulator's poses, by caption. q, each pose: (n,) rad or m. `meshes` as above.
    """
    data = robot_data(robot, np.array([q, *simulators.values()]), meshes)
    robots = {"robot": q.tolist(), "simulators": [pose.tolist() for pose in simulators.values()]}
    return _fragment("apart", ("robot.js", "apart.js"), data | robots, robot=robot.name, captions=list(simulators))


def _fragment(name: str, scripts: Sequence[str], data: Mapping[str, Any], **values: Any) -> Fragment:
    """Return what the template of this name makes of values, with its style, MeshCat and scripts of this room."""
    packed = packed_scripts([viewer_script(), *map(asset, scripts)])
    html = _template(f"{name}.html.jinja").render(
        values, data=embedded_json(data), style=asset(f"{name}.css"), scripts=packed.html
    )
    return Fragment(Markup(html), packed.scripts)


@cache
def _template(name: str) -> jinja2.Template:
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    return environment.from_string(asset(name))
