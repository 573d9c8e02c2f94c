"""Cases: the model of an arm with position servos, and logs of an arm that differs from it in ways that are known.

The arm is moved at 500 Hz by MuJoCo's equations, its servos by those written here, not by what is measured. Its log is
that of a controller: commands and positions at 100 Hz, with noise of encoders. Some controllers have a feedforward, the
torque that the robot as drawn takes for the motion that they plan (computed torque).
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from xml.etree import ElementTree

import mujoco
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from scipy.spatial.transform import Rotation

from closed_loop.machine import Machine, build
from closed_loop.models import SOURCES, read_model
from closed_loop.programmes import Programme, exciting, working

SEED, DEVELOPMENT, FED = 330_000_000, 770_000_000, 5_000_000
STEP, EVERY = 0.002, 5  # s; steps from one sample of the log to the next
SECONDS, RUNS, HELD_OUT = 8.0, 6, 2
NOISE = 3e-4  # rad
ARMS = tuple(SOURCES)
KINDS = (
    "armature", "damping", "friction", "stiffness", "payload", "delay", "backlash", "torque_limit", "offset",
    "spring", "elasticity", "contact",
)  # fmt: skip
TORQUE_NOISE = 0.01  # of the standard deviation of a joint's torque
RAMP = 0.1  # s
DAMPED = 0.02  # of critical damping, in an elastic joint
NULLS, PAIRS = 1 / 8, 1 / 4  # shares of the cases


@dataclass(frozen=True)
class Difference:
    """A number that the arm has another of; a payload, kg, and a tilt of the base, rad, are the whole robot's."""

    kind: str
    joint: int | None
    simulator: float
    robot: float


@dataclass(frozen=True)
class Arm:
    """Numbers of an arm with servos, each (n,); payload in kg."""

    stiffness: np.ndarray
    damping: np.ndarray
    servo_damping: np.ndarray
    friction: np.ndarray
    armature: np.ndarray
    torque_limit: np.ndarray
    offset: np.ndarray
    delay: np.ndarray
    backlash: np.ndarray  # rad to either side
    spring: np.ndarray  # N m/rad
    elasticity: np.ndarray  # rad/(N m), between a motor and its link
    payload: float = 0.0
    tilt: float = 0.0  # rad about the world's x axis
    contact: float = 0.0  # N at the flange, during a push
    on_links: bool = False  # whether the log has positions of links in place of motors'

    def with_(self, differences: tuple[Difference, ...]) -> Arm:
        """Return the arm with other numbers."""
        found = {name: np.copy(value) for name, value in vars(self).items()}
        for one in differences:
            if one.joint is None:
                found[one.kind] = one.robot
            else:
                found[one.kind][one.joint] = one.robot
        return Arm(**{**found, **{name: float(found[name]) for name in ("payload", "tilt", "contact")}})


@dataclass(frozen=True)
class Push:
    """A force at the flange along `direction` (3,), of the world, from `start` to `stop`, s, that comes in RAMP s."""

    direction: np.ndarray
    start: float
    stop: float

    def share(self, time: float) -> float:
        """Return how much of it acts at a time, 0 to 1."""
        return float(np.clip(min(time - self.start, self.stop - time) / RAMP, 0.0, 1.0))


@dataclass(frozen=True)
class Case:
    """A case before it is made."""

    name: str
    arm: str
    seed: int
    count: int  # of differences
    torque: bool  # whether it is logged
    kinds: tuple[str, ...] = ()  # of these; none: of any
    fed: bool = False  # whether its controller has a feedforward


def plans(count: int, torque: bool, split: int = 0, *, fed: bool = False) -> Iterator[Case]:
    """Yield cases in an order that tells nothing: nulls, pairs, and else one difference."""
    seed = SEED + 1_000_000 * torque + FED * fed + 10_000_000 * split
    rng = np.random.default_rng(seed)
    nulls, pairs = round(NULLS * count), round(PAIRS * count)
    counts = rng.permutation([0] * nulls + [2] * pairs + [1] * (count - nulls - pairs))
    for number, of in enumerate(counts):
        yield Case(f"case_{number:03d}", ARMS[int(rng.integers(len(ARMS)))], seed + number, int(of), torque, fed=fed)


def of_kinds(kinds: tuple[str, ...], count: int, torque: bool, *, fed: bool = False) -> Iterator[Case]:
    """Yield development cases that differ in these kinds, arm after arm."""
    for number in range(count):
        arm = ARMS[number % len(ARMS)]
        yield Case(f"case_{number:03d}", arm, DEVELOPMENT + number, len(kinds), torque, kinds, fed)


