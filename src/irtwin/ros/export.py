"""What a workspace knows, written for ROS."""

from __future__ import annotations

from datetime import UTC, datetime
from difflib import get_close_matches
from pathlib import Path

from sqlalchemy import select

from irtwin.asking import open_graph
from irtwin.errors import InputError
from irtwin.knowledge.questions.queries import robot_named
from irtwin.location import Location
from irtwin.providers.mesh_files import mesh_copies_of_graph
from irtwin.providers.names import find_robot
from irtwin.providers.records import known_twin, load_robot, load_run
from irtwin.providers.robot_of_graph import robot_of_graph
from irtwin.robot.description import Robot
from irtwin.ros.bags import write_bag
from irtwin.ros.ros_package import write_package
from irtwin.storage import schema
from irtwin.storage.database import Workspace
from irtwin.twin.described import described

_NO_START = datetime(1970, 1, 1, tzinfo=UTC)  # of a plan: its bag begins at 0 s


def export_package(out: Path, location: Location, robot: str | None) -> list[str]:
    """Write the ROS package of a robot of the graph into a folder; return what one should know of it.

    Where the workspace has a twin of the robot, the package has the twin's bodies and friction. robot: its name; the
    only one's where None. Raises InputError where there is no such robot, or no place to write, or a copy of a mesh is
    gone from the workspace.
    """
    with open_graph(location) as graph:
        iri = robot_named(graph, robot)
        described = robot_of_graph(graph, iri)
        copies = mesh_copies_of_graph(graph, iri, location.folder)
    described = _as_identified(described, location)
    return write_package(described, out, {name: copy.content for name, copy in copies.items()})


def export_bag(out: Path, location: Location, run: str, robot: str | None) -> None:
    """Write a stored run, by its name, as a bag: FILE.mcap, FILE.bag of ROS 1, else the folder of a ROS 2 bag.

    robot: the name of the run's robot; needed where runs of several have the name. Raises InputError where there is no
    such run, or no place to write.
    """
    with Workspace.existing(location) as place:
        row = _run(place, run, None if robot is None else find_robot(place, robot))
        owner = load_robot(place, row.robot_id)
        stored = load_run(place, owner, row.run_id)
    write_bag(out, owner, stored.signals, row.start_time or _NO_START)


def _as_identified(robot: Robot, location: Location) -> Robot:
    """Return a robot as its twin has it, where the workspace has one."""
    if not Workspace.is_there(location):
        return robot
    with Workspace.existing(location) as place:
        twin = known_twin(place, find_robot(place, robot.name))
    return robot if twin is None else described(twin[1], robot)


def _run(place: Workspace, name: str, robot_id: str | None) -> schema.Run:
    with place.reading() as session:
        runs = list(session.scalars(select(schema.Run).order_by(schema.Run.run_id)))
    of_robot = [run for run in runs if robot_id in (None, run.robot_id)]
    named = [run for run in of_robot if run.name == name]
    if not named:
        near = get_close_matches(name, {run.name for run in of_robot}, 1, 0.0)
        hint = f'the nearest is "{near[0]}"' if near else "it has none; run a data set first"
        raise InputError(f'{place.folder}: no run "{name}" here; {hint}')
    if len(named) > 1:
        owners = ", ".join(run.robot_id for run in named[:10])
        raise InputError(f'{place.folder}: several robots have a run "{name}": {owners}; say which by --robot')
    return named[0]
