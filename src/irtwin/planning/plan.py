"""A planned motion: from where to where, around what, in what time, at what cost."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise, permutations

import numpy as np

from irtwin.effects.drive import RotorInertia
from irtwin.effects.rigid_body import RigidBody
from irtwin.effects.stack import Stack
from irtwin.errors import InputError
from irtwin.identification.progress import track
from irtwin.planning.energy_optimal import Movement, Power, cheapest, keeps
from irtwin.planning.order import best_order
from irtwin.planning.path import LONGEST_SEARCH, joint_path, line_path
from irtwin.planning.poses import Pose, joints_for
from irtwin.planning.programme import SectionedMotion
from irtwin.planning.timing import MotionLimits, Timed, Torque, fastest, rounded, through
from irtwin.robot.collision import CollisionModel, Obstacle
from irtwin.robot.description import Robot
from irtwin.signals.motion import Motion
from irtwin.twin.price import Figure, Price, price, saving
from irtwin.twin.twin import Parameter, Twin

KEEP_OFF = 0.01  # m: what a path keeps between two bodies, where start and goal do
_LONGEST = 600.0  # s
_SAME = 1e-3  # rad or m: nearer poses are one
_MOST = 1_000_000  # samples


@dataclass(frozen=True)
class Task:
    """What a motion is to do: start and goal, poses to stand at between them in any order, boxes about it, what counts.

    line: the flange goes straight. least_energy: in `seconds`, or in the time of the fastest, the motion that costs
    least; else the fastest, slowed evenly to `seconds`. search: how long a path may be sought, s. Payload in kg and m
    in the flange frame.
    """

    start: np.ndarray | Pose
    goal: np.ndarray | Pose
    obstacles: Sequence[Obstacle] = ()
    line: bool = False
    least_energy: bool = False
    seconds: float | None = None
    search: float = LONGEST_SEARCH
    payload_mass: float = 0.0
    payload_com: tuple[float, float, float] = (0.0, 0.0, 0.0)
    via: Sequence[np.ndarray | Pose] = ()


@dataclass(frozen=True)
class Plan:
    """A planned motion, its price (None where the twin knows nothing of power) and its least clearance, m.

    unchecked: links with mass but without collision shapes. fastest: how long the fastest motion on the path takes, s.
    tour: the order in which poses are visited, None where there are none between start and goal.
    """

    robot: Robot
    motion: Motion
    price: Price | None
    clearance: float
    checks_itself: bool
    unchecked: tuple[str, ...]
    fastest: float
    tour: Tour | None = None

    @property
    def seconds(self) -> float:
        """How long the motion takes."""
        return float(self.motion.time[-1])


@dataclass(frozen=True)
class Tour:
    """The order of the poses between start and goal, from 1 on, and what it saves against the order that was given.

    saved: J, None where the twin knows nothing of power; sooner: s.
    """

    order: tuple[int, ...]
    saved: Figure | None
    sooner: float


def plan(twin: Twin, task: Task, rate: float = 100.0) -> Plan:
    """Plan a motion of the twin's robot, sampled evenly at (nearly) `rate`, Hz.

    Poses between start and goal are visited in the order that takes least time, or energy, by the fastest moves.

    Raises InputError where start or goal is out of reach, outside the limits or in collision, where there is no way or
    not enough time or torque, or where energy is to be least and the twin knows nothing of power.
    """
    if task.least_energy and not twin.knows_power:
        raise InputError("least energy needs a twin that has seen power; name one that `irtwin diagnose` saved")
    if task.seconds is not None and not 0 < task.seconds <= _LONGEST:
        raise InputError(f"a motion cannot be planned to last {task.seconds:g} s; give up to {_LONGEST:g} s")
    if task.via:
        return _toured(twin, task, rate)
    limits = MotionLimits.of(twin.robot)
    collisions = CollisionModel(twin.robot, task.obstacles)
    quickest = _fastest(twin, task, limits, collisions)
    if task.seconds is not None and task.seconds < quickest.seconds:
        raise InputError(
            f"the motion cannot be done in {task.seconds:g} s; the fastest on this way takes {quickest.seconds:.3f} s"
        )
    seconds = task.seconds or quickest.seconds
    chosen: Movement | Timed = quickest.slower(seconds)
    if task.least_energy:
        about = limits, _torque(twin, task), _power(twin, task), collisions
        chosen = cheapest(quickest, seconds, *about, on_path=task.line)
    if not keeps(chosen, limits, _torque(twin, task), collisions):
        raise InputError(f"a motion of {seconds:g} s asks for more torque than the joints have; give another duration")
    collisions.keep_off(0.0)
    count = max(20, round(seconds * rate))
    if count > _MOST:
        raise InputError(f"{seconds:g} s at {rate:g} Hz are {count} samples; ask for at most {_MOST}")
    motion = _motion(task, np.linspace(0, seconds, count + 1), *chosen.motion(np.linspace(0, seconds, count + 1))[:3])
    meeting, clearance = collisions.first_meeting(motion.time, motion.q)
    if meeting is not None:
        raise InputError(f"between samples of {rate:g} Hz {meeting}; ask for a higher rate")
    return Plan(
        robot=twin.robot,
        motion=motion,
        price=price(twin, [motion]),
        clearance=clearance,
        checks_itself=collisions.checks_itself,
        unchecked=collisions.unchecked,
        fastest=quickest.seconds,
    )


def any_order(twin: Twin, programme: SectionedMotion) -> Tour | None:
    """Return the order of a programme's pauses that takes least energy; its first and last stay where they are.

    Both orders are planned, as `plan` does; pauses one after another at one pose are one. None where no other order
    takes less.
    """
    motion = programme.motion
    poses: list[np.ndarray] = []
    for section in programme.sections:
        pose = motion.q[section.first]
        if section.kind == "pause" and not (poses and _are_one(poses[-1], pose)):
            poses.append(pose)
    if len(poses) < 4:
        return None
    task = Task(
        start=poses[0],
        goal=poses[-1],
        via=poses[1:-1],
        least_energy=True,
        payload_mass=motion.payload_mass,
        payload_com=motion.payload_com,
    )
    tour = plan(twin, task).tour
    return tour if tour and tour.saved and tour.saved.value > 0 else None


def _toured(twin: Twin, task: Task, rate: float) -> Plan:
    if task.seconds is not None:
        raise InputError("a duration is that of one move; give none, and time the whole by `irtwin optimise`")
    collisions = CollisionModel(twin.robot, task.obstacles)
    poses: list[np.ndarray] = []
    for number, target in enumerate((task.start, *task.via, task.goal)):
        poses.append(joints_for(twin.robot, target, collisions, poses[-1] if poses else None, f"pose {number}"))

    @cache
    def leg(start: int, goal: int, least_energy: bool) -> Plan:
        return plan(twin, replace(task, start=poses[start], goal=poses[goal], via=(), least_energy=least_energy), rate)

    last = len(poses) - 1
    cost = np.full((last + 1, last + 1), np.inf)
    for start, goal in track(permutations(range(last + 1), 2), "moves between places planned"):
        if goal != 0 and start != last and not _are_one(poses[start], poses[goal]):
            quick = leg(start, goal, False)
            cost[start, goal] = twin.energy(quick.motion) if task.least_energy else quick.seconds
    order, given = best_order(cost), list(range(last + 1))
    made, was = (
        _joined([leg(*ends, task.least_energy) for ends in track(pairwise(visits), "moves of an order timed")], rate)
        for visits in (order, given)
    )
    saved = saving(twin, made.motion, was.motion) if twin.knows_power else None
    tour = Tour(tuple(order[1:-1]), saved, was.seconds - made.seconds)
    return replace(made, price=price(twin, [made.motion]), tour=tour)


def _are_one(pose: np.ndarray, other: np.ndarray) -> bool:
    return bool(np.abs(pose - other).max() < _SAME)


def _joined(legs: Sequence[Plan], rate: float) -> Plan:
    """Return plans one after another as one, without its price."""
    ends = np.cumsum([0.0, *(leg.seconds for leg in legs)])
    time = np.linspace(0.0, ends[-1], max(20, round(ends[-1] * rate)) + 1)
    own = np.concatenate([leg.motion.time + begin for leg, begin in zip(legs, ends, strict=False)])
    states = [np.concatenate([getattr(leg.motion, name) for leg in legs]) for name in ("q", "dq", "ddq")]
    q, dq, ddq = (np.column_stack([np.interp(time, own, column) for column in values.T]) for values in states)
    return replace(
        legs[0],
        motion=replace(legs[0].motion, time=time, q=q, dq=dq, ddq=ddq),
        clearance=min(leg.clearance for leg in legs),
        fastest=sum(leg.fastest for leg in legs),
    )


def nominal_twin(robot: Robot) -> Twin:
    """Return a twin of a robot's URDF and data sheet alone: bodies and rotors as they say, and nothing of power."""
    effects = (RigidBody.id, RotorInertia.id)
    terms = Stack(robot, effects).torque_terms
    parameters = [
        Parameter(effect.id, term.joint, term.link, term.name, term.expected, term.unit) for effect, term in terms
    ]
    return Twin(robot, effects, tuple(parameters))


