"""What a workspace knows, written for ROS."""

from __future__ import annotations

from pathlib import Path

from irtwin.asking import open_graph
from irtwin.knowledge.questions.queries import robot_named
from irtwin.location import Location
from irtwin.providers.mesh_files import mesh_copies_of_graph
from irtwin.providers.names import find_robot
from irtwin.providers.records import known_twin
from irtwin.providers.robot_of_graph import robot_of_graph
from irtwin.robot.description import Robot
from irtwin.ros.ros_package import write_package
from irtwin.storage.database import Workspace
from irtwin.twin.described import described


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


def _as_identified(robot: Robot, location: Location) -> Robot:
    """Return a robot as its twin has it, where the workspace has one."""
    if not Workspace.is_there(location):
        return robot
    with Workspace.existing(location) as place:
        twin = known_twin(place, find_robot(place, robot.name))
    return robot if twin is None else described(twin[1], robot)
