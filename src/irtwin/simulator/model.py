"""A robot's model in MuJoCo: the torque that it takes for a motion, and the numbers of its joints."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from irtwin.document.document import CauseParameter
from irtwin.errors import InputError
from irtwin.identification.cutoff import cutoff_for
from irtwin.input_file import checksum
from irtwin.robot.description import Robot
from irtwin.signals.channels import Signals
from irtwin.signals.conditioning import condition_for_fit
from irtwin.signals.log import DataSet, Run
from irtwin.simulator.assembly import add_servo
from irtwin.simulator.axes import alike, first_unlike
from irtwin.simulator.bodies import BodiesBeside
from irtwin.simulator.engine import mujoco
from irtwin.simulator.formats import read_model_file
from irtwin.simulator.model_file import ModelFile
from irtwin.twin.twin import Twin

_SWING = 2.0  # of an angle that a spring turns in a step, squared, at most: beyond 4 the integration diverges
_POSES = 64  # over whose inertia a mean is taken
_APART = 1e-3  # m, frames that are at one place
_HOLDS_NONE = 1e-9  # slope of an equality constraint over a joint that it does not hold
_SLIDES = 2  # of MuJoCo's kinds of joints, as 3 turns; the others have more coordinates than one
EFFORT = " as its actuators turn it"  # behind a joint's name: the sensor of that torque
NUMBERS = ("armature", "damping", "frictionloss")  # of a joint, kg m^2, N m s/rad, N m


Gains = Mapping[str, tuple[float, float]]  # of joints: N m/rad, N m s/rad


@dataclass(frozen=True)
class Flange:
    """Where a payload is held: a body and a place (3,) in its frame, m."""

    body: int
    place: np.ndarray


@dataclass(frozen=True)
class Model:
    """A compiled model of a robot, by the places of the joints' coordinates in the robot's order.

    `called`: what it calls each joint, by the robot's name of it.
    `others` are joints of the model that the robot lacks: a gripper's, a free body's. They stay where they begin.
    """

    file: ModelFile
    compiled: mujoco.MjModel
    called: Mapping[str, str]
    positions: np.ndarray  # (n,) in qpos
    speeds: np.ndarray  # (n,) in qvel
    others: tuple[str, ...]
    delays: np.ndarray  # (number of actuators,), s; the compiled model has none
    gears: np.ndarray  # (number of actuators,), of the file's; the compiled model's servos turn joints themselves
    gains: Gains  # of joints whose servos are not the file's
    robot: Robot

    @property
    def joints(self) -> tuple[str, ...]:
        """The joints' names in the model, in the robot's order."""
        return tuple(self.called.values())

    @property
    def name(self) -> str:
        """The file's name without its ending."""
        return self.file.path.stem

    @cached_property
    def free(self) -> np.ndarray:
        """The inertia that joints move beyond their rotors (n,), kg m^2, in the model's own pose, the others free."""
        compiled, dof = self.compiled, self.speeds
        return np.asarray(
            np.maximum(1 / np.maximum(compiled.dof_invweight0[dof], 1e-9) - compiled.dof_armature[dof], 1e-9)
        )

    @cached_property
    def links(self) -> np.ndarray:
        """The inertia that joints move beyond their rotors (n,), kg m^2, the others held: the mean over poses."""
        compiled, dof, at = self.compiled, self.speeds, self.positions
        joints, data, full = compiled.dof_jntid[dof], mujoco.MjData(compiled), np.zeros((compiled.nv, compiled.nv))
        limited = compiled.jnt_limited[joints] == 1
        ends = np.where(limited, compiled.jnt_range[joints].T, [[-np.pi], [np.pi]])
        inertias = []
        for pose in np.random.default_rng(0).uniform(ends[0], ends[1], (_POSES, len(at))):
            data.qpos[at] = pose
            mujoco.mj_forward(compiled, data)
            mujoco.mj_fullM(compiled, data, full)
            inertias.append(np.diag(full)[dof] - compiled.dof_armature[dof])
        return np.asarray(np.maximum(np.mean(inertias, axis=0), 1e-9))

    @cached_property
    def unfused(self) -> mujoco.MjModel:
        """The compiled model in which links that a URDF fixes to others are bodies of their own."""

        def apart(spec: mujoco.MjSpec) -> None:
            spec.compiler.fusestatic = False

        return compiled_of(self.file, {}, apart)[0] if self.file.is_urdf else self.compiled

    @cached_property
    def stiffest(self) -> np.ndarray:
        """The stiffness (n,), N m/rad, of a joint that swings as fast as it can be played; stiffer ones are rigid."""
        lightest = 1 / np.maximum(self.compiled.dof_armature[self.speeds], 1e-9) + 1 / np.minimum(self.free, self.links)
        return np.asarray(_SWING / self.compiled.opt.timestep**2 / lightest)

    @cached_property
    def flange(self) -> Flange:
        """The frame fixed to the last body that is farthest from its joint; its centre of mass where there is none."""
        compiled, data = self.compiled, mujoco.MjData(self.compiled)
        mujoco.mj_forward(compiled, data)
        joint = compiled.joint(self.joints[-1]).id
        body = int(compiled.jnt_bodyid[joint])
        fixed = np.flatnonzero(compiled.body_weldid == compiled.body_weldid[body])
        places = np.vstack([data.xpos[fixed], data.site_xpos[np.isin(compiled.site_bodyid, fixed)]])
        away = np.linalg.norm(places - data.xanchor[joint], axis=1)
        centre = compiled.body_ipos[body]
        own = data.xmat[body].reshape(3, 3).T @ (places[np.argmax(away)] - data.xpos[body])
        return Flange(body, own if away.max() > _APART else centre.copy())

    def flange_jacobian(self, q: np.ndarray) -> np.ndarray:
        """Return the Jacobian (N, 3, n) of the flange's place in the world at positions (N, n)."""
        data, jacobian = mujoco.MjData(self.compiled), np.empty((len(q), 3, q.shape[1]))
        whole = np.empty((3, self.compiled.nv))
        for row, position in enumerate(q):
            data.qpos[self.positions] = position
            mujoco.mj_kinematics(self.compiled, data)
            mujoco.mj_comPos(self.compiled, data)
            body = self.flange.body
            point = data.xpos[body] + data.xmat[body].reshape(3, 3) @ self.flange.place
            mujoco.mj_jac(self.compiled, data, whole, None, point, body)
            jacobian[row] = whole[:, self.speeds]
        return jacobian

    def torque(self, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray) -> np.ndarray:
        """Return the (N, n) torque, N m, that a motion (N, n) takes: bodies, armature, damping, springs, dry friction.

        By MuJoCo's inverse dynamics without contacts, limits and other constraints; dry friction has the sign of the
        speed, where MuJoCo's own turns over a small one.
        """
        still = copy.copy(self.compiled)
        still.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
        still.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
        data = mujoco.MjData(still)
        torque = np.empty(q.shape)
        for row, (position, speed, acceleration) in enumerate(zip(q, dq, ddq, strict=True)):
            data.qpos[self.positions], data.qvel[self.speeds] = position, speed
            data.qacc[self.speeds] = acceleration
            mujoco.mj_inverse(still, data)
            torque[row] = data.qfrc_inverse[self.speeds]
        return np.asarray(torque + self.compiled.dof_frictionloss[self.speeds] * np.sign(dq))

    @property
    def equalities(self) -> tuple[str, ...]:
        """The equality constraints that hold the robot's joints, by name or number: torque says nothing of them."""
        dense = copy.copy(self.compiled)
        dense.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
        data = mujoco.MjData(dense)
        data.qpos[self.positions] = np.random.default_rng(0).uniform(0.1, 0.5, len(self.positions))
        mujoco.mj_fwdPosition(dense, data)
        slopes = data.efc_J.reshape(-1, dense.nv)[:, self.speeds]
        equal = data.efc_type == int(mujoco.mjtConstraint.mjCNSTR_EQUALITY)
        (rows,) = np.nonzero(equal & (np.abs(slopes) > _HOLDS_NONE).any(axis=1))
        return tuple(dense.equality(own).name or f"number {own + 1}" for own in sorted({*data.efc_id[rows].tolist()}))

    def numbers(self, joint: str) -> Mapping[str, float]:
        """Return a joint of the robot's numbers as the model has them, by what MJCF calls them; those that it holds."""
        place = self.speeds[list(self.called).index(joint)]
        held = [name for name in NUMBERS if self.file.holds(name)]
        return {name: float(getattr(self.compiled, f"dof_{name}")[place]) for name in held}

    def bodies(self, twin: Twin) -> tuple[CauseParameter, ...]:
        """Return what a twin of the robot has otherwise of links and rotors, by so much that it matters."""
        return BodiesBeside(self, twin).told


