"""A robot as a ROS package: URDF, SRDF, limits, kinematics, RViz and launch files, for ROS 1 and ROS 2."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib import metadata
from importlib.resources import files
from math import pi, sin
from pathlib import Path

import jinja2
import numpy as np

from irtwin.effects.rigid_body import flange_frame
from irtwin.errors import InputError
from irtwin.identification.motion_limits import FULL_SPEED_AFTER
from irtwin.input_file import read_text
from irtwin.robot.collision import CollisionModel
from irtwin.robot.description import Robot
from irtwin.robot.kinematics import flange, link_placements, ranges
from irtwin.robot.ros_names import ros_names, ros_package
from irtwin.ros.collision_pairs import free_pairs, home
from irtwin.ros.description import described
from irtwin.storage.files import write

_MOST_BYTES = 100_000  # of a manifest
_VIEWED = 200  # random poses that the camera is fitted to
_FIELD = pi / 4  # rad: RViz' field of view, upright


def write_package(robot: Robot, folder: Path, meshes: Mapping[str, bytes] | None = None) -> list[str]:
    """Write a robot's ROS package into a new or empty folder; return a line for each thing that one should know.

    meshes: contents of those that are at hand, by the names that the robot's description gives them; they go along.
    Raises InputError where the folder has anything in it but an earlier package of the robot, or cannot be written.
    """
    name = ros_package(robot.name)
    contents = meshes or {}
    places = _places(contents)
    made = described(robot, {mesh: f"package://{name}/{place}" for mesh, place in places.items()})
    _check_folder(folder, name)
    model = CollisionModel(made.robot)
    chain = _chain(made.robot)
    values = {
        "package": name,
        "robot": made.robot.name,
        "title": robot.name,
        "version": metadata.version("irtwin"),
        "joints": made.robot.joints,
        "full_speed_after": FULL_SPEED_AFTER,
        "chain": chain,
        "base": made.structure.bodies[0].name,
        "flange": flange(made.robot),
        "home": dict(zip(made.robot.joint_names, home(made.robot, model).tolist(), strict=True)),
        "pairs": list(free_pairs(made.robot, model, made.structure.solids)),
        "view": _view(made.robot),
        "folders": " ".join(["config", "launch", *(["meshes"] if places else []), "rviz", "urdf"]),
    }
    for mesh, place in places.items():
        write(folder / place, contents[mesh])
    write(folder / "urdf" / f"{made.robot.name}.urdf", made.robot.urdf.encode())
    for place, template in _files(made.robot.name).items():
        write(folder / place, _templates().get_template(template).render(values).encode())
    return [*made.said, *_unchecked(model)]


def _places(meshes: Mapping[str, bytes]) -> dict[str, str]:
    """Return where in the package each mesh lies: no two under one name, whatever the case of letters."""
    names = ros_names((Path(name).stem for name in meshes), "mesh")
    taken: dict[str, str] = {}
    for number, name in enumerate(meshes):
        file = f"{names[Path(name).stem]}{Path(name).suffix.lower()}"
        again = file.lower() in (place.lower() for place in taken.values())
        taken[name] = f"{number}_{file}" if again else file
    return {name: f"meshes/{file}" for name, file in taken.items()}


def _files(robot: str) -> dict[str, str]:
    """Return the template of each file, by the file's place in the package."""
    same = (
        "package.xml", "CMakeLists.txt", ".setup_assistant", "launch/display.launch", "launch/display.launch.py",
        "launch/planning_context.launch", "config/joint_limits.yaml", "config/kinematics.yaml",
    )  # fmt: skip
    named = {
        f"config/{robot}.srdf": "robot.srdf.jinja",
        f"rviz/{robot}.rviz": "ros1.rviz.jinja",
        f"rviz/{robot}_ros2.rviz": "ros2.rviz.jinja",
    }
    return {place: f"{Path(place).name.lstrip('.')}.jinja" for place in same} | named


def _check_folder(folder: Path, name: str) -> None:
    if not folder.exists() or (folder.is_dir() and not any(folder.iterdir())):
        return
    manifest = folder / "package.xml"
    if not (manifest.is_file() and f"<name>{name}</name>" in read_text(manifest, _MOST_BYTES)):
        raise InputError(f"{folder}: is there already, and is no ROS package {name}; name a new folder")


def _chain(robot: Robot) -> list[str]:
    """Return the moving joints from the base to the flange."""
    carriers = robot.model.supports[flange_frame(robot).parentJoint]
    return [robot.model.names[joint] for joint in carriers if joint]


def _unchecked(model: CollisionModel) -> list[str]:
    bare = model.unchecked
    if bare and not model.shaped:
        return ["no link has collision shapes of boxes, cylinders or spheres: MoveIt checks nothing against the robot"]
    return [f"no collision shape of boxes, cylinders or spheres: {', '.join(bare)}"] if bare else []


def _view(robot: Robot) -> dict[str, float]:
    """Return where RViz looks at, m, and how far from, so that the robot is in sight wherever it moves."""
    lower, upper = ranges(robot)
    drawn = np.random.default_rng(0).uniform(lower, upper, (_VIEWED, len(lower)))
    points = np.array([place[:3, 3] for q in drawn for place in link_placements(robot, q).values()])
    centre = (points.min(axis=0) + points.max(axis=0)) / 2
    radius = max(0.1, float(np.linalg.norm(points - centre, axis=1).max()))
    x, y, z = np.round(centre, 3).tolist()
    return {"x": x, "y": y, "z": z, "distance": round(radius / sin(_FIELD / 2), 3)}


@cache
def _templates() -> jinja2.Environment:
    def autoescape(name: str | None) -> bool:
        return name is not None and name.removesuffix(".jinja").endswith((".xml", ".launch", ".srdf"))

    texts = {file.name: file.read_text(encoding="utf-8") for file in files("irtwin.ros").joinpath("package").iterdir()}
    environment = jinja2.Environment(
        loader=jinja2.DictLoader(texts),
        autoescape=autoescape,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters["decimal"] = _decimal
    return environment


def _decimal(value: float) -> str:
    """Return a number without exponent: "1e-05" is text to YAML 1.1, which ROS reads."""
    return repr(value) if "e" not in repr(value) else f"{value:.12f}"
