"""The tables of what a robot is built of, and of the devices that measured its runs: a part of its data set."""

from __future__ import annotations

from sqlalchemy import ForeignKey
from sqlalchemy.orm import Mapped, mapped_column

from irtwin.storage.schema import Base


class LinkRow(Base):
    """A rigid body; mass, centre of mass and inertia (about it) in the link's own axes, none where nobody said."""

    robot_id: Mapped[str] = mapped_column(ForeignKey("robot.robot_id"), primary_key=True)
    name: Mapped[str] = mapped_column(primary_key=True)
    number: Mapped[int]  # 0 for the base; a link comes after the one that carries it
    mass_kg: Mapped[float | None]
    com_x_m: Mapped[float | None]
    com_y_m: Mapped[float | None]
    com_z_m: Mapped[float | None]
    inertia_xx_kg_m2: Mapped[float | None]
    inertia_yy_kg_m2: Mapped[float | None]
    inertia_zz_kg_m2: Mapped[float | None]
    inertia_xy_kg_m2: Mapped[float | None]
    inertia_xz_kg_m2: Mapped[float | None]
    inertia_yz_kg_m2: Mapped[float | None]


class _Placed(Base):
    """What lies in a frame: its own, as the frame sees it."""

    __abstract__ = True

    origin_x_m: Mapped[float]
    origin_y_m: Mapped[float]
    origin_z_m: Mapped[float]
    origin_roll_rad: Mapped[float]
    origin_pitch_rad: Mapped[float]
    origin_yaw_rad: Mapped[float]


class LinkJoint(_Placed):
    """How a joint, moving or fixed, holds one link to another: its frame at zero in the parent's, and its axis."""

    robot_id: Mapped[str] = mapped_column(ForeignKey("robot.robot_id"), primary_key=True)
    name: Mapped[str] = mapped_column(primary_key=True)
    kind: Mapped[str]  # "fixed" for one that mimics another, too
    parent_link: Mapped[str]
    child_link: Mapped[str]
    axis_x: Mapped[float | None]  # of length one, in the joint's own frame; none of a fixed joint
    axis_y: Mapped[float | None]
    axis_z: Mapped[float | None]


class LinkShape(_Placed):
    """A shape of a link: sizes by its kind."""

    robot_id: Mapped[str] = mapped_column(ForeignKey("robot.robot_id"), primary_key=True)
    link: Mapped[str] = mapped_column(primary_key=True)
    purpose: Mapped[str] = mapped_column(primary_key=True)  # "visual" or "collision"
    number: Mapped[int] = mapped_column(primary_key=True)  # from 1, of the link's shapes for one purpose
    kind: Mapped[str]  # "box", "cylinder", "sphere" or "mesh"
    size_x_m: Mapped[float | None]
    size_y_m: Mapped[float | None]
    size_z_m: Mapped[float | None]
    radius_m: Mapped[float | None]
    length_m: Mapped[float | None]
    mesh: Mapped[str | None]  # its path, as the robot description writes it
    mesh_file: Mapped[str | None]  # its copy in the workspace; none where the data set lacks it
    mesh_sha256: Mapped[str | None]
    scale_x: Mapped[float | None]
    scale_y: Mapped[float | None]
    scale_z: Mapped[float | None]
    colour: Mapped[str | None]  # red, green, blue and opacity, 0 to 1


class DHTable(Base):
    """A Denavit-Hartenberg table from base to flange, with the frames before and after its rows."""

    robot_id: Mapped[str] = mapped_column(ForeignKey("robot.robot_id"), primary_key=True)
    convention: Mapped[str] = mapped_column(primary_key=True)  # "standard" or "modified"
    end_link: Mapped[str]
    deviation_m: Mapped[float]  # from the robot description, the most over poses drawn within the limits
    deviation_rad: Mapped[float]
    base_x_m: Mapped[float]
    base_y_m: Mapped[float]
    base_z_m: Mapped[float]
    base_roll_rad: Mapped[float]
    base_pitch_rad: Mapped[float]
    base_yaw_rad: Mapped[float]
    tool_x_m: Mapped[float]
    tool_y_m: Mapped[float]
    tool_z_m: Mapped[float]
    tool_roll_rad: Mapped[float]
    tool_pitch_rad: Mapped[float]
    tool_yaw_rad: Mapped[float]


class DHRow(Base):
    """A row of a Denavit-Hartenberg table, with its joint at zero."""

    __tablename__ = "dh_row"

    robot_id: Mapped[str] = mapped_column(ForeignKey("robot.robot_id"), primary_key=True)
    convention: Mapped[str] = mapped_column(primary_key=True)
    number: Mapped[int] = mapped_column(primary_key=True)  # from 1, base to flange
    joint: Mapped[str]
    a_m: Mapped[float]
    alpha_rad: Mapped[float]
    d_m: Mapped[float]
    theta_rad: Mapped[float]


class Device(Base):
    """What measures a robot: its controller, a meter, or a sensor of one joint."""

    robot_id: Mapped[str] = mapped_column(ForeignKey("robot.robot_id"), primary_key=True)
    device_id: Mapped[str] = mapped_column(primary_key=True)  # its kind, and its joint where it has one
    kind: Mapped[str]
    joint: Mapped[str | None]


class DeviceChannel(Base):
    """A column of the robot's logs, and the device that it comes from."""

    robot_id: Mapped[str] = mapped_column(ForeignKey("robot.robot_id"), primary_key=True)
    column_name: Mapped[str] = mapped_column(primary_key=True)
    device_id: Mapped[str]
    joint: Mapped[str | None]
    label: Mapped[str]
    unit: Mapped[str]  # symbol
    rate_hz: Mapped[float]  # the highest, over the runs that have the column
