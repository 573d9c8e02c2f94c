"""What a workspace knows, written for ROS."""

from __future__ import annotations

from pathlib import Path

from irtwin.asking import open_graph
from irtwin.knowledge.questions.queries import robot_named
from irtwin.providers.robot_of_graph import robot_of_graph
from irtwin.ros.ros_package import write_package


def export_package(out: Path, workspace: Path, robot: str | None, graph_url: str | None = None) -> list[str]:
    """Write the ROS package of a robot of the graph into a folder; return what one should know of it.

    robot: its name; the only one's where None. Raises InputError where there is no such robot, or no place to write.
    """
    with open_graph(workspace, graph_url) as graph:
        described = robot_of_graph(graph, robot_named(graph, robot))
    return write_package(described, out)