def read_model(path: Path, robot: Robot, joints: Sequence[str] = ()) -> Model:
    """Read a model of the robot. A joint without a position servo has one by its controller's gains, if these are told.

    `joints`: what the model calls the robot's joints, in their order; none where it calls them as the robot does.
    Raises InputError where the file is no model, a mesh that gives a body its inertia is missing, or the robot's joints
    are not among the model's, lie or move otherwise, or have numbers that no joint has.
    """
    if joints and not len(joints) == len(set(joints)) == len(robot.joints):
        raise InputError(
            f"joints: {', '.join(joints)} are to be {len(robot.joints)} names, one for each of the robot's"
        )
    called = dict(zip(robot.joint_names, joints or robot.joint_names, strict=True))
    file = read_model_file(path)
    told = {called[joint.name]: (joint.kp, joint.kd or 0.0) for joint in robot.joints if joint.kp}
    compiled, delays, gears, gains = compiled_of(file, told)
    places, others = joints_of(compiled, tuple(called.values()), str(path), _offered(compiled, robot))
    model = Model(
        file, compiled, called, compiled.jnt_qposadr[places], compiled.jnt_dofadr[places], others, delays, gears, gains,
        robot,
    )  # fmt: skip
    _check_joints(model, robot)
    return model


def _check_joints(model: Model, robot: Robot) -> None:
    """Raise InputError where a joint moves otherwise than the robot's, or has a number that none can have."""
    for joint, name, dof in zip(robot.joints, model.joints, model.speeds, strict=True):
        if (model.compiled.jnt_type[model.compiled.dof_jntid[dof]] == _SLIDES) != (joint.unit == "m"):
            raise InputError(f"{model.file.path}: joint {name} slides where the robot's turns, or the other way round")
        for number in NUMBERS:
            value = float(getattr(model.compiled, f"dof_{number}")[dof])
            if not 0 <= value < np.inf:
                raise InputError(f"{model.file.path}: {number} of joint {name} is {value}; give zero or more")
    unlike = first_unlike(model.compiled, model.compiled.dof_jntid[model.speeds].tolist(), robot)
    if unlike is not None:
        raise InputError(
            f"{model.file.path}: joint {model.joints[unlike]} lies otherwise to those before it than the robot's, or "
            f"turns the other way, as in another robot or order: {_offered(model.compiled, robot)}"
        )


