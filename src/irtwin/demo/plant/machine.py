"""A machine: a robot as drawn, and the one that was built from the drawings, a little off everywhere."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar, get_type_hints
from xml.etree import ElementTree

import numpy as np

from irtwin.demo.plant.arm import Arm, LinkTolerance, PlantPayload
from irtwin.demo.plant.controller import ControlData
from irtwin.demo.plant.drive import DriveData
from irtwin.demo.plant.friction import FrictionData
from irtwin.demo.plant.motion import PlantLimits
from irtwin.demo.plant.sensors import SensorData
from irtwin.demo.plant.supply import SupplyData
from irtwin.demo.plant.thermal import ThermalData

Data = TypeVar("Data", DriveData, FrictionData)


@dataclass(frozen=True)
class Tolerance(LinkTolerance):
    """Standard deviations of the built robot from its drawings: relative, com in m."""

    rotor_inertia: float
    torque_constant: float
    resistance: float
    friction: float
    friction_per_run: float


@dataclass(frozen=True)
class Drawings:
    """All that the maker knows of a robot."""

    urdf: str
    manufacturer: str
    weight: float
    rated_payload: float
    acceleration: np.ndarray
    step: float
    log_interval: float
    tolerance: Tolerance
    drive: DriveData
    friction: FrictionData
    thermal: ThermalData
    control: ControlData
    supply: SupplyData
    sensors: SensorData

    @cached_property
    def joints(self) -> list[str]:
        """Names of the joints, in the order of every (n,) array."""
        return self.arm(PlantPayload()).joint_names

    @cached_property
    def limits(self) -> PlantLimits:
        """Position limits and speeds of the URDF (MuJoCo keeps no speeds), accelerations of the drawings."""
        lower, upper = self.arm(PlantPayload()).model.jnt_range.T
        return PlantLimits(lower.copy(), upper.copy(), _urdf_speeds(self.urdf, self.joints), self.acceleration)

    def arm(self, payload: PlantPayload) -> Arm:
        """Return the arm as drawn."""
        return Arm(self.urdf, self.drive.joint_inertia, payload, self.step)


@dataclass(frozen=True)
class Machine:
    """One built robot. The seed makes it: the same seed is the same robot."""

    drawings: Drawings
    seed: int
    drive: DriveData
    friction: FrictionData
    torque_offset: np.ndarray  # (n,) N m, of the current sensors
    meter_gain: float

    def arm(self, payload: PlantPayload) -> Arm:
        """Return the arm as built."""
        arm = Arm(self.drawings.urdf, self.drive.joint_inertia, payload, self.drawings.step)
        arm.perturb(self.drawings.tolerance, np.random.default_rng([self.seed, 1]))
        return arm


def build(drawings: Drawings, seed: int) -> Machine:
    """Build a robot to the drawings and their tolerances."""
    rng = np.random.default_rng([seed, 2])
    tolerance, sensors = drawings.tolerance, drawings.sensors
    return Machine(
        drawings,
        seed,
        scatter(
            drawings.drive,
            {name: getattr(tolerance, name) for name in ("rotor_inertia", "torque_constant", "resistance")},
            rng,
        ),
        scatter(drawings.friction, dict.fromkeys(("coulomb", "stiction", "viscous", "load"), tolerance.friction), rng),
        sensors.torque_offset * rng.standard_normal(len(drawings.joints)),
        1 + sensors.meter_gain_error * rng.standard_normal(),
    )


def scatter(data: Data, deviations: dict[str, float], rng: np.random.Generator) -> Data:
    """Return the data with the named arrays off by relative standard deviations, two at most."""
    changed = {}
    for name, deviation in deviations.items():
        value = getattr(data, name)
        changed[name] = value * (1 + deviation * np.clip(rng.standard_normal(value.shape), -2, 2))
    return replace(data, **changed)


def read_drawings(file: Path, urdf: Path) -> Drawings:
    """Read a robot's drawings, a TOML file, and its URDF."""
    table = tomllib.loads(file.read_text(encoding="utf-8"))
    for name, part in get_type_hints(Drawings).items():
        if isinstance(part, type) and is_dataclass(part):
            table[name] = _typed(part, table[name])
    drawings: Drawings = _typed(Drawings, table | {"urdf": _bodies(urdf.read_text(encoding="utf-8"))})
    return drawings


def _bodies(urdf: str) -> str:
    """Return a URDF without what is no part of the arm: collision shapes, and frames other than the flange.

    The plant draws numbers body by body and loads the last one, so that a frame more would make another robot.
    """
    root = ElementTree.fromstring(urdf)
    parents = {joint.find("parent").get("link") for joint in root.findall("joint")}  # type: ignore[union-attr]
    bare = set()
    for link in root.findall("link"):
        for shape in link.findall("collision"):
            link.remove(shape)
        name = link.get("name")
        if not len(link) and name not in parents and name != "flange":
            bare.add(name)
            root.remove(link)
    for joint in root.findall("joint"):
        if joint.find("child").get("link") in bare:  # type: ignore[union-attr]
            root.remove(joint)
    return ElementTree.tostring(root, encoding="unicode")


def _typed(part: type, table: dict[str, Any]) -> Any:
    unknown = set(table) - {field.name for field in fields(part)}
    if unknown:
        raise ValueError(f"{part.__name__} has no {sorted(unknown)}")
    return part(**{key: np.asarray(v, dtype=float) if isinstance(v, list) else v for key, v in table.items()})


def _urdf_speeds(urdf: str, joints: list[str]) -> np.ndarray:
    speeds = {
        joint.get("name"): float(limit.get("velocity", "inf"))
        for joint in ElementTree.fromstring(urdf).findall("joint")
        if (limit := joint.find("limit")) is not None
    }
    return np.array([speeds[name] for name in joints])