def make(case: Case, models: Path, folder: Path) -> list[Difference]:
    """Write the model, the data set and apart the runs that are held out; return the label."""
    rng = np.random.default_rng([case.seed, 7])
    machine = build(read_model(models, case.arm), case.seed)
    own = _drawn(machine, rng)
    every = (*KINDS, "tilt") if case.torque else KINDS
    kinds = rng.choice(case.kinds or every, case.count, replace=False)
    differences = tuple(_difference(str(kind), own, _links(machine), rng) for kind in kinds)
    if case.torque:
        differences = tuple(_reached(one, machine, own, rng) for one in differences)
    text, robot = _mjcf(machine, own), own.with_(differences)
    pushed = rng.permutation(RUNS - HELD_OUT)[: rng.integers(1, 3)]
    start, lasts, direction = rng.uniform(1.0, 5.0), rng.uniform(1.0, 2.5), rng.standard_normal(3)
    robot = replace(robot, on_links=bool(rng.random() < 0.5))
    push = Push(direction / np.linalg.norm(direction), start, start + lasts)
    for part in ("data", "held_out"):
        (folder / case.name / part / "runs").mkdir(parents=True)
        (folder / case.name / part / "robot.urdf").write_text(machine.urdf, encoding="utf-8")
        (folder / case.name / part / "dataset.toml").write_text(
            _described(machine, part == "data", case.fed), encoding="utf-8"
        )
    (folder / case.name / "model.xml").write_text(text, encoding="utf-8")
    model = mujoco.MjModel.from_xml_string(_mjcf(machine, robot))
    if robot.elasticity.any():
        _keep_friction(model, mujoco.MjModel.from_xml_string(text))
    model.opt.gravity = Rotation.from_rotvec([robot.tilt, 0, 0]).apply(model.opt.gravity)
    for run in range(RUNS):
        programme = (exciting if run % 2 else working)(machine, SECONDS, rng)
        every = round(STEP * EVERY / machine.step)
        told = programme.q[::every]
        added = _planned(machine, programme.every(every)) if case.fed else None
        q, torque = simulate(model, robot, told, push if run in pushed else None, added)
        part = "data" if run < RUNS - HELD_OUT else "held_out"
        columns = {"time": np.arange(len(told)) * STEP * EVERY}
        for k, name in enumerate(machine.model.joints):
            columns[f"q_{name}"] = q[:, k] + NOISE * rng.standard_normal(len(q))
            columns[f"cmd_{name}"] = told[:, k].copy()
            if case.torque:
                noise = TORQUE_NOISE * torque[:, k].std() * rng.standard_normal(len(q))
                columns[f"tau_{name}"] = torque[:, k] + noise
        pq.write_table(pa.table(columns), folder / case.name / part / "runs" / f"run_{run}.parquet")
    return list(differences)


