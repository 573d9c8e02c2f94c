"""The rigid bodies that a robot moves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar
from weakref import ReferenceType, ref

import numpy as np
import pinocchio as pin

from irtwin.effects.effect import Effect, Predicted, Term
from irtwin.errors import InputError
from irtwin.robot.body_regressor import body_regressor, carried_bodies
from irtwin.robot.description import Robot
from irtwin.robot.kinematics import flange
from irtwin.robot.model import inverse_dynamics
from irtwin.signals.motion import Motion

# Pinocchio's order; first moments and inertias about the joint's frame
NAMES = ("m", "mx", "my", "mz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")
_UNITS = ("kg",) + ("kg m",) * 3 + ("kg m^2",) * 6
_LIGHT = 1e-6  # kg
_HEAVIEST, _FARTHEST = 1e5, 1e3  # kg, m: of a payload
_OFF = 4.0  # times what bodies weigh in the mean: so far a drawing may be off in one
_UNKNOWN = 50.0  # kg: a body of an arm of which no mass is stated


@dataclass(frozen=True)
class RigidBody(Effect):
    """M(q) ddq + C(q, dq) dq + G(q): linear in ten inertial parameters per moving body (Yan 2018, eqs. 1, 2)."""

    id: ClassVar[str] = "rigid_body"
    family: ClassVar[str] = "bodies"
    bodies: ClassVar[bool] = True
    prior_tells: ClassVar[bool] = True
    smooth: ClassVar[bool] = True
    entries: ClassVar[tuple[str, ...]] = ("kinetic_energy", "potential_energy", "lifted_load")

    def terms(self, robot: Robot) -> tuple[Term, ...]:
        """Return ten terms per moving body, expected as in the URDF, give or take what a body weighs in the mean."""
        model = robot.model
        drawn = sum(max(inertia.mass, 0.0) for inertia in model.inertias[1:])
        spread = _OFF * max(drawn, robot.weight or 0.0) / model.nv or _UNKNOWN
        reach = sum(float(np.linalg.norm(place.translation)) for place in model.jointPlacements[1:]) / model.njoints
        arm = max(reach, 0.1)
        spreads = [spread] + [spread * arm] * 3 + [spread * arm**2] * 6
        return tuple(
            Term(name, unit, joint=joint, link=_body(model, index), expected=float(value), spread=width)
            for index, joint in enumerate(model.names[1:], start=1)
            for name, unit, value, width in zip(
                NAMES, _UNITS, model.inertias[index].toDynamicParameters(), spreads, strict=True
            )
        )

    def columns(self, robot: Robot, motion: Motion, predicted: Predicted | None = None) -> np.ndarray:
        """Return the (N, n, 10 n) torque regressor."""
        return _regressor(robot, motion)

    def contribution(
        self, robot: Robot, motion: Motion, values: np.ndarray, predicted: Predicted | None = None
    ) -> np.ndarray:
        """Return the (N, n) torque of bodies of these inertial parameters (10 n,), by recursive Newton-Euler."""
        return inverse_dynamics(model_of(robot, values), motion.q, motion.dq, motion.ddq)

    def carried(
        self, robot: Robot, motion: Motion, along: np.ndarray, predicted: Predicted | None = None
    ) -> np.ndarray:
        """Return (N, 10 n) the columns, each joint's times its `along` (N, n), summed over joints."""
        return carried_bodies(robot.model, motion.q, motion.dq, motion.ddq, along)

    def booked(self, robot: Robot, motion: Motion, columns: np.ndarray) -> Mapping[str, np.ndarray]:
        """Return what gravity alone makes as potential energy, and the rest as kinetic energy."""
        still = np.zeros_like(motion.dq)
        gravity = body_regressor(robot.model, motion.q, still, still)
        kinetic, potential, _ = self.entries
        return {kinetic: columns - gravity, potential: gravity}

    def shift(self, robot: Robot, motion: Motion) -> np.ndarray:
        """Return the payload that the controller was told, as a point mass on the last body.

        Raises InputError on one that no robot carries.
        """
        _check_payload(motion)
        model = robot.model
        added = np.zeros(10 * model.nv)
        if motion.payload_mass:
            frame = flange_frame(robot)
            centre = frame.placement.act(np.array(motion.payload_com, dtype=float))
            load = pin.Inertia(motion.payload_mass, centre, np.zeros((3, 3)))
            first = 10 * (frame.parentJoint - 1)
            added[first : first + 10] = load.toDynamicParameters()
        return added


def _check_payload(motion: Motion) -> None:
    mass, com = motion.payload_mass, motion.payload_com
    if not 0 <= mass <= _HEAVIEST:
        raise InputError(f'run "{motion.run}": the payload is {mass:g} kg; give 0 to {_HEAVIEST:g} kg')
    if not all(abs(part) <= _FARTHEST for part in com):
        shown = ", ".join(f"{part:g}" for part in com)
        raise InputError(
            f'run "{motion.run}": the payload is at {shown} m; give it in the flange frame, within {_FARTHEST:g} m'
        )


