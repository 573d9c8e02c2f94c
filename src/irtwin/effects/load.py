"""What the arm carries, is held by or touches: hoses, balancers, payloads, a tilted floor, a contact."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pinocchio as pin

from irtwin.effects.effect import (
    Coefficients,
    Effect,
    JointEffect,
    Possible,
    Predicted,
    Quantity,
    Stated,
    Term,
    force_unit,
    quantity,
    ratio,
)
from irtwin.effects.rigid_body import flange_frame, last_body_columns, model_of, to_body
from irtwin.robot.body_regressor import point_jacobian
from irtwin.robot.description import Joint, Robot
from irtwin.robot.model import inverse_dynamics
from irtwin.signals.motion import Motion

_HEAVIEST = 20.0  # kg: a load that any arm may carry, as data sheets have it,
_OF_ARM = 0.5  # of the arm's mass, if that is more; where a payload is rated
_FARTHEST = 1.0  # m from the flange to the centre of a load
_OVERLOAD = 2.0  # times it
_STEEPEST = 0.35  # rad: a base that leans more is no tilt, but mounted so
_UPRIGHT = 0.7  # of an axis' length that is vertical
_RESTS = (-0.5, 0.0, 0.5)  # rad (m), tried for a hose: between two of them both forms are alike
_FALLING = 1 / 3  # of the order before, in a balancer's torque: the nearer its anchors are to each other, the more
_UNKNOWN_LOAD = 1000.0  # N m at a joint beyond which no mass is known
_TURN = np.linspace(0, 2 * np.pi, 181)


def balanced_joint(robot: Robot) -> str:
    """Return the joint that makers balance: the first whose axis is not upright."""
    data = robot.model.createData()
    axes = pin.computeJointJacobians(robot.model, data, pin.neutral(robot.model))[3:]
    lying = np.abs(axes[2]) < _UPRIGHT
    return robot.joint_names[int(np.argmax(lying)) if lying.any() else 0]


def borne(robot: Robot, joint: int) -> float:
    """Return what bodies beyond a joint, as drawn, may ask of it, N m or N; 1000 where none has a mass."""
    model, data = robot.model, robot.model.createData()
    pin.forwardKinematics(model, data, pin.neutral(model))
    own, load = model.getJointId(robot.joint_names[joint]), 0.0
    for body in model.subtrees[own]:
        mass = max(model.inertias[body].mass, 0.0)
        away = data.oMi[body].act(model.inertias[body].lever) - data.oMi[own].translation
        load += mass * (1.0 if robot.joints[joint].unit == "m" else float(np.linalg.norm(away)))
    return load * float(np.linalg.norm(model.gravity.linear)) or _UNKNOWN_LOAD


@dataclass(frozen=True)
class CableDrag(JointEffect):
    """k (q - q0), and c (q - rest)^3 of one that `stiffens` as it is stretched: a hose package that pulls.

    Its constant part is a twin's torque offset. `rest`: where it is at rest, rad or m.
    """

    id: ClassVar[str] = "cable_drag"
    family: ClassVar[str] = "load"
    never_changed: ClassVar[bool] = True
    taken_off: ClassVar[str | None] = "with the hose package off"

    stiffens: bool = False
    rest: float = 0.0

    def joint_terms(self, joint: Joint) -> tuple[Term, ...]:
        """Return k, and of one that stiffens c, N m (N) at 1 rad (m)."""
        straight = Term("k", f"{force_unit(joint)}/{joint.unit}", joint.name, spread=20.0)
        return (straight, Term("c", force_unit(joint), joint.name, spread=10.0)) if self.stiffens else (straight,)

    def samples(self, robot: Robot, motion: Motion, predicted: Predicted | None) -> tuple[np.ndarray, ...]:
        """Return q, and (q - rest)^3 of one that stiffens."""
        return (motion.q, (motion.q - self.rest) ** 3) if self.stiffens else (motion.q,)

    def parameters(self, robot: Robot, given: Coefficients) -> tuple[Quantity, ...]:
        """Return k, the stiffness at rest."""
        return tuple(parameter for parameter in super().parameters(robot, given) if parameter.name == "k")

    def possible(self, robot: Robot, stated: Stated) -> Mapping[str, Possible]:
        """Return that a hose pulls back."""
        return {"k": Possible(0.0, np.inf, "a hose pulls a joint back to where it is at rest")}

    def changes(self) -> tuple[Effect, ...]:
        """Return the changes of the constant part, too: no offset beside it has to bring that. One may stiffen."""
        changed = ChangedCableDrag(joints=self.joints, runs=self.runs)
        return (changed, *replace(changed, stiffens=True).variants(rest=_RESTS))


@dataclass(frozen=True)
class ChangedCableDrag(CableDrag):
    """The same with its constant part: a hose that pulls from elsewhere, or otherwise, than in the runs before."""

    of_change: ClassVar[bool] = True
    never_changed: ClassVar[bool] = False

    def standing(self) -> Effect:
        """Return it in a twin, whose torque offset has the constant part."""
        return CableDrag(self.stiffens, self.rest, joints=self.joints, runs=self.runs)

    def joint_terms(self, joint: Joint) -> tuple[Term, ...]:
        """Return the terms of a hose, and k q0."""
        return (*super().joint_terms(joint), Term("k q0", force_unit(joint), joint.name, spread=20.0))

    def samples(self, robot: Robot, motion: Motion, predicted: Predicted | None) -> tuple[np.ndarray, ...]:
        """Return those of a hose, and -1."""
        return (*super().samples(robot, motion, predicted), np.full_like(motion.q, -1.0))


@dataclass(frozen=True)
class GravityCompensation(JointEffect):
    """k (L(q) - L0) dL/dq: a spring or a cylinder beside the joint; its first `orders` in the angle.

    One is enough where it is anchored far off, or has no length at rest: k a b sin(q - q0).
    """

    id: ClassVar[str] = "gravity_compensation"
    family: ClassVar[str] = "load"

    orders: int = 2

    def candidates(self, robot: Robot | None = None) -> tuple[Effect, ...]:
        """Return one order to three, at the joint that makers balance: the first that gravity loads."""
        shapes = self.variants(orders=(1, 2, 3))
        return shapes if robot is None else tuple(shape.on(balanced_joint(robot)) for shape in shapes)

    def terms(self, robot: Robot) -> tuple[Term, ...]:
        """Return the torques of each joint's cosines and sines; one is built to bear what gravity asks there."""
        return tuple(
            replace(term, spread=term.spread * borne(robot, place))
            for joint, place in zip(self.acting(robot), self.places(robot), strict=True)
            for term in self.joint_terms(joint)
        )

    def joint_terms(self, joint: Joint) -> tuple[Term, ...]:
        """Return the torques that go with cosine and sine of each order of the angle, for a joint that bears 1 N m."""
        unit = force_unit(joint)
        return tuple(
            Term(f"{wave} {order}" if order > 1 else wave, unit, joint.name, spread=_FALLING ** (order - 1))
            for order in range(1, self.orders + 1)
            for wave in ("cos", "sin")
        )

    def samples(self, robot: Robot, motion: Motion, predicted: Predicted | None) -> tuple[np.ndarray, ...]:
        """Return cosine and sine of each order of the angle."""
        return self._waves(motion.q)

    def _waves(self, q: np.ndarray) -> tuple[np.ndarray, ...]:
        return tuple(wave(order * q) for order in range(1, self.orders + 1) for wave in (np.cos, np.sin))

    def parameters(self, robot: Robot, given: Coefficients) -> tuple[Quantity, ...]:
        """Return the largest torque over a turn."""
        waves = np.column_stack(self._waves(_TURN))
        count = 2 * self.orders
        quantities = []
        for place, joint in enumerate(self.acting(robot)):
            own = slice(count * place, count * place + count)
            torque = waves @ given.values[own]
            wave = waves[int(np.argmax(np.abs(torque)))]
            deviation = float(np.sqrt(wave @ given.covariance[own, own] @ wave))
            quantities.append(quantity("torque", joint.name, np.abs(torque).max(), force_unit(joint), deviation))
        return tuple(quantities)