def _fastest(twin: Twin, task: Task, limits: MotionLimits, collisions: CollisionModel) -> Timed:
    robot = twin.robot
    start = joints_for(robot, task.start, collisions, None, "the start")
    goal = joints_for(robot, task.goal, collisions, start, "the goal")
    if _are_one(start, goal):
        raise InputError("start and goal are the same pose; give another goal")
    ends = min(collisions.clearance(start), collisions.clearance(goal))
    collisions.keep_off(min(KEEP_OFF, ends / 2))
    if task.line:
        return fastest(through(line_path(robot, collisions, start, goal)), limits, _torque(twin, task))
    corners = joint_path(robot, collisions, start, goal, task.search)
    return fastest(rounded(corners, collisions.is_clear), limits, _torque(twin, task))


def _torque(twin: Twin, task: Task) -> Torque:
    def torque(q: np.ndarray, dq: np.ndarray, ddq: np.ndarray) -> np.ndarray:
        return twin.joint_torque(_motion(task, np.arange(float(len(q))), q, dq, ddq))

    return torque


def _power(twin: Twin, task: Task) -> Power:
    def power(time: np.ndarray, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray) -> np.ndarray:
        return twin.power(_motion(task, time, q, dq, ddq))

    return power


def _motion(task: Task, time: np.ndarray, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray) -> Motion:
    return Motion(time, q, dq, ddq, run="planned", payload_mass=task.payload_mass, payload_com=task.payload_com)
