"""`python written_models.py TWIN.json...`: torque of a twin's written URDF, MJCF and SDF by others' engines.

Greatest difference from the twin's own terms that a format holds, N m, over random states. Engines that are not
installed are left out: `pip install drake pybullet`.
"""

from __future__ import annotations

import sys
import tempfile
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pinocchio as pin

from irtwin.robot.structure import structure_of
from irtwin.robot.urdf import parse_urdf
from irtwin.robot.urdf_text import with_numbers
from irtwin.signals.motion import Motion
from irtwin.twin.described import text_of
from irtwin.twin.files import load
from irtwin.twin.twin import Twin

STATES = 200
Inverse = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]


def known(twin: Twin, motion: Motion, names: tuple[str, ...]) -> np.ndarray:
    """Return the twin's torque (N, n) by effects; dry friction turns at once."""
    found = np.zeros(motion.q.shape)
    for effect in twin.stack.effects:
        values = np.array([twin.value(effect.id, term) for term in effect.terms(twin.robot)])
        if effect.id == "coulomb_friction" and effect.id in names:
            acting = [twin.robot.index(joint.name) for joint in effect.acting(twin.robot)]
            found[:, acting] += values * np.sign(motion.dq[:, acting])
        elif effect.id in names:
            found += effect.columns(twin.robot, motion) @ values
    return found


def by_pinocchio(file: Path, joints: tuple[str, ...]) -> Inverse:
    model = parse_urdf(file.read_text()).model
    data = model.createData()
    damping, friction = _dynamics(file, joints)

    def torque(q: np.ndarray, dq: np.ndarray, ddq: np.ndarray) -> np.ndarray:
        return pin.rnea(model, data, q, dq, ddq) + damping * dq + friction * np.sign(dq)

    return torque


def by_pybullet(file: Path, joints: tuple[str, ...]) -> Inverse:
    import pybullet as bullet

    robot = parse_urdf(file.read_text())
    bare = [one.name for one in structure_of(robot).bodies if one.mass is None]  # PyBullet would take each as 1 kg
    file.write_text(with_numbers(robot.urdf, dict.fromkeys(bare, pin.Inertia.Zero()), {}))
    bullet.connect(bullet.DIRECT)
    bullet.setGravity(0, 0, -9.81)
    body = bullet.loadURDF(str(file), useFixedBase=True, flags=bullet.URDF_USE_INERTIA_FROM_FILE)
    damping, friction = _dynamics(file, joints)
    for joint in range(-1, bullet.getNumJoints(body)):
        bullet.changeDynamics(body, joint, linearDamping=0, angularDamping=0, jointDamping=0)

    def torque(q: np.ndarray, dq: np.ndarray, ddq: np.ndarray) -> np.ndarray:
        rigid = bullet.calculateInverseDynamics(body, q.tolist(), dq.tolist(), ddq.tolist())
        return np.array(rigid) + damping * dq + friction * np.sign(dq)

    return torque


def by_drake(file: Path, joints: tuple[str, ...]) -> Inverse:
    """Drake reads damping; dry friction is none of its."""
    import logging

    logging.getLogger("drake").setLevel(logging.ERROR)
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import MultibodyPlant
    from pydrake.multibody.tree import MultibodyForces

    plant = MultibodyPlant(0.0)
    (instance,) = Parser(plant).AddModels(str(file))
    if file.suffix == ".urdf":
        base = parse_urdf(file.read_text()).links[0].name
        plant.WeldFrames(plant.world_frame(), plant.GetFrameByName(base, instance))
    plant.Finalize()
    context = plant.CreateDefaultContext()
    places = [plant.GetJointByName(name).velocity_start() for name in joints]
    _, friction = _dynamics(file, joints)

    def torque(q: np.ndarray, dq: np.ndarray, ddq: np.ndarray) -> np.ndarray:
        position, speed, acceleration = np.zeros((3, plant.num_velocities()))
        position[places], speed[places], acceleration[places] = q, dq, ddq
        plant.SetPositions(context, position)
        plant.SetVelocities(context, speed)
        forces = MultibodyForces(plant)
        plant.CalcForceElementsContribution(context, forces)  # gravity, damping
        return plant.CalcInverseDynamics(context, acceleration, forces)[places] + friction * np.sign(dq)

    return torque


