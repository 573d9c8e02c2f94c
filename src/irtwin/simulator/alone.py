"""Each joint of a model played by itself, the others as they were measured: quick enough to fit numbers by.

The equations are MuJoCo's of one joint: its servo within the force that it has, damping, and dry friction that gives
way as its impedance says. Bodies load the joint as the measured motion has it. A soft joint is as good as rigid here.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
import scipy

from irtwin.identification.progress import track
from irtwin.identification.two_processes import can_copy, shared
from irtwin.signals.filter import smoothed
from irtwin.signals.sampling import interval
from irtwin.simulator.engine import mujoco
from irtwin.simulator.payload import loaded
from irtwin.simulator.play import PlayedStretch, commanded
from irtwin.simulator.servos import NAMES, OF_JOINTS, OF_ROBOT, Servos, tilted

_SMOOTH = 0.25  # s, over which measured positions are smoothed for their speed and acceleration
_ASIDE = 0.01  # m from the flange, and rad, for what a payload's place and a tilt change
_AT_ONCE = 12_000_000  # positions that are held at a time
_STEPS = 64  # of which what does not depend on the motion is worked out together
_LONG = 4_000_000  # positions, from which a copy of this process plays half of them


@dataclass(frozen=True)
class Alone:
    """What stretches of runs are to a joint by itself, at steps of `step` s.

    `load` (7, steps, p, n): torque of bodies and of the other joints, N m, what each kg at the flange adds, each kg m
    from it along three axes, and each rad of two tilts; `inertia` of the bodies likewise, kg m^2; `begun` (2, p, n):
    position and speed.
    """

    servos: Servos
    stretches: tuple[PlayedStretch, ...]
    step: float
    load: np.ndarray
    inertia: np.ndarray
    begun: np.ndarray

    def play(self, numbers: Sequence[np.ndarray]) -> list[list[np.ndarray]]:
        """Return, for each set of numbers (k, n) and each stretch, what the joints do at its samples, as `measured`."""
        is_long = len(numbers) * self.load[0].size > _LONG and can_copy()
        return shared(self._each, numbers) if is_long else self._each(numbers)

    def _each(self, numbers: Sequence[np.ndarray]) -> list[list[np.ndarray]]:
        most = max(1, _AT_ONCE // (self.load[0].size * self.stretches[0].measured.shape[1]))
        parts = [np.array(numbers[first : first + most]) for first in range(0, len(numbers), most)]
        return [moved for part in parts for moved in self._some(part)]

    def _some(self, numbers: np.ndarray) -> list[list[np.ndarray]]:
        steps = self.load.shape[1]
        begin = np.arange(steps) * self.step
        told = np.empty((steps, len(numbers) * len(self.stretches), numbers.shape[2]))
        for place, commands in enumerate(commanded(self.servos, product(numbers, self.stretches), begin, self.step)):
            told[:, place] = commands
        by_set = told.reshape(steps, len(numbers), len(self.stretches), -1)
        moved = self._moved(numbers, by_set, self._fed(numbers, begin))
        at = [stretch.time / self.step for stretch in self.stretches]
        return [
            [_between(moved[:, :, set_index, place], at[place]) for place in range(len(self.stretches))]
            for set_index in range(len(numbers))
        ]

    def _fed(self, numbers: np.ndarray, begin: np.ndarray) -> np.ndarray:
        """Return the torque that the controller adds over steps that begin at times, (steps, v, p, n).

        Of length 1 where it is the same for all: with no feedforward, or where no delay differs.
        """
        if (feedforward := self.servos.feedforward) is None:
            return np.zeros((len(begin), 1, 1, 1))
        delays = numbers[:, NAMES.index("delay")]
        some = numbers[:1] if (delays == delays[:1]).all() else numbers
        every = [[stretch.fed(feedforward, begin, own) for stretch in self.stretches] for own in some]
        return np.moveaxis(np.array(every), 2, 0)

    def _moved(self, numbers: np.ndarray, told: np.ndarray, fed: np.ndarray) -> np.ndarray:
        """Return what joints do (steps + 1, c, v, p, n), as `measured`, under the commands told (steps, v, p, n).

        `fed`: the torque that their controller adds.
        """
        compiled, servos, step = self.servos.model.compiled, self.servos, self.step
        at = servos.actuators
        own = np.moveaxis(numbers, 1, 0)[:, :, None, :]
        stiffness, damping, friction, _, armature, _, _, limit, band, spring, *_ = own[: len(OF_JOINTS)]
        joint, servo = servos.dampings(damping)
        least, most = servos.limits(limit)
        rest = compiled.qpos_spring[servos.model.positions]
        filters = compiled.actuator_dynprm[at, 0] * (compiled.actuator_actnum[at] > 0)
        share = np.where(filters > 0, -np.expm1(-step / np.maximum(filters, 1e-9)), 1.0)
        load, bodies = self._load(own[len(OF_JOINTS) :])
        soft, back = _dry(servos, own, step)
        lower, upper = self._stops()
        banded, lags, sprung = bool(band.any()), bool((share < 1).any()), bool(spring.any())
        stopped, below = bool(np.isfinite([lower, upper]).any()), -band
        moved = np.empty((len(told) + 1, self.stretches[0].measured.shape[1], *told.shape[1:]))
        q, v = (np.broadcast_to(state, told.shape[1:]).copy() for state in self.begun)
        followed, off, force, held = q.copy(), *np.empty((3, *q.shape))
        # of one shape and in place: at each step these take most of the time of a fit
        stiffness, servo, joint, least, most, negative, friction = (
            np.broadcast_to(of, q.shape).copy() for of in (stiffness, servo, joint, least, most, -friction, friction)
        )
        moved[0, 0] = q
        for row, asked in enumerate(told):
            if (within := row % _STEPS) == 0:
                inertia = bodies[row : row + _STEPS] + armature
                firm = 1 / (1 + soft * inertia)
                speed_held, gained = back * inertia * firm, step / (inertia + step * damping)
            if lags:
                followed += share * (asked - followed)
                asked = followed
            np.subtract(asked, q, out=off)
            if banded:
                off -= np.minimum(np.maximum(off, below), band)
            np.multiply(stiffness, off, out=force)
            force -= np.multiply(servo, v, out=held)
            force += fed[row]
            np.maximum(force, least, out=force)
            np.minimum(force, most, out=force)
            moved[row, 1:] = force
            force -= np.multiply(joint, v, out=held)
            force -= load[row]
            if sprung:
                force -= spring * (q - rest)
            np.multiply(speed_held[within], v, out=held)
            held += np.multiply(force, firm[within], out=off)
            np.maximum(held, negative, out=held)
            force -= np.minimum(held, friction, out=held)
            force *= gained[within]
            v += force
            np.multiply(v, step, out=off)
            if stopped:
                before = q.copy()
                q += off
                np.minimum(np.maximum(q, lower, out=q), upper, out=q)
                v = (q - before) / step
            else:
                q += off
            moved[row + 1, 0] = q
        moved[-1, 1:] = moved[-2, 1:]
        return moved

    def _load(self, of_robot: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return torque and inertia (steps, v, p, n) of the bodies with what all joints share (k, v, 1, n)."""
        mass, *off = of_robot
        changes = np.array([mass, *(mass * np.array(off[:3])), *off[3:]])[:, :, 0]
        if (changes == changes[:, :1]).all():  # of most sets bodies are alike
            changes = changes[:, :1]
        load, bodies = (
            of[0, :, None] + np.einsum("kvn,kspn->svpn", changes, of[1:]) for of in (self.load, self.inertia)
        )
        return load, bodies

    def _stops(self) -> np.ndarray:
        """Return where joints stop, (2, n): at the model's ranges, or as far beyond as the robot was."""
        compiled, dof = self.servos.model.compiled, self.servos.model.speeds
        joints = compiled.dof_jntid[dof]
        q = np.concatenate([stretch.q for stretch in self.stretches])
        lower, upper = np.where(compiled.jnt_limited[joints] == 1, compiled.jnt_range[joints].T, [[-np.inf], [np.inf]])
        return np.array([np.minimum(lower, q.min(axis=0)), np.maximum(upper, q.max(axis=0))])


