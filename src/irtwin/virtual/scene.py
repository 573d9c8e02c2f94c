"""The robot in three dimensions: a page fragment in which it performs runs, with the energy it uses beside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache

import jinja2
import numpy as np
from markupsafe import Markup

from irtwin.packing import Fragment, embedded_json, packed_scripts
from irtwin.robot.description import Robot
from irtwin.robot.meshes import Mesh
from irtwin.virtual.performance import Performance, packed_runs
from irtwin.virtual.robot_data import asset, robot_data, viewer_script
from irtwin.virtual.skeleton import meshes_missing

_SCRIPTS = ("robot.js", "curves.js", "scene.js")


def scene_html(
    robot: Robot,
    runs: Sequence[Performance],
    *,
    opens: int = 0,
    title: str = "",
    meshes: Mapping[str, Mesh] | None = None,
) -> Fragment:
    """Return an HTML fragment, with its style and scripts, in which the robot performs runs; it loads nothing.

    It opens on the run at `opens`. While it plays it dispatches `irtwin:time` on document ({detail: {time, source}}),
    and `irtwin:run` ({detail: {run, source}}) where another run is chosen; it follows the same from others. `meshes`
    are those that the robot's description names; other shapes stand in for the rest, and the fragment says so.
    Raises ValueError where a run's arrays do not fit together or hold values that are not finite.
    """
    for run in runs:
        run.check(len(robot.joints))
    meshes = meshes or {}
    data = robot_data(robot, np.concatenate([run.q for run in runs]), meshes) | {
        "runs": packed_runs(runs, opens),
        "opens": opens,
    }
    scripts = packed_scripts([viewer_script(), *(asset(name) for name in _SCRIPTS)])
    html = template("scene.html.jinja").render(
        title=title,
        robot=robot.name,
        runs=[run.name for run in runs],
        opens=opens,
        torque=any(run.torque is not None for run in runs),
        missing=meshes_missing(robot, meshes),
        data=embedded_json(data),
        style=asset("scene.css"),
        scripts=scripts.html,
    )
    return Fragment(Markup(html), scripts.scripts)


@cache
def template(name: str) -> jinja2.Template:
    """Return a template of this room."""
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    return environment.from_string(asset(name))
