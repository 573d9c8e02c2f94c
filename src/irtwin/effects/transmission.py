"""What happens between motor and link: play, give, ripple, and joints that turn each other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pinocchio as pin

from irtwin.effects.effect import (
    Effect,
    JointEffect,
    Known,
    Predicted,
    Quantity,
    Term,
    force_unit,
    inertia_unit,
    quantity,
    ratio,
    size,
)
from irtwin.effects.friction import direction
from irtwin.effects.rigid_body import inverse_dynamics, model_of
from irtwin.robot.description import Joint, Robot
from irtwin.signals.conditioning import differentiate
from irtwin.signals.motion import Motion

_GEARS = (50.0, 80.0, 100.0, 101.0, 120.0, 121.0, 160.0)  # common ratios of strain-wave and cycloidal gears


def load_torque(robot: Robot, motion: Motion, predicted: Predicted | None) -> np.ndarray:
    """Return (N, n) the torque that the links take beyond the gears."""
    if predicted is not None and predicted.load is not None:
        return predicted.load
    return inverse_dynamics(model_of(robot, None if predicted is None else predicted.bodies), motion)


@dataclass(frozen=True)
class Backlash(JointEffect):
    """The load's torque is lost while the motor crosses a gap of b, after that torque changed its sign.

    The coefficient is what is lost in units of the shape's gap: its square root scales b, as the lost impulse grows
    with the gap squared.
    """

    id: ClassVar[str] = "backlash"
    channel: ClassVar[str] = "torque"
    needs: ClassVar[str | None] = "torque"
    stage: ClassVar[int] = 1
    memory: ClassVar[bool] = True
    ranges: ClassVar[dict[str, tuple[float, float]]] = {"b": (3e-4, 3e-3)}

    b: float = 1e-3  # rad

    def candidates(self, robot: Robot | None = None) -> tuple[Effect, ...]:
        """Return gaps over the range."""
        return self.variants(b=(3e-4, 1e-3, 3e-3))

    def joint_terms(self, joint: Joint) -> tuple[Term, ...]:
        """Return the lost share."""
        return (Term("lost", "1", joint.name, lowest=0.0),)

    def samples(self, robot: Robot, motion: Motion, predicted: Predicted | None) -> tuple[np.ndarray, ...]:
        """Return minus the load's torque while the gap is crossed."""
        load = load_torque(robot, motion, predicted)
        step = np.maximum(np.abs(motion.dq) / motion.rate, 1e-9)
        column = np.zeros_like(load)
        for joint in range(load.shape[1]):
            crossed = np.append(False, np.diff(np.sign(load[:, joint])) != 0)
            last = np.maximum.accumulate(np.where(crossed, np.arange(len(crossed)), -1))
            way = np.abs(motion.q[:, joint] - motion.q[last, joint])
            inside = np.clip((self.b - way) / step[:, joint] + 0.5, 0.0, 1.0)  # the share of the sample in the gap
            column[:, joint] = np.where(last < 0, 0.0, -load[:, joint] * inside)
        return (column,)

    def parameters(
        self, robot: Robot, values: np.ndarray, covariance: np.ndarray, known: Known | None = None
    ) -> tuple[Quantity, ...]:
        """Return b."""
        return tuple(
            quantity("b", joint.name, value, joint.unit, deviation, lambda lost: self.b * max(lost, 0.0) ** 0.5)
            for joint, value, deviation in zip(self.acting(robot), values, np.sqrt(np.diag(covariance)), strict=True)
        )


