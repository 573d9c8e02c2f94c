"""The effect: one physical contribution to joint torque, electrical power or a measurement of them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from irtwin.robot.description import Joint, Robot
from irtwin.signals.motion import Motion


@dataclass(frozen=True)
class Term:
    """One coefficient of an effect, and what is known of it before any data.

    `expected` and `spread` (in `unit`) are mean and standard deviation of a weak prior: they decide only what the
    data leave open. `lowest` is the physical bound (friction and resistance are not negative). A `fixed` term is
    known to equal `expected` and is not estimated.
    """

    name: str
    unit: str
    joint: str | None = None
    link: str | None = None
    expected: float = 0.0
    spread: float = 1.0
    lowest: float = -np.inf
    fixed: bool = False


class Effect(ABC):
    """What adds `columns @ (coefficients + shift)` to its channel.

    `channel` is "torque" (a real torque: it drives or brakes, and carries mechanical power), "power" (electrical,
    W) or "measurement" (what a torque sensor shows beside the torque; it carries no power). To teach the twin a new
    effect, write a class and list it in `catalogue`.
    """

    id: ClassVar[str]
    channel: ClassVar[str]

    @abstractmethod
    def terms(self, robot: Robot) -> tuple[Term, ...]:
        """Return the k coefficients, in the order of the columns."""

    @abstractmethod
    def columns(self, robot: Robot, motion: Motion, torque: np.ndarray | None = None) -> np.ndarray:
        """Return the (N, n, k) columns of a torque or measurement effect, N m per unit of the coefficient.

        For a power effect: (N, k), W per unit, built from the *predicted* real joint `torque`, (N, n) N m.
        """

    def undecided(self, motion: Motion) -> np.ndarray | None:
        """Return (N, n) where the effect cannot say the joint's torque, so that a fit leaves these samples out."""
        return None

    def shift(self, robot: Robot, motion: Motion) -> np.ndarray | float:
        """Return what is known to be added to the (k,) coefficients in this motion: a payload, for one."""
        return 0.0


class JointEffect(Effect):
    """An effect that acts within each joint alone, by one coefficient and one column per joint."""

    @abstractmethod
    def term(self, joint: Joint) -> Term:
        """Return the joint's coefficient."""

    @abstractmethod
    def column(self, motion: Motion) -> np.ndarray:
        """Return the (N, n) column of each joint."""

    def terms(self, robot: Robot) -> tuple[Term, ...]:
        """Return one coefficient per joint."""
        return tuple(self.term(joint) for joint in robot.joints)

    def columns(self, robot: Robot, motion: Motion, torque: np.ndarray | None = None) -> np.ndarray:
        """Return the (N, n, n) columns: each joint's own, zero elsewhere."""
        column = self.column(motion)
        count = column.shape[1]
        columns = np.zeros((*column.shape, count))
        columns[:, range(count), range(count)] = column
        return columns


def force_unit(joint: Joint) -> str:
    """Return the unit of the joint's effort: "N m", or "N" where it slides."""
    return "N" if joint.kind == "prismatic" else "N m"


def inertia_unit(joint: Joint) -> str:
    """Return the unit of effort per acceleration of the joint."""
    return "kg" if joint.kind == "prismatic" else "kg m^2"


def catalogue() -> dict[str, Effect]:
    """Return every effect that the twin knows, by id."""
    from irtwin.effects.drive import CopperLoss, RotorInertia
    from irtwin.effects.friction import CoulombFriction, ViscousFriction
    from irtwin.effects.rigid_body import RigidBody
    from irtwin.effects.sensing import TorqueOffset
    from irtwin.effects.supply import MechanicalPower, StandbyPower

    effects: tuple[Effect, ...] = (
        RigidBody(),
        RotorInertia(),
        CoulombFriction(),
        ViscousFriction(),
        TorqueOffset(),
        MechanicalPower(),
        StandbyPower(),
        CopperLoss(),
    )
    return {effect.id: effect for effect in effects}


BASELINE = (
    "rigid_body",
    "rotor_inertia",
    "coulomb_friction",
    "viscous_friction",
    "torque_offset",
    "mechanical_power",
    "standby_power",
)
