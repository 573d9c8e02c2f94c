"""What gears add: ripple, and joints that turn each other."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from irtwin.effects.effect import (
    Coefficients,
    Effect,
    JointEffect,
    Predicted,
    Quantity,
    Term,
    force_unit,
    inertia_unit,
    quantity,
)
from irtwin.effects.friction import sharp_sign
from irtwin.robot.description import Joint, Robot
from irtwin.signals.motion import Motion

SLOW_ORDERS = tuple(map(float, range(1, 25)))  # a turn of the joint


@dataclass(frozen=True)
class TorqueRipple(JointEffect):
    """A sin(N q + f): teeth, poles and cogging. A second order is a second effect, of another N."""

    id: ClassVar[str] = "torque_ripple"
    family: ClassVar[str] = "transmission"
    ranges: ClassVar[dict[str, tuple[float, float]]] = {"N": (1.0, 400.0)}

    N: float = 1.0  # per turn of the joint

    @property
    def screened(self) -> bool:
        """Whether it is faster than the orders that are all tried."""
        return max(SLOW_ORDERS) < self.N

    def candidates(self, robot: Robot | None = None) -> tuple[Effect, ...]:
        """Return slow orders, and once and twice per turn of a motor where the robot's gears are known."""
        gears = {joint.gear_ratio for joint in robot.joints if joint.gear_ratio} if robot else set()
        orders = sorted({*SLOW_ORDERS, *(order * gear for gear in gears for order in (1, 2))})
        return self.variants(N=tuple(order for order in orders if order <= self.ranges["N"][1]))

    def joint_terms(self, joint: Joint) -> tuple[Term, ...]:
        """Return A cos f and A sin f."""
        unit = force_unit(joint)
        return tuple(Term(f"A {part} {self.N:g}", unit, joint.name, spread=5.0) for part in ("cos", "sin"))

    def samples(self, robot: Robot, motion: Motion, predicted: Predicted | None) -> tuple[np.ndarray, ...]:
        """Return sin N q and cos N q."""
        return np.sin(self.N * motion.q), np.cos(self.N * motion.q)

    def parameters(self, robot: Robot, given: Coefficients) -> tuple[Quantity, ...]:
        """Return A and N."""
        quantities = []
        for place, joint in enumerate(self.acting(robot)):
            length, deviation = given.size(slice(2 * place, 2 * place + 2))
            quantities.append(quantity("A", joint.name, length, force_unit(joint), deviation))
            quantities.append(Quantity("N", joint.name, self.N, "1/rev"))
        return tuple(quantities)


@dataclass(frozen=True)
class JointCoupling(Effect):
    """Ia ddq_k + Fv dq_k + Fc sign(dq_j + dq_k) on joint j, the same with j and k exchanged on joint k.

    `joints` are the pair (j, k): a wrist in which one motor turns two joints; None for the last two. Where torque is
    that of motors, the one that both joints turn, k, shows its own friction alone: it is not `mutual`.
    """

    id: ClassVar[str] = "joint_coupling"
    family: ClassVar[str] = "transmission"
    lately: ClassVar[frozenset[str]] = frozenset({"mutual"})

    mutual: bool = True

    def candidates(self, robot: Robot | None = None) -> tuple[Effect, ...]:
        """Return it as it is felt at both joints, and at one."""
        return self.variants(mutual=(True, False))

    def pair(self, robot: Robot) -> tuple[Joint, ...]:
        """Return the two joints; none on a robot of one."""
        acting = self.acting(robot)
        return acting[-2:] if len(acting) > 1 else ()

    def on(self, *joints: str) -> Self:
        """Return the effect in a pair of joints; one joint alone leaves the pair as it is."""
        return replace(self, joints=joints) if len(joints) > 1 else self

    def touched(self, robot: Robot, joint: str) -> tuple[str, ...]:
        """Return the joints of the pair that feel it."""
        return tuple(axis.name for axis in self.pair(robot)[0 if self.mutual else 1 :])

    def terms(self, robot: Robot) -> tuple[Term, ...]:
        """Return Ia, Fv and Fc of the pair, named by its second joint."""
        return tuple(
            term
            for joint in self.pair(robot)[1:]
            for term in (
                Term("Ia", inertia_unit(joint), joint.name, spread=1.0),
                Term("Fv", f"{force_unit(joint)} s/{joint.unit}", joint.name, spread=3.0),
                Term("Fc", force_unit(joint), joint.name, spread=5.0),
            )
        )

    def columns(self, robot: Robot, motion: Motion, predicted: Predicted | None = None) -> np.ndarray:
        """Return (N, n, 3)."""
        places = [robot.index(joint.name) for joint in self.pair(robot)]
        columns = np.zeros((*motion.dq.shape, 3 if places else 0))
        if places:
            rubs = sharp_sign(motion.dq[:, places].sum(axis=1))
            for joint, other in (places[::-1], *([places] if self.mutual else [])):
                columns[:, joint] = np.column_stack([*self._turned(motion, joint, other), rubs])
        return columns

    def _turned(self, motion: Motion, joint: int, other: int) -> tuple[np.ndarray, np.ndarray]:
        """Return acceleration and speed (N,) of what turns with the other joint and is felt at this one."""
        return motion.ddq[:, other], motion.dq[:, other]

    def changes(self) -> tuple[Effect, ...]:
        """Return the change of what turns with both joints: no friction of a joint beside it has to bring its part."""
        return ChangedJointCoupling(joints=self.joints, runs=self.runs).variants(mutual=(True, False))


@dataclass(frozen=True)
class ChangedJointCoupling(JointCoupling):
    """Ia (ddq_j + ddq_k) + Fv (dq_j + dq_k) + Fc sign(dq_j + dq_k) on both joints: with each joint's own part."""

    of_change: ClassVar[bool] = True

    def standing(self) -> Effect:
        """Return it in a twin, whose rotors and friction have each joint's own part."""
        return JointCoupling(joints=self.joints, runs=self.runs, mutual=self.mutual)

    def _turned(self, motion: Motion, joint: int, other: int) -> tuple[np.ndarray, np.ndarray]:
        return motion.ddq[:, joint] + motion.ddq[:, other], motion.dq[:, joint] + motion.dq[:, other]