@dataclass(frozen=True)
class JointElasticity(Effect):
    """Ia d2/dt2 (tau_load/K): the motor turns beyond a link whose position was measured (`encoder` "link").

    With the encoder on the motor (`encoder` "motor") it is the link that lags: -M_j d2/dt2 (tau_load/K) and the slope
    of gravity, in every joint. The coefficient is Ia/K (s^2), or 1/K.
    """

    id: ClassVar[str] = "joint_elasticity"
    channel: ClassVar[str] = "torque"
    needs: ClassVar[str | None] = "torque"
    stage: ClassVar[int] = 1
    memory: ClassVar[bool] = True
    reach: ClassVar[int | None] = 64  # a quintic spline forgets all but 0.43 of what lies a sample farther off

    encoder: str = "link"

    def candidates(self, robot: Robot | None = None) -> tuple[Effect, ...]:
        """Return either place of the encoder."""
        return self.variants(encoder=("link", "motor"))

    def terms(self, robot: Robot) -> tuple[Term, ...]:
        """Return Ia/K, or 1/K, per joint."""
        if self.encoder == "link":
            return tuple(Term("Ia/K", "s^2", joint.name, spread=5e-3, lowest=0.0) for joint in self.acting(robot))
        return tuple(
            Term("1/K", f"{joint.unit}/({force_unit(joint)})", joint.name, spread=1e-3, lowest=0.0)
            for joint in self.acting(robot)
        )

    def columns(self, robot: Robot, motion: Motion, predicted: Predicted | None = None) -> np.ndarray:
        """Return (N, n, k) what a unit of the coefficient adds."""
        load = load_torque(robot, motion, predicted)
        jerked = differentiate(differentiate(load, motion.rate), motion.rate)
        acting = [robot.index(joint.name) for joint in self.acting(robot)]
        columns = np.zeros((*load.shape, len(acting)))
        if self.encoder == "link":
            columns[:, acting, range(len(acting))] = jerked[:, acting]
            return columns
        model = model_of(robot, None if predicted is None else predicted.bodies)
        data = model.createData()
        for row, q in enumerate(motion.q):
            mass = pin.crba(model, data, q) * jerked[row]
            slope = pin.computeGeneralizedGravityDerivatives(model, data, q) * load[row]
            columns[row] = -(mass + slope)[:, acting]
        return columns

    def parameters(
        self, robot: Robot, values: np.ndarray, covariance: np.ndarray, known: Known | None = None
    ) -> tuple[Quantity, ...]:
        """Return K; nothing where the rotor's inertia is needed and not known."""
        found = []
        for joint, value, deviation in zip(self.acting(robot), values, np.sqrt(np.diag(covariance)), strict=True):
            rotor = (known or {}).get(("rotor_inertia", joint.name, "Ia"), joint.rotor_inertia)
            inertia = 1.0 if self.encoder == "motor" else rotor
            if inertia and value > 0:
                sure = value - 1.96 * deviation > 0  # else K has no upper end
                unit = f"{force_unit(joint)}/{joint.unit}"
                convert = lambda give, inertia=inertia: ratio(inertia, give)  # noqa: E731
                found.append(quantity("K", joint.name, value, unit, deviation if sure else None, convert))
        return tuple(found)


@dataclass(frozen=True)
class TorqueRipple(JointEffect):
    """A sin(N q + f): teeth, poles and cogging. A second order is a second effect, of another N."""

    id: ClassVar[str] = "torque_ripple"
    channel: ClassVar[str] = "torque"
    ranges: ClassVar[dict[str, tuple[float, float]]] = {"N": (1.0, 400.0)}

    N: float = 1.0  # per turn of the joint

    def candidates(self, robot: Robot | None = None) -> tuple[Effect, ...]:
        """Return low orders, and once and twice per turn of a motor: of the robot's gears, or of common ones."""
        gears = {joint.gear_ratio for joint in robot.joints if joint.gear_ratio} if robot else set()
        fast = [order * gear for gear in sorted(gears or _GEARS) for order in (1, 2)]
        orders = sorted({*map(float, range(1, 25)), *fast})
        return self.variants(N=tuple(order for order in orders if order <= self.ranges["N"][1]))

    def joint_terms(self, joint: Joint) -> tuple[Term, ...]:
        """Return A cos f and A sin f."""
        unit = force_unit(joint)
        return tuple(Term(f"A {part} {self.N:g}", unit, joint.name, spread=5.0) for part in ("cos", "sin"))

    def samples(self, robot: Robot, motion: Motion, predicted: Predicted | None) -> tuple[np.ndarray, ...]:
        """Return sin N q and cos N q."""
        return np.sin(self.N * motion.q), np.cos(self.N * motion.q)

    def parameters(
        self, robot: Robot, values: np.ndarray, covariance: np.ndarray, known: Known | None = None
    ) -> tuple[Quantity, ...]:
        """Return A and N."""
        found = []
        for place, joint in enumerate(self.acting(robot)):
            own = slice(2 * place, 2 * place + 2)
            length, deviation = size(values[own], covariance[own, own])
            found.append(quantity("A", joint.name, length, force_unit(joint), deviation))
            found.append(Quantity("N", joint.name, self.N, "1/rev"))
        return tuple(found)


@dataclass(frozen=True)
class JointCoupling(Effect):
    """Ia ddq_k + Fv dq_k + Fc sign(dq_j + dq_k) on joint j, the same with j and k exchanged on joint k.

    `joints` are the pair (j, k): a wrist in which one motor turns two joints; None for the last two.
    """

    id: ClassVar[str] = "joint_coupling"
    channel: ClassVar[str] = "torque"

    def pair(self, robot: Robot) -> tuple[Joint, ...]:
        """Return the two joints; none on a robot of one."""
        acting = self.acting(robot)
        return acting[-2:] if len(acting) > 1 else ()

    def touched(self, robot: Robot, joint: str) -> tuple[str, ...]:
        """Return both joints of the pair."""
        return tuple(one.name for one in self.pair(robot))

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
            rubs = direction(motion.dq[:, places].sum(axis=1))
            for joint, other in (places, places[::-1]):
                columns[:, joint] = np.column_stack([motion.ddq[:, other], motion.dq[:, other], rubs])
        return columns
