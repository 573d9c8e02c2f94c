"""What a robot is built of, and the devices that measured it, as rows."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import numpy as np

from irtwin.errors import InputError
from irtwin.providers.mesh_files import MeshCopy
from irtwin.robot.chain_table import deviation, table_of
from irtwin.robot.denavit_hartenberg import CONVENTIONS
from irtwin.robot.description import Robot
from irtwin.robot.kinematics import flange
from irtwin.robot.structure import Body, Connection, Origin, Solid, structure_of
from irtwin.signals.channels import CHANNELS
from irtwin.signals.log import DataSet
from irtwin.storage.schema import Base
from irtwin.storage.structure_schema import Device, DeviceChannel, DHRow, DHTable, LinkJoint, LinkRow, LinkShape

_MOMENTS = ("xx", "yy", "zz", "xy", "xz", "yz")
SIZES = {  # of shapes, by kind: the columns that hold them
    "box": ("size_x_m", "size_y_m", "size_z_m"),
    "cylinder": ("radius_m", "length_m"),
    "sphere": ("radius_m",),
    "mesh": ("scale_x", "scale_y", "scale_z"),
}


def structure_rows(robot_id: str, robot: Robot, meshes: Mapping[str, MeshCopy] | None = None) -> Iterator[Base]:
    """Yield the rows of a robot's links, joints, shapes and Denavit-Hartenberg tables; `meshes` by their names.

    Raises InputError.
    """
    if not robot.joints:  # of a meter's log nothing is known of it
        return
    structure = structure_of(robot)
    for number, body in enumerate(structure.bodies):
        yield _link(robot_id, number, body)
    for connection in structure.connections:
        yield _joint(robot_id, connection)
    counted: dict[tuple[str, str], int] = {}
    for solid in structure.solids:
        key = (solid.link, solid.purpose)
        counted[key] = counted.get(key, 0) + 1
        yield _shape(robot_id, counted[key], solid, (meshes or {}).get(solid.file or ""))
    for convention in CONVENTIONS:
        yield from _dh_table(robot_id, robot, convention)


def device_rows(robot_id: str, data_set: DataSet) -> Iterator[Base]:
    """Yield the rows of the devices that a data set's logs name by their columns, and of their channels."""
    devices: dict[str, Device] = {}
    channels: dict[str, DeviceChannel] = {}
    kinds = {joint.name: joint.kind for joint in data_set.robot.joints}
    for run in data_set.runs:
        time = run.signals.time
        rate = float((len(time) - 1) / (time[-1] - time[0]))
        for field in run.signals.logged():
            channel = CHANNELS[field]
            for joint in kinds if channel.per_joint else (None,):
                device_id = channel.device if joint is None else f"{channel.device}.{joint}"
                devices.setdefault(
                    device_id, Device(robot_id=robot_id, device_id=device_id, kind=channel.device, joint=joint)
                )
                column = channel.column(joint or "")
                known = channels.get(column)
                channels[column] = DeviceChannel(
                    robot_id=robot_id,
                    column_name=column,
                    device_id=device_id,
                    joint=joint,
                    label=channel.label,
                    unit=channel.unit if joint is None else channel.unit_of(kinds[joint]),
                    rate_hz=rate if known is None else max(rate, known.rate_hz),
                )
    yield from devices.values()
    yield from channels.values()


def _link(robot_id: str, number: int, body: Body) -> LinkRow:
    inertia = body.inertia if body.inertia is not None and all(map(math.isfinite, body.inertia)) else (None,) * 6
    x, y, z = body.com or (None, None, None)
    moments = {f"inertia_{name}_kg_m2": value for name, value in zip(_MOMENTS, inertia, strict=True)}
    return LinkRow(
        robot_id=robot_id,
        name=body.name,
        number=number,
        mass_kg=body.mass,
        com_x_m=x,
        com_y_m=y,
        com_z_m=z,
        **moments,
    )


def _joint(robot_id: str, connection: Connection) -> LinkJoint:
    x, y, z = connection.axis or (None, None, None)
    return LinkJoint(
        robot_id=robot_id,
        name=connection.name,
        kind=connection.kind,
        parent_link=connection.parent,
        child_link=connection.child,
        **_place("origin", connection.origin),
        axis_x=x,
        axis_y=y,
        axis_z=z,
    )


def _shape(robot_id: str, number: int, solid: Solid, mesh: MeshCopy | None) -> LinkShape:
    return LinkShape(
        robot_id=robot_id,
        link=solid.link,
        purpose=solid.purpose,
        number=number,
        kind=solid.kind,
        mesh=solid.file,
        mesh_file=None if mesh is None else mesh.path,
        mesh_sha256=None if mesh is None else mesh.sha256,
        colour=None if solid.colour is None else " ".join(map(repr, solid.colour)),
        **dict(zip(SIZES[solid.kind], solid.size, strict=True)),
        **_place("origin", solid.origin),
    )


def _dh_table(robot_id: str, robot: Robot, convention: str) -> Iterator[Base]:
    """Yield a table with its rows; nothing where no joint moves the flange, or the numbers are beyond all reason."""
    with np.errstate(all="ignore"):
        try:
            table = table_of(robot, convention)
        except InputError:
            return
        far, turned = deviation(robot, table)
    numbers = [far, turned, *table.base.ravel(), *table.tool.ravel()]
    numbers += [value for row in table.rows for value in (row.a, row.alpha, row.d, row.theta)]
    if not np.isfinite(numbers).all():
        return
    yield DHTable(
        robot_id=robot_id,
        convention=convention,
        end_link=flange(robot),
        deviation_m=far,
        deviation_rad=turned,
        **_place("base", Origin.of(table.base)),
        **_place("tool", Origin.of(table.tool)),
    )
    for number, (joint, row) in enumerate(zip(table.joint_names, table.rows, strict=True), start=1):
        yield DHRow(
            robot_id=robot_id,
            convention=convention,
            number=number,
            joint=joint,
            a_m=row.a,
            alpha_rad=row.alpha,
            d_m=row.d,
            theta_rad=row.theta,
        )


def _place(prefix: str, origin: Origin) -> dict[str, float]:
    lengths = {f"{prefix}_{name}_m": value for name, value in zip("xyz", origin.xyz, strict=True)}
    angles = zip(("roll", "pitch", "yaw"), origin.rpy, strict=True)
    return lengths | {f"{prefix}_{name}_rad": value for name, value in angles}