def simulate(
    model: mujoco.MjModel, arm: Arm, told: np.ndarray, push: Push | None = None, added: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Return positions and servos' torques (N, n) of an arm that is told commands (N, n), each until the next.

    With each comes the torque `added` (N, n) of a feedforward.
    """
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ACTUATION  # its servos are those below
    data, motors = mujoco.MjData(model), np.array([model.joint(k).name[-1] != "'" for k in range(model.njnt)])
    data.qpos[motors] = told[0]
    late = np.round(arm.delay / STEP).astype(int)
    found, torques, columns = np.empty_like(told), np.empty_like(told), np.arange(told.shape[1])
    flange, applied = model.body("load").id, np.zeros(model.nv)
    settling, links = round(1.0 / STEP), np.flatnonzero(~motors)  # the log begins when the robot stands
    for row in range(-settling, len(told) * EVERY):
        if row >= 0 and row % EVERY == 0:
            found[row // EVERY] = data.qpos[motors]
            if arm.on_links:  # a joint of two is before its spring
                found[row // EVERY, (np.cumsum(motors) - 1)[links]] += data.qpos[links]
        command = told[np.maximum(row - late, 0) // EVERY, columns] + arm.offset
        off = command - data.qpos[motors]
        off = np.sign(off) * np.maximum(np.abs(off) - arm.backlash, 0.0)
        torque = arm.stiffness * off - arm.servo_damping * data.qvel[motors]
        if added is not None:
            torque += added[np.maximum(row - late, 0) // EVERY, columns]
        applied[:] = 0.0
        applied[motors] = np.clip(torque, -arm.torque_limit, arm.torque_limit)
        if row >= 0 and row % EVERY == 0:
            torques[row // EVERY] = applied[motors]
        share = push.share(row * STEP) if push and arm.contact else 0.0
        if push and share:
            force = share * arm.contact * push.direction
            mujoco.mj_applyFT(model, data, force, np.zeros(3), data.xpos[flange], flange, applied)
        data.qfrc_applied[:] = applied
        mujoco.mj_step(model, data)
    return found, torques


def _planned(machine: Machine, programme: Programme) -> np.ndarray:
    """Return the torque (N, n) that bodies of the robot's URDF and its rotors take for a programme."""
    drawn = mujoco.MjModel.from_xml_string(machine.urdf)
    drawn.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    drawn.dof_damping[:] = drawn.dof_frictionloss[:] = drawn.dof_armature[:] = 0.0
    data, torque = mujoco.MjData(drawn), np.empty_like(programme.q)
    dofs = [int(drawn.joint(name).dofadr[0]) for name in machine.model.joints]
    for row, (q, dq, ddq) in enumerate(zip(programme.q, programme.dq, programme.ddq, strict=True)):
        data.qpos[dofs], data.qvel[dofs], data.qacc[dofs] = q, dq, ddq
        mujoco.mj_inverse(drawn, data)
        torque[row] = data.qfrc_inverse[dofs]
    return np.asarray(torque + machine.real.dof_armature * programme.ddq)


def labels(found: dict[str, tuple[Case, list[Difference]]], joints: dict[str, tuple[str, ...]]) -> str:
    """Return the labels of cases as JSON."""
    told = {
        name: {
            "arm": case.arm,
            "differences": [
                asdict(one) | {"joint": None if one.joint is None else joints[name][one.joint]} for one in some
            ],
        }
        for name, (case, some) in found.items()
    }
    return json.dumps(told, indent=1, sort_keys=True) + "\n"


def _drawn(machine: Machine, rng: np.random.Generator) -> Arm:
    torque, n = machine.model.torque, len(machine.model.joints)
    armature = machine.real.dof_armature.copy()
    inertia = machine.inertia
    stiffness = inertia * (2 * np.pi * rng.uniform(2.0, 4.0, n)) ** 2 + torque * rng.uniform(4.0, 8.0, n)
    return Arm(
        stiffness=stiffness,
        damping=machine.real.dof_damping.copy(),
        servo_damping=2 * rng.uniform(0.5, 0.9, n) * np.sqrt(stiffness * inertia),
        friction=machine.real.dof_frictionloss.copy(),
        armature=armature,
        torque_limit=1.5 * torque,
        offset=np.zeros(n),
        delay=np.zeros(n),
        backlash=np.zeros(n),
        spring=np.zeros(n),
        elasticity=np.zeros(n),
    )


def _difference(kind: str, own: Arm, links: np.ndarray, rng: np.random.Generator) -> Difference:
    if kind == "tilt":
        return Difference(kind, None, 0.0, float(rng.choice([-1.0, 1.0]) * rng.uniform(0.01, 0.05)))
    joint = int(rng.integers(len(own.stiffness)))
    if kind == "contact":
        return Difference(kind, None, 0.0, float(own.torque_limit[1] * rng.uniform(0.05, 0.2)))
    if kind == "payload":
        return Difference(kind, None, 0.0, float(own.torque_limit[1] * rng.uniform(0.01, 0.03)))
    before = float(getattr(own, kind)[joint])
    sign = float(rng.choice([-1.0, 1.0]))
    after = {
        "armature": before * rng.uniform(2.0, 4.0),
        "damping": before * rng.uniform(3.0, 8.0),
        "friction": before * rng.choice([0.3, 2.0, 3.0]),
        "stiffness": before * rng.choice([0.6, 0.75, 1.4, 1.7]),
        "delay": float(rng.choice([0.01, 0.02, 0.04])),
        "backlash": rng.uniform(0.003, 0.015),
        "torque_limit": before * rng.uniform(0.15, 0.3),
        "offset": sign * rng.uniform(0.005, 0.03),
        "spring": own.stiffness[joint] * rng.uniform(0.05, 0.3),
        "elasticity": 1 / (links[joint] * (2 * np.pi * rng.uniform(4.0, 12.0)) ** 2),
    }[kind]
    return Difference(kind, joint, before, float(after))


def _reached(difference: Difference, machine: Machine, own: Arm, rng: np.random.Generator) -> Difference:
    """Return a difference that motions show: a limit of torque below what the servo gives without it."""
    if difference.kind != "torque_limit":
        return difference
    every = round(STEP * EVERY / machine.step)
    told = exciting(machine, SECONDS, np.random.default_rng(rng.integers(1 << 32))).q[::every]
    given = np.abs(simulate(mujoco.MjModel.from_xml_string(_mjcf(machine, own)), own, told)[1]).max(axis=0)
    return replace(difference, robot=float(given[difference.joint] * rng.uniform(0.5, 0.8)))


def _mjcf(machine: Machine, arm: Arm) -> str:
    """Return the arm's model with its numbers and position servos."""
    root = ElementTree.fromstring(machine.model.spec)
    ElementTree.SubElement(root, "option", timestep=str(STEP))
    actuator = ElementTree.SubElement(root, "actuator")
    own = {str(joint.get("name")): joint for joint in root.iter("joint") if joint.get("name")}
    for k, name in enumerate(machine.model.joints):
        own[name].attrib |= {
            "armature": repr(float(arm.armature[k])),
            "damping": repr(float(arm.damping[k])),
            "frictionloss": repr(float(arm.friction[k])),
            "stiffness": repr(float(arm.spring[k])),
        }
        limit = float(arm.torque_limit[k])
        ElementTree.SubElement(
            actuator, "position", name=name, joint=name, kp=repr(float(arm.stiffness[k])),
            kv=repr(float(arm.servo_damping[k])), forcerange=f"{-limit!r} {limit!r}",
        )  # fmt: skip
    for k in np.flatnonzero(arm.elasticity):
        _soften(root, own[machine.model.joints[k]], arm.elasticity[k], _links(machine)[k])
    if arm.payload:
        load = next(body for body in root.iter("body") if body.get("name") == "load")
        inertial = load.find("inertial")
        assert inertial is not None
        inertial.attrib |= {"mass": repr(arm.payload), "diaginertia": " ".join([repr(arm.payload * 2e-3)] * 3)}
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _links(machine: Machine) -> np.ndarray:
    """Return the inertia that each joint moves beyond its rotor (n,), kg m^2, the mean over poses."""
    model, found = machine.real, []
    data, full = mujoco.MjData(model), np.zeros((model.nv, model.nv))
    for pose in np.random.default_rng(0).uniform(machine.model.lower, machine.model.upper, (64, model.nv)):
        data.qpos[:] = pose
        mujoco.mj_forward(model, data)
        mujoco.mj_fullM(model, data, full)
        found.append(full.diagonal() - model.dof_armature)
    return np.asarray(np.mean(found, axis=0))


def _soften(root: ElementTree.Element, joint: ElementTree.Element, elasticity: float, inertia: float) -> None:
    """Put a spring behind a joint's motor."""
    body = next(one for one in root.iter("body") if joint in list(one))
    name, stiffness = str(joint.get("name")), float(1 / elasticity)
    behind = {
        "name": name + "'", "stiffness": repr(stiffness),
        "damping": repr(float(2 * DAMPED * np.sqrt(stiffness * inertia))),
        "armature": "0", "frictionloss": "0", "limited": "false",
    }  # fmt: skip
    kept = {key: value for key, value in joint.attrib.items() if key in {"type", "axis", "pos"}}
    body.insert(list(body).index(joint) + 1, ElementTree.Element("joint", kept | behind))


def _keep_friction(model: mujoco.MjModel, rigid: mujoco.MjModel) -> None:
    """Give dry friction the law that it has without elasticity: MuJoCo's is as soft as what it holds is light."""
    for k in range(rigid.njnt):
        dof = int(model.joint(rigid.joint(k).name).dofadr[0])
        before = rigid.dof_solimp[k, :2]
        odds = before / (1 - before) * model.dof_invweight0[dof] / rigid.dof_invweight0[k]
        model.dof_solimp[dof, :2] = odds / (1 + odds)


def _described(machine: Machine, fitted: bool, fed: bool) -> str:
    runs = range(RUNS - HELD_OUT) if fitted else range(RUNS - HELD_OUT, RUNS)
    lines = ["[robot]", f'name = "{machine.model.name}"', 'urdf = "robot.urdf"', "simulated = true"]
    lines += ['feedforward = "dynamics"'] if fed else []
    lines += [f'\n[[run]]\nfile = "runs/run_{run}.parquet"' for run in runs]
    if fed:
        rotors = zip(machine.model.joints, machine.real.dof_armature.tolist(), strict=True)
        lines += [f"\n[robot.joint.{name}]\nrotor_inertia = {inertia!r}" for name, inertia in rotors]
    return "\n".join(lines) + "\n"
