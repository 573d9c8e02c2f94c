"""What a robot is: its joints, links, limits and data sheet."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import pinocchio as pin

from irtwin.robot.model import build_model, mean_inertia

GRAVITY, DYNAMICS = "gravity", "dynamics"
FEEDFORWARD = (GRAVITY, DYNAMICS)
"""What a controller may add to its servos: torque of gravity at the commanded position, or of the commanded motion."""


@dataclass(frozen=True)
class Joint:
    """A moving joint. Lengths and angles in m or rad by `kind`; None where nobody said.

    `rotor_inertia` (kg m^2), `torque_constant` (N m/A) are reflected to the joint; `winding_resistance` in ohm.
    `kp`, `kd`: gains of its controller, N m/rad (N/m) and N m s/rad (N s/m) of the joint.
    `friction_width` (rad/s or m/s) and `friction_exponent`: over which speed, and how, dry friction turns at zero
    (`effects.friction.turn`); None: at once. `friction_widest`: the wider of two such widths, where runs show two.
    `dry_friction`: how large it is by the same fit, N m (N).
    """

    name: str
    kind: str  # "revolute", "continuous" or "prismatic"
    lower: float = -np.inf
    upper: float = np.inf
    velocity: float = np.inf
    effort: float = np.inf
    acceleration: float | None = None
    gear_ratio: float | None = None
    rotor_inertia: float | None = None
    torque_constant: float | None = None
    winding_resistance: float | None = None
    kp: float | None = None
    kd: float | None = None
    friction_width: float | None = None
    friction_exponent: float | None = None
    friction_widest: float | None = field(default=None, compare=False)  # no number of a twin, as the next
    dry_friction: float | None = field(default=None, compare=False)

    @property
    def unit(self) -> str:
        """Unit of the joint's position: "rad" or "m"."""
        return "m" if self.kind == "prismatic" else "rad"


@dataclass(frozen=True)
class Link:
    """A rigid body, nominal inertia as the URDF gives it: mass in kg."""

    name: str
    mass: float


@dataclass(frozen=True)
class Robot:
    """A serial (or branched) robot of n moving joints, in the order of `q`.

    `held`: joints that mimic others, as fingers of a gripper do; they stand still in the model. `feedforward`: of what
    its controller adds torque, one of `FEEDFORWARD`.
    """

    name: str
    joints: tuple[Joint, ...]
    links: tuple[Link, ...]
    urdf: str = field(repr=False)  # checked text, no mesh is ever opened from it
    manufacturer: str | None = None
    type: str | None = None
    weight: float | None = None  # kg
    held: tuple[str, ...] = ()
    feedforward: str | None = None

    @cached_property
    def model(self) -> pin.Model:
        """The Pinocchio model, nq = nv = n, built from `urdf`."""
        return build_model(self.urdf)

    @cached_property
    def mean_inertia(self) -> np.ndarray:
        """(n,) kg m^2 or kg: the inertia that each joint moves while the others hold, the mean over poses."""
        return mean_inertia(self.model)

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """Names in the order of `q`."""
        return tuple(joint.name for joint in self.joints)

    @property
    def limits(self) -> tuple[np.ndarray, np.ndarray]:
        """The least and the greatest positions of the joints, (n,) rad or m; infinite where there are none."""
        return np.array([joint.lower for joint in self.joints]), np.array([joint.upper for joint in self.joints])

    def index(self, joint: str) -> int:
        """Return the column of `q` that belongs to the joint's name."""
        return self.joint_names.index(joint)