def _offered(compiled: mujoco.MjModel, robot: Robot) -> str:
    """Say which of a model's joints could be the robot's, by where they lie."""
    chains = alike(compiled, robot)
    if not chains:
        return "no joints of it lie as the robot's do; give a model of this robot"
    more = f", and so do {len(chains) - 1} others" if len(chains) > 1 else ""
    return f"say what it calls the robot's: --joints {','.join(chains[0])} lie as these do{more}"


def joints_of(
    compiled: mujoco.MjModel, names: Sequence[str], source: str, otherwise: str = ""
) -> tuple[list[int], tuple[str, ...]]:
    """Return the places of joints by name, and the names of others, or of what these move.

    Raises InputError where one is lacking, with what else can be done.
    """
    every = [compiled.joint(place) for place in range(compiled.njnt)]
    own = {joint.name: joint.id for joint in every if joint.type[0] >= _SLIDES}
    lacking = [name for name in names if name not in own]
    if lacking:
        raise InputError(
            f"{source}: has no joint {', '.join(lacking)}; its joints are {', '.join(own) or 'none'}: "
            + (otherwise or "give a model whose joints have the names of the robot's")
        )
    rest = tuple(joint.name or compiled.body(joint.bodyid[0]).name for joint in every if joint.name not in names)
    return [own[name] for name in names], rest


def compiled_of(
    file: ModelFile, gains: Gains, change: Callable[[mujoco.MjSpec], None] = lambda _: None
) -> tuple[mujoco.MjModel, np.ndarray, np.ndarray, Gains]:
    """Return the compiled model without delays and gears of its servos, these, and the gains that make servos of it.

    `change`: what is done to its specification, once it has those servos.
    """
    try:
        import mujoco
    except ModuleNotFoundError as error:
        raise InputError(f"{file.path}: reading a model needs MuJoCo; install irtwin[mujoco]") from error
    try:
        spec = file.spec()
        drop_pictures(spec, file.is_urdf)
        added = {joint: both for joint, both in gains.items() if add_servo(spec, joint, both)}
        delays = np.array([actuator.delay for actuator in spec.actuators], dtype=float)
        for actuator in spec.actuators:
            actuator.delay, actuator.nsample = 0.0, 0
        change(spec)
        for joint in spec.joints:
            if joint.name and joint.type in (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE):
                sensor = spec.add_sensor(name=f"{joint.name}{EFFORT}", type=mujoco.mjtSensor.mjSENS_JOINTACTFRC)
                sensor.objtype, sensor.objname = mujoco.mjtObj.mjOBJ_JOINT, joint.name
        compiled = spec.compile()
        return compiled, delays, take_out_gears(compiled), added
    except (ValueError, mujoco.FatalError) as error:
        raise InputError(f"{file.path}: {' '.join(str(error).split())}; MuJoCo cannot load it so") from error