def by_irtwin(file: Path, joints: tuple[str, ...]) -> Inverse:
    """The model as `--simulator` reads it."""
    from irtwin.simulator.model import read_model

    model = read_model(file, parse_urdf(file.with_suffix(".urdf").read_text()))
    return lambda q, dq, ddq: model.torque(q[None], dq[None], ddq[None])[0]


def by_mujoco(file: Path, joints: tuple[str, ...]) -> Inverse:
    import mujoco

    model = mujoco.MjModel.from_xml_path(str(file))
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    data = mujoco.MjData(model)
    places = [model.joint(name).dofadr[0] for name in joints]

    def torque(q: np.ndarray, dq: np.ndarray, ddq: np.ndarray) -> np.ndarray:
        data.qpos[places], data.qvel[places], data.qacc[places] = q, dq, ddq
        mujoco.mj_inverse(model, data)
        return (data.qfrc_inverse + model.dof_frictionloss * np.sign(data.qvel))[places]

    return torque


def _dynamics(file: Path, joints: tuple[str, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Return damping and friction of the joints as the file has them."""
    from xml.etree import ElementTree

    root = ElementTree.parse(file).getroot()
    found = np.zeros((2, len(joints)))
    for joint in root.iter("joint"):
        said = joint.find("dynamics") if file.suffix == ".urdf" else joint.find("axis/dynamics")
        if said is not None and joint.get("name") in joints:
            texts = [said.get(key, said.findtext(key)) for key in ("damping", "friction")]
            found[:, joints.index(joint.get("name"))] = [float(text or 0) for text in texts]
    return found[0], found[1]


ENGINES: dict[str, tuple[str, Callable[[Path, tuple[str, ...]], Inverse]]] = {
    "URDF, Pinocchio": ("urdf", by_pinocchio),
    "URDF, PyBullet": ("urdf", by_pybullet),
    "URDF, Drake": ("urdf", by_drake),
    "SDF, Drake": ("sdf", by_drake),
    "MJCF, MuJoCo": ("mjcf", by_mujoco),
    "SDF, MuJoCo by irtwin": ("sdf", by_irtwin),
    "USD, MuJoCo by irtwin": ("usd", by_irtwin),
}
HELD = ("rigid_body", "coulomb_friction", "viscous_friction")


def main() -> None:
    warnings.simplefilter("ignore")
    print("| twin | engine | greatest difference, N m | of a greatest torque of |\n| --- | --- | --- | --- |")
    for file in map(Path, sys.argv[1:]):
        twin = load(file)
        lower = np.array([max(joint.lower, -3.0) for joint in twin.robot.joints])
        upper = np.array([min(joint.upper, 3.0) for joint in twin.robot.joints])
        rng = np.random.default_rng(0)
        q = rng.uniform(lower, upper, (STATES, len(lower)))
        dq, ddq = rng.uniform(-2, 2, (STATES, len(lower))), rng.uniform(-10, 10, (STATES, len(lower)))
        states = Motion(np.arange(float(STATES)), q, dq, ddq, run="random")
        with tempfile.TemporaryDirectory() as folder:
            for name, (form, engine) in ENGINES.items():
                place = Path(folder) / f"robot.{form if form != 'mjcf' else 'xml'}"
                place.write_text(text_of(twin, form))
                try:
                    inverse = engine(place, twin.robot.joint_names)
                except ModuleNotFoundError as error:
                    print(f"# {name}: {error}")
                    continue
                wanted = known(twin, states, (*HELD, "rotor_inertia") if form in ("mjcf", "usd") else HELD)
                found = np.array([inverse(*state) for state in zip(q, dq, ddq, strict=True)])
                print(
                    f"| {twin.robot.name} | {name} | {np.abs(found - wanted).max():.1e} | {np.abs(wanted).max():.0f} |"
                )


if __name__ == "__main__":
    main()