@dataclass(frozen=True)
class Payload(Effect):
    """Y_n(q, dq, ddq) (m, m c, I): a load at the flange that nobody told; c from the flange frame's origin."""

    id: ClassVar[str] = "payload"
    family: ClassVar[str] = "load"
    within_bodies: ClassVar[bool] = True
    smooth: ClassVar[bool] = True
    taken_off: ClassVar[str | None] = "with the tool off"

    def terms(self, robot: Robot) -> tuple[Term, ...]:
        """Return mass, first moments and inertia in the flange frame."""
        moments = [Term(f"m c_{axis}", "kg m", spread=2.0) for axis in "xyz"]
        inertias = [Term(f"I{axes}", "kg m^2", spread=0.3) for axes in ("xx", "xy", "yy", "xz", "yz", "zz")]
        return (Term("m", "kg", spread=20.0), *moments, *inertias)

    def columns(self, robot: Robot, motion: Motion, predicted: Predicted | None = None) -> np.ndarray:
        """Return (N, n, 10)."""
        return np.asarray(last_body_columns(robot, motion) @ to_body(flange_frame(robot).placement))

    def possible(self, robot: Robot, stated: Stated) -> Mapping[str, Possible]:
        """Return that the last body and its load have a mass, and that the arm can carry it."""
        body = robot.model.inertias[flange_frame(robot).parentJoint].mass
        together = body + stated.payload
        least, why = (-together, f"the last body and its load weigh {together:.3g} kg together")
        if body <= 0:  # nothing is known of it
            least, why = -np.inf, ""
        if stated.rated_payload:
            most = _OVERLOAD * stated.rated_payload
            carried = f"{stated.rated_payload:g} kg are rated"
        else:
            most = max(_HEAVIEST, _OF_ARM * sum(inertia.mass for inertia in robot.model.inertias))
            carried = f"no arm of its kind carries more than {most:.3g} kg"
        mass = Possible(least, most, "; ".join(filter(None, (why, carried))))
        near = Possible(-_FARTHEST, _FARTHEST, "a load's centre is within reach of its flange")
        return {"m": mass, **{f"c_{axis}": near for axis in "xyz"}}

    def parameters(self, robot: Robot, given: Coefficients) -> tuple[Quantity, ...]:
        """Return m, and c where the mass is one."""
        mass = float(given.values[0])
        quantities = [quantity("m", None, mass, "kg", float(given.deviations[0]))]
        for number, axis in enumerate("xyz", start=1):
            place = ratio(given.values[number], mass)
            if np.isfinite(place):
                slope = np.array([-place, 1.0]) / mass
                spread = given.covariance[np.ix_([0, number], [0, number])]
                quantities.append(quantity(f"c_{axis}", None, place, "m", float(np.sqrt(slope @ spread @ slope))))
        return tuple(quantities)