def take_out_gears(compiled: mujoco.MjModel) -> np.ndarray:
    """Give servos of a compiled model the numbers with which they do at their joints what they do behind their gears.

    Return these gears (number of actuators,), 1 where there is no servo or no gear. A command is then the joint's.
    """
    servo = (compiled.actuator_trntype == int(mujoco.mjtTrn.mjTRN_JOINT)) & (
        compiled.actuator_biastype == int(mujoco.mjtBias.mjBIAS_AFFINE)
    )
    gears = np.where(servo & (compiled.actuator_gear[:, 0] != 0), compiled.actuator_gear[:, 0], 1.0)
    if (gears == 1).all():
        return np.asarray(gears)
    square = gears**2
    compiled.actuator_gear[:, 0] /= gears
    compiled.actuator_gainprm[:, 0] *= square
    compiled.actuator_biasprm[:, :3] *= np.column_stack([gears, square, square])
    compiled.actuator_armature[:] *= square
    compiled.actuator_damping[:] *= square
    compiled.actuator_dampingpoly[:] *= square[:, None]
    compiled.actuator_forcerange[:] = np.sort(compiled.actuator_forcerange * gears[:, None])
    for ends in (compiled.actuator_ctrlrange, compiled.actuator_actrange):
        ends[:] = np.sort(ends / gears[:, None])
    return np.asarray(gears)


def drop_pictures(spec: mujoco.MjSpec, is_urdf: bool) -> None:
    """Take out what a body with an inertia of its own needs for pictures and contacts alone: files may be missing.

    A URDF has all inertia in its <inertial>.
    """
    if spec.compiler.inertiafromgeom == mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE:
        return
    for body in spec.bodies if is_urdf else spec.bodies[1:]:
        if is_urdf or body.explicitinertial:
            for geom in list(body.geoms):
                if geom.type == mujoco.mjtGeom.mjGEOM_MESH:
                    spec.delete(geom)
    used = {geom.meshname for geom in spec.geoms}
    for mesh in [mesh for mesh in spec.meshes if mesh.name not in used]:
        spec.delete(mesh)
    for texture in list(spec.textures):
        spec.delete(texture)


def with_simulated_runs(data_set: DataSet, model: Model) -> DataSet:
    """Return the data set with a simulated run beside each observed one: its motion, and the torque of the model.

    A model carries no payload; what the robot carried is known, and the twin has it.
    Raises InputError where the data set has simulated runs, or no torque was measured, or in some runs alone.
    """
    if any(run.role == "simulated" for run in data_set.runs):
        raise InputError(f"{data_set.folder}: has simulated runs of its own; leave these out, or the simulator's model")
    observed = [run for run in data_set.runs if run.role == "observed"]
    if not any(run.signals.torque is not None for run in observed):
        raise InputError(
            f"{data_set.folder}: no run has torque to hold the simulator against; log tau_JOINT or i_JOINT"
        )
    if model.equalities:
        raise InputError(
            f"{model.file.path}: equality constraints hold the robot's joints ({', '.join(model.equalities)}), and "
            'what torque these take is not worked out; give them active="false", or log commands: they are played so'
        )
    for run in data_set.runs:
        if not run.says_effort:
            raise InputError(f"{run.file}: has commands and no torque, where other runs have torque; leave it out")
    cutoff = cutoff_for(data_set.robot, observed, data_set.cutoff)
    simulated = tuple(_simulated(run, data_set, model, cutoff.hz) for run in observed)
    return replace(data_set, runs=(*data_set.runs, *simulated))


def _simulated(run: Run, data_set: DataSet, model: Model, cutoff: float) -> Run:
    motion = condition_for_fit(run, data_set.robot, cutoff)
    torque = model.torque(motion.q, motion.dq, motion.ddq)
    return replace(
        run,
        name=f"{run.name} in {model.name}",
        file=model.file.path,
        sha256=checksum(model.file.path),
        role="simulated",
        payload_mass=0.0,
        payload_com=(0.0, 0.0, 0.0),
        repeat_of=None,
        performs=None,
        signals=Signals(motion.time, motion.q, dq=motion.dq, ddq=motion.ddq, torque=torque),
    )