def _dry(servos: Servos, numbers: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Return how softly dry friction holds, 1/(kg m^2), and how fast it brings a joint to rest, 1/s."""
    compiled, dof = servos.model.compiled, servos.model.speeds
    holding, armature = numbers[NAMES.index("holding")], numbers[NAMES.index("armature")]
    lets_go = holding != servos.numbers[NAMES.index("holding")]
    firm = np.where(lets_go, holding, compiled.dof_solimp[dof, 1])
    back = 2 / (firm * np.maximum(compiled.dof_solref[dof, 0], 2 * step))
    return (1 - holding) / holding / (servos.model.free + armature), back


def alone(servos: Servos, stretches: Sequence[PlayedStretch], step: float) -> Alone:
    """Return stretches of runs as each joint by itself is played over them."""
    steps = int(np.ceil(max(stretch.time[-1] for stretch in stretches) / step)) + 1
    shape = (1 + len(OF_ROBOT), steps, len(stretches), len(servos.model.joints))
    load, inertia = np.empty(shape), np.empty(shape)
    own, flange = servos.model.compiled, servos.model.flange
    models = [own, *(loaded(own, flange, 1.0, _ASIDE * off) for off in np.vstack([np.zeros(3), np.eye(3)]))]
    for angles in _ASIDE * np.eye(2):
        models.append(copy.copy(own))
        models[-1].opt.gravity = tilted(own, angles)
    for place, stretch in track(enumerate(stretches), "load of the bodies in each stretch"):
        motion = smoothed(stretch.q, interval(stretch.time), _SMOOTH)
        bodies = np.array([_bodies(servos, compiled, *motion) for compiled in models])
        bodies[2:5] = (bodies[2:5] - bodies[1]) / _ASIDE
        bodies[5:] = (bodies[5:] - bodies[0]) / _ASIDE
        bodies[1] -= bodies[0]
        bodies[0, 0] -= stretch.pushed(servos.model, stretch.time, step)
        between = scipy.interpolate.make_interp_spline(stretch.time, np.moveaxis(bodies, 2, 0), k=1)
        times = np.minimum(np.arange(steps) * step, stretch.time[-1])
        load[:, :, place], inertia[:, :, place] = np.moveaxis(between(times), 2, 0).swapaxes(1, 2)
    begun = np.array([stretch.state() for stretch in stretches]).swapaxes(0, 1)
    return Alone(servos, tuple(stretches), step, load, inertia, begun)


def _bodies(
    servos: Servos, compiled: mujoco.MjModel, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return at a motion's samples the torque (N, n) but of the joint's own acceleration, and the inertia (N, n)."""
    dof, at = servos.model.speeds, servos.model.positions
    bare = copy.copy(compiled)
    bare.dof_armature[dof] = bare.dof_damping[dof] = bare.dof_frictionloss[dof] = 0.0
    bare.jnt_stiffness[bare.dof_jntid[dof]] = 0.0
    bare.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    bare.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    data, full = mujoco.MjData(bare), np.zeros((bare.nv, bare.nv))
    torque, inertia = np.empty(q.shape), np.empty(q.shape)
    for row in range(len(q)):
        data.qpos[at], data.qvel[dof], data.qacc[dof] = q[row], dq[row], ddq[row]
        mujoco.mj_inverse(bare, data)
        mujoco.mj_fullM(bare, data, full)
        inertia[row] = np.diag(full)[dof]
        torque[row] = data.qfrc_inverse[dof] - inertia[row] * ddq[row]
    return torque, inertia


def _between(moved: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return values (N, c, n) at places (N,) between those of the steps."""
    before = np.clip(at.astype(int), 0, len(moved) - 2)
    share = np.clip(at - before, 0.0, 1.0)[:, None, None]
    return np.asarray(moved[before] * (1 - share) + moved[before + 1] * share)
