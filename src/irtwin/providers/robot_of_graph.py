"""The robot as the graph describes it: its links, joints, limits and shapes, by SPARQL and nothing else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from irtwin.errors import InputError
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.table import Row
from irtwin.providers.structure_rows import SIZES
from irtwin.robot.description import Joint, Robot
from irtwin.robot.structure import Body, Connection, Origin, Solid, Structure, Three
from irtwin.robot.urdf_text import robot_of

_ROBOT = """SELECT ?name ?manufacturer ?type ?weight {
  ?arm irt:has_Information ?information . ?information irt:IR_Name ?name .
  OPTIONAL { ?information irt:Manufacturer ?manufacturer }
  OPTIONAL { ?information irt:IR_Type ?type }
  OPTIONAL { ?information irt:IR_Weight ?weight }
}"""
_LINKS = """SELECT * {
  ?link irt:link_of ?arm ; irt:Link_Name ?name ; irt:Link_Number ?number .
  OPTIONAL { ?link irt:Link_Mass ?mass }
  OPTIONAL { ?link irt:Mass_Centre_X ?com_x ; irt:Mass_Centre_Y ?com_y ; irt:Mass_Centre_Z ?com_z }
  OPTIONAL { ?link irt:Inertia_XX ?xx ; irt:Inertia_YY ?yy ; irt:Inertia_ZZ ?zz ;
    irt:Inertia_XY ?xy ; irt:Inertia_XZ ?xz ; irt:Inertia_YZ ?yz }
} ORDER BY ?number"""
_PLACE = """irt:Origin_X ?x ; irt:Origin_Y ?y ; irt:Origin_Z ?z ;
    irt:Origin_Roll ?roll ; irt:Origin_Pitch ?pitch ; irt:Origin_Yaw ?yaw ."""
_JOINTS = f"""SELECT * {{
  ?below irt:link_of ?arm ; irt:Link_Name ?child ; irt:Link_Number ?number .
  ?joint irt:child_Link ?below ; irt:parent_Link / irt:Link_Name ?parent ; irt:Joint_Name ?name ; irt:Joint_Kind ?kind ;
    {_PLACE}
  OPTIONAL {{ ?joint irt:Axis_X ?axis_x ; irt:Axis_Y ?axis_y ; irt:Axis_Z ?axis_z }}
  OPTIONAL {{ ?joint irt:Lower_Limit ?lower ; irt:Upper_Limit ?upper }}
  OPTIONAL {{ ?joint irt:Speed_Limit ?velocity }}
  OPTIONAL {{ ?joint irt:Torque_Limit ?effort }}
  OPTIONAL {{ ?joint irt:Acceleration_Limit ?acceleration }}
}} ORDER BY ?number"""
_SHAPES = f"""SELECT * {{
  ?on irt:link_of ?arm ; irt:Link_Name ?link ; irt:Link_Number ?link_number .
  ?shape irt:shape_of ?on ; irt:Shape_Purpose ?purpose ; irt:Shape_Kind ?kind ; irt:Shape_Number ?number ;
    {_PLACE}
  OPTIONAL {{ ?shape irt:Size_X ?size_x ; irt:Size_Y ?size_y ; irt:Size_Z ?size_z }}
  OPTIONAL {{ ?shape irt:Shape_Radius ?radius }}
  OPTIONAL {{ ?shape irt:Shape_Length ?length }}
  OPTIONAL {{ ?shape irt:Mesh ?mesh ;
    irt:Mesh_Scale_X ?scale_x ; irt:Mesh_Scale_Y ?scale_y ; irt:Mesh_Scale_Z ?scale_z }}
  OPTIONAL {{ ?shape irt:Colour ?colour }}
}} ORDER BY ?link_number DESC(?purpose) ?number"""


def robot_of_graph(graph: KnowledgeGraph, robot_iri: str) -> Robot:
    """Return a robot made of what the graph says of it. Raises InputError where the graph does not know its links."""
    asked = {"arm": robot_iri}
    links, of_robot = graph.query(_LINKS, asked).rows, graph.query(_ROBOT, asked).rows
    if not links or not of_robot:
        raise InputError(f"<{robot_iri}>: the graph does not know its links; run its data set again")
    joints = graph.query(_JOINTS, asked).rows
    structure = Structure(
        tuple(map(_body, links)),
        tuple(map(_connection, joints)),
        tuple(map(_solid, graph.query(_SHAPES, asked).rows)),
    )
    name = of_robot[0]["name"]
    moving = [_joint(row) for row in joints if row["axis_x"] is not None]
    return replace(
        robot_of(name, structure, moving, f"{name} in the graph"),
        name=name,
        manufacturer=of_robot[0]["manufacturer"],
        type=of_robot[0]["type"],
        weight=of_robot[0]["weight"],
    )


def _body(row: Row) -> Body:
    moments = tuple(row[name] for name in ("xx", "yy", "zz", "xy", "xz", "yz"))
    return Body(row["name"], row["mass"], _three(row, "com_x", "com_y", "com_z"), None if None in moments else moments)


def _connection(row: Row) -> Connection:
    axis = _three(row, "axis_x", "axis_y", "axis_z")
    return Connection(row["name"], row["kind"], row["parent"], row["child"], _origin(row), axis)


def _joint(row: Row) -> Joint:
    def value(key: str, otherwise: float) -> float:
        return otherwise if row[key] is None else float(row[key])

    lower, upper = value("lower", -np.inf), value("upper", np.inf)
    most = value("velocity", np.inf), value("effort", np.inf), row["acceleration"]
    return Joint(row["name"], row["kind"], lower, upper, *most)


def _solid(row: Row) -> Solid:
    size = tuple(row[name.removesuffix("_m")] for name in SIZES[row["kind"]])
    colour = None if row["colour"] is None else tuple(map(float, row["colour"].split()))
    return Solid(row["link"], row["purpose"], row["kind"], size, _origin(row), colour, row["mesh"])


def _origin(row: Row) -> Origin:
    return Origin((row["x"], row["y"], row["z"]), (row["roll"], row["pitch"], row["yaw"]))


def _three(row: Row, *names: str) -> Three | None:
    x, y, z = (row[name] for name in names)
    return None if x is None else (x, y, z)