def flange_frame(robot: Robot) -> pin.Frame:
    """Return the flange's frame: its place on the last body, `parentJoint`."""
    model = robot.model
    return model.frames[model.getFrameId(flange(robot), pin.FrameType.BODY)]


def model_of(robot: Robot, bodies: np.ndarray | None) -> pin.Model:
    """Return a copy of the robot's model with the (10 n,) inertial parameters; None keeps the URDF's.

    Torque is linear in them, so any numbers will do, bodies of no or negative mass too.
    """
    model = robot.model.copy()
    if bodies is not None:
        for index, values in enumerate(bodies.reshape(-1, 10), start=1):
            mass = values[0] if abs(values[0]) > _LIGHT else _LIGHT
            model.inertias[index] = pin.Inertia.FromDynamicParameters(np.append(mass, values[1:]))
    return model


def torque_slope(robot: Robot, bodies: np.ndarray | None, motion: Motion) -> np.ndarray:
    """Return (N, n, n) the slope of each joint's torque over each joint's position, by (10 n,) inertial parameters.

    Pinocchio divides by the mass of all bodies beyond a joint. Where these have none, or less, ballast in every body
    goes along and is taken off afterwards: torque is linear in the bodies.
    """
    model = model_of(robot, bodies)
    ballast = np.zeros((model.nv, 10))
    ballast[:, 0] = _ballast(model)
    if not ballast.any():
        return _slope(model, motion)
    carried = np.concatenate([inertia.toDynamicParameters() for inertia in list(model.inertias)[1:]])
    loaded, alone = model_of(robot, carried + ballast.ravel()), model_of(robot, ballast.ravel())
    return np.asarray(_slope(loaded, motion) - _slope(alone, motion))


def _ballast(model: pin.Model) -> float:
    """Return the mass in every body, kg, with which there is some beyond each joint; 0 where there is already."""
    masses = np.array([inertia.mass for inertia in model.inertias])
    beyond = masses.copy()
    for joint in range(model.njoints - 1, 0, -1):
        beyond[model.parents[joint]] += beyond[joint]
    return 0.0 if (beyond[1:] >= _LIGHT).all() else 1.0 + 2 * float(np.abs(masses).max())


def _slope(model: pin.Model, motion: Motion) -> np.ndarray:
    data = model.createData()
    slope = np.empty((*motion.q.shape, model.nv))
    for row, state in enumerate(zip(motion.q, motion.dq, motion.ddq, strict=True)):
        slope[row] = pin.computeRNEADerivatives(model, data, *state)[0]
    return slope


def last_body_columns(robot: Robot, motion: Motion) -> np.ndarray:
    """Return (N, n, 10) the regressor of the body that carries the flange; zeros where no joint moves it."""
    carrier = flange_frame(robot).parentJoint
    if carrier == 0:
        return np.zeros((*motion.q.shape, 10))
    return _regressor(robot, motion)[:, :, 10 * (carrier - 1) : 10 * carrier]


# The last regressors, by robot and states: bodies, payload and each look at a run ask for those of the same samples.
_kept: dict[tuple[object, ...], tuple[tuple[ReferenceType[np.ndarray], ...], np.ndarray]] = {}
_MOST_KEPT = 8_000_000  # numbers


def _regressor(robot: Robot, motion: Motion) -> np.ndarray:
    """Return the (N, n, 10 n) torque regressor of all bodies, not to be written to."""
    states = motion.q, motion.dq, motion.ddq
    key = robot.urdf, *((state.ctypes.data, state.shape, state.strides) for state in states)
    owners, regressor = _kept.pop(key, ((), None))
    if regressor is None or any(owner() is None for owner in owners):
        regressor = body_regressor(robot.model, *states)
        regressor.flags.writeable = False
        memory = (state.base if isinstance(state.base, np.ndarray) else state for state in states)
        owners = tuple(ref(own, lambda _: _kept.pop(key, None)) for own in memory)  # others may come to lie there
    _kept[key] = owners, regressor
    while sum(own.size for _, own in list(_kept.values())) > _MOST_KEPT and len(_kept) > 1:
        _kept.pop(next(iter(list(_kept))), None)
    return regressor


def to_body(placement: pin.SE3) -> np.ndarray:
    """Return the (10, 10) map of inertial parameters in a frame to those in the body that it is placed on."""
    start = pin.Inertia(1.0, np.zeros(3), np.eye(3))
    base = start.toDynamicParameters()

    def moved(parameters: np.ndarray) -> np.ndarray:
        return np.asarray(placement.act(pin.Inertia.FromDynamicParameters(parameters)).toDynamicParameters())

    origin = moved(base)
    mass = moved(2 * base) - origin - (moved(base + np.append(0, base[1:])) - origin)
    return np.column_stack([mass, *(moved(base + unit) - origin for unit in np.eye(10)[1:])])


def _body(model: pin.Model, joint: int) -> str | None:
    """Return the link that the joint moves: of those fixed together, the one next to the joint."""
    bodies = (frame for frame in model.frames if frame.type == pin.FrameType.BODY and frame.parentJoint == joint)
    return next((str(frame.name) for frame in bodies), None)