@dataclass(frozen=True)
class BaseTilt(Effect):
    """Gravity turned by small angles about the base's x and y axes, in rad."""

    id: ClassVar[str] = "base_tilt"
    family: ClassVar[str] = "environment"
    needs: ClassVar[str | None] = "torque"
    stage: ClassVar[int] = 1

    def terms(self, robot: Robot) -> tuple[Term, ...]:
        """Return the two angles."""
        return Term("angle_x", "rad", spread=0.15), Term("angle_y", "rad", spread=0.15)

    def columns(self, robot: Robot, motion: Motion, predicted: Predicted | None = None) -> np.ndarray:
        """Return (N, n, 2): the torque of gravity's change, turned by a unit."""
        model = model_of(robot, None if predicted is None else predicted.bodies)
        down = model.gravity.linear.copy()
        still = np.zeros_like(motion.dq)
        columns = np.empty((*motion.q.shape, 2))
        for axis in range(2):
            model.gravity.linear = np.cross(np.eye(3)[axis], down)
            columns[:, :, axis] = inverse_dynamics(model, motion.q, still, still)
        return columns

    def parameters(self, robot: Robot, given: Coefficients) -> tuple[Quantity, ...]:
        """Return the angle between the base's axis and the plumb line, and its two parts."""
        angle, deviation = given.size()
        whole = quantity("angle", None, angle, "rad", deviation)
        return (whole, *super().parameters(robot, given))

    def possible(self, robot: Robot, stated: Stated) -> Mapping[str, Possible]:
        """Return how far a base that was meant to stand upright may lean."""
        return {"angle": Possible(0.0, _STEEPEST, "a base that leans more was mounted so, and its URDF is wrong")}


@dataclass(frozen=True)
class ExternalContact(Effect):
    """J(q)^T f: a force at the flange, in the base's axes, from `start` to `stop` of the run's clock.

    The coefficients are what the drives add against the contact. `runs` says in which runs; None: in all.
    """

    id: ClassVar[str] = "external_contact"
    family: ClassVar[str] = "environment"
    manual_test: ClassVar[str | None] = "the same motion with free space around the arm"
    taken_off: ClassVar[str | None] = "in free space"

    start: float = -np.inf  # s
    stop: float = np.inf  # s

    @property
    def window(self) -> tuple[float, float] | None:
        """From start to stop; None: throughout."""
        return (self.start, self.stop) if np.isfinite([self.start, self.stop]).any() else None

    def terms(self, robot: Robot) -> tuple[Term, ...]:
        """Return the force along three axes."""
        return tuple(Term(f"f_{axis}", "N", spread=200.0) for axis in "xyz")

    def columns(self, robot: Robot, motion: Motion, predicted: Predicted | None = None) -> np.ndarray:
        """Return (N, n, 3) the Jacobian, transposed, during the event."""
        frame = robot.model.getFrameId(flange_frame(robot).name, pin.FrameType.BODY)
        columns = np.zeros((*motion.q.shape, 3))
        during = (motion.time >= self.start) & (motion.time <= self.stop)
        if during.any():
            columns[during] = point_jacobian(robot.model, frame, motion.q[during])
        return columns

    def parameters(self, robot: Robot, given: Coefficients) -> tuple[Quantity, ...]:
        """Return the force, its three parts, and start and stop where it has them."""
        length, deviation = given.size()
        ends = (quantity(name, None, end, "s") for name, end in (("start", self.start), ("stop", self.stop)))
        return (
            quantity("f", None, length, "N", deviation),
            *super().parameters(robot, given),
            *(end for end in ends if np.isfinite(end.value)),
        )
