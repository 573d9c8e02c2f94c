"""A model with what its file does not say, to be played: dead bands of servos, feedforward, and soft joints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from irtwin.simulator.engine import mujoco
from irtwin.simulator.model import Model, compiled_of

DAMPED = 0.05  # of critical damping, in what is soft
_SECOND, _FED, _BEHIND = " beside its servo", " by its feedforward", " behind its motor"
_FIRMEST = 0.9999  # impedance that MuJoCo takes


@dataclass(frozen=True)
class PlayedModel:
    """A model with what plays dead bands and soft joints, and where it has the robot's joints, (n,) each.

    `second`: actuators beside the servos, idle, told their commands; none where no dead band is played. `fed`: those of
    the controller's feedforward, told their torque; none where there is none. `soft`: places among the robot's joints
    of those with a second joint behind the motor's, with the same axis; `behind`: its dof. `of`: the model as it is.
    """

    of: Model
    compiled: mujoco.MjModel
    joints: np.ndarray
    second: np.ndarray
    fed: np.ndarray
    soft: np.ndarray
    behind: np.ndarray

    @property
    def positions(self) -> np.ndarray:
        """The motors' places in qpos (n,)."""
        return np.asarray(self.compiled.jnt_qposadr[self.joints])

    @property
    def speeds(self) -> np.ndarray:
        """The motors' places in qvel (n,)."""
        return np.asarray(self.compiled.jnt_dofadr[self.joints])

    @property
    def links(self) -> np.ndarray:
        """The places in qpos of joints behind motors."""
        return np.asarray(self.compiled.jnt_qposadr[self.compiled.dof_jntid[self.behind]])

    def measured(self, qpos: np.ndarray, on_links: np.ndarray) -> np.ndarray:
        """Return the positions (N, n) that are measured of all (N, nq): of links where `on_links` (n,) says so."""
        q = qpos[:, self.positions]
        q[:, self.soft] += qpos[:, self.links] * on_links[self.soft]
        return q

    def soften(self, compiled: mujoco.MjModel, compliance: np.ndarray) -> None:
        """Give the joints behind motors the springs of compliances (n,), rad/(N m).

        Dry friction keeps its law: MuJoCo's softens by the inertia at hand, and that is the rotor's alone now.
        """
        dof = self.speeds[self.soft]
        rotor, link = compiled.dof_armature[dof], self.of.links[self.soft]
        stiffness = 1 / compliance[self.soft]
        compiled.jnt_stiffness[compiled.dof_jntid[self.behind]] = stiffness
        compiled.dof_damping[self.behind] = 2 * DAMPED * np.sqrt(stiffness * link)
        before = compiled.dof_solimp[dof, 0]
        odds = before / (1 - before) * (self.of.free[self.soft] + rotor) / rotor
        ends = np.minimum(np.stack([odds, odds]) / (1 + np.stack([odds, odds])), _FIRMEST)
        compiled.dof_solref[dof, 0] *= compiled.dof_solimp[dof, 1] / ends[1]
        compiled.dof_solimp[dof, :2] = ends.T


def variant(model: Model, banded: bool, soft: Sequence[str]) -> PlayedModel:
    """Return a model with second actuators where dead bands are played, and with joints soft behind their motors.

    With those of a feedforward, too, where the robot's controller has one.
    """

    def add(spec: mujoco.MjSpec) -> None:
        for joint in model.joints if banded else ():
            _add_second(spec, joint)
        for joint in model.joints if model.robot.feedforward else ():
            _add_fed(spec, joint)
        for joint in soft:
            _add_behind(spec, joint)

    compiled, *_ = compiled_of(model.file, model.gains, add)
    second = [compiled.actuator(f"{joint}{_SECOND}").id for joint in model.joints] if banded else []
    fed = [compiled.actuator(f"{joint}{_FED}").id for joint in model.joints] if model.robot.feedforward else []
    behind = [int(compiled.joint(f"{joint}{_BEHIND}").dofadr[0]) for joint in soft]
    joints = [compiled.joint(joint).id for joint in model.joints]
    places = [model.joints.index(joint) for joint in soft]
    at = (np.array(indices, dtype=int) for indices in (joints, second, fed, places, behind))
    return PlayedModel(model, compiled, *at)


def _add_second(spec: mujoco.MjSpec, joint: str) -> None:
    """Put an actuator beside a joint's servo, of a force that numbers are to say."""
    first = next(actuator for actuator in spec.actuators if actuator.target == joint)
    second = spec.add_actuator(name=f"{joint}{_SECOND}", target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    second.gaintype, second.biastype = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_AFFINE
    second.gear, second.ctrllimited, second.ctrlrange = first.gear, first.ctrllimited, first.ctrlrange
    second.forcelimited, second.forcerange = True, (-1.0, 1.0)


def _add_fed(spec: mujoco.MjSpec, joint: str) -> None:
    """Put a motor beside a joint's servo, of the torque that it is told, whatever the file's actuators default to."""
    fed = spec.add_actuator(name=f"{joint}{_FED}", target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    fed.set_to_motor()
    fed.gear, fed.ctrllimited, fed.forcelimited = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0), False, False


def _add_behind(spec: mujoco.MjSpec, joint: str) -> None:
    """Put a joint behind a motor's, about the same axis: the link turns by both, the motor by the first alone."""
    first = spec.joint(joint)
    second = first.parent.add_joint(name=f"{joint}{_BEHIND}", type=first.type, pos=first.pos, axis=first.axis)
    second.limited, second.actfrclimited = False, False
    second.armature = second.frictionloss = second.ref = second.springref = 0.0
    second.stiffness[:], second.damping[:] = 0.0, 0.0
    for key in list(spec.keys):  # of as many coordinates as there were
        spec.delete(key)
