"""Programmes: what a robot can be asked to do so that its effects show, within its limits."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from irtwin.document import experiment
from irtwin.document.experiment import Settings
from irtwin.effects.effect import Effect
from irtwin.errors import InputError
from irtwin.identification.excitation import excite
from irtwin.identification.motion_limits import JointLimits, Walls
from irtwin.identification.progress import tell_step
from irtwin.robot.description import Robot
from irtwin.robot.model import inverse_dynamics
from irtwin.signals.motion import Motion

_RESERVE = 0.9  # of the limits of speed and acceleration
_SLOWEST = 0.005  # rad/s (m/s)
_LEVELS = 8  # speeds of a ladder
_LEG = 3.0  # s at each speed
_SWEEP = 20.0  # s one way
_TURN = 2 * np.pi  # rad: more repeats itself
_POSES = 10
_HOLD = 2.0  # s
_SMALL = (3e-3, 0.01, 0.03)  # rad (m): half of the way between reversals
_STEPS = (0.25, 0.5, 1.0)  # of the largest acceleration
_EXCITING = 20.0  # s
_ITERATIONS = 5  # enough to compare; `irtwin robot excite` goes on from there
_SET_UP = 300.0  # s to put a load on or take something off
_WARM_UP = 1800.0  # s
_COLD, _WARM = 25.0, 45.0  # degC
_PAYLOAD_SHARE = 1 / 8  # of the arm's mass: what arms of their class carry at least
_CENTRE = (0.0, 0.0, 0.05)  # m, of the load, from the flange
_SHRINK, _TRIES = 0.7, 6
_CHECKED = 200  # samples on the way
LONGEST = 600.0  # s of one programme
_MOST_SAMPLES = 100_000  # of one programme
_FEWEST_SAMPLES = 12  # of a motion; a quintic spline takes six
_RATE = 5.0  # samples a period of the cutoff: enough of what the filter lets through


@dataclass(frozen=True)
class ExperimentProgramme:
    """One experiment: the motions that it takes (planned: q, dq, ddq over time), and how to run it.

    `without`: effects that are taken off the robot in every one of its motions (the tool, the hose package);
    `set_up`: s beside the motions themselves; `settings`: what to enter at the controller.
    """

    kind: str
    text: str
    joints: tuple[str, ...]
    motions: tuple[Motion, ...]
    set_up: float = 0.0
    without: tuple[str, ...] = ()
    settings: Settings = field(default_factory=Settings)

    @property
    def seconds(self) -> float:
        """How long its motions take, s."""
        return float(sum(motion.time[-1] - motion.time[0] for motion in self.motions))

    @property
    def cost(self) -> float:
        """How long all of it takes, s."""
        return self.seconds + self.set_up

    @property
    def said(self) -> experiment.Programme:
        """What a user needs to run it."""
        return experiment.Programme(
            kind=self.kind,
            joints=self.joints,
            seconds=round(self.seconds, 1),
            set_up_seconds=self.set_up,
            payload_mass=tuple(motion.payload_mass for motion in self.motions),
            taken_off=self.without,
            **vars(self.settings),
        )


def programmes(
    robot: Robot,
    joints: Sequence[str],
    seen: Sequence[Motion],
    effects: Sequence[Effect] = (),
) -> Iterator[ExperimentProgramme]:
    """Yield the programmes that are worth weighing for some joints (none: all), the plain ones first.

    `seen`: motions of the robot, whose poses, filter and rate the programmes take over; `effects` are in question: with
    a warm-up where one needs temperatures, and without each that can be taken off. Where the URDF gives no limits,
    those of `seen` are kept.
    """
    yard = _Yard(robot, joints or robot.joint_names, seen)
    for build in (_ladder, _sweep, _reversals, _steps, _poses):
        made = yard.clear(build)
        if made is not None:
            yield made
    exciting = _exciting(robot, yard) if yard.within(_EXCITING) else None
    if exciting is None:
        return
    yield exciting
    if mass := _payload(robot):
        yield _loaded(exciting, mass)
    if any("temperature" in effect.requires for effect in effects):
        yield _warmed(exciting)
    for effect in effects:
        if effect.taken_off:
            text = f"{exciting.text}, {effect.taken_off}"
            kind = f"without_{effect.id}"
            yield replace(exciting, kind=kind, text=text, set_up=_SET_UP, without=(effect.id,))


class _Yard:
    """Where a robot may move: its limits, the pose that it works about, and the floor."""

    def __init__(self, robot: Robot, joints: Sequence[str], seen: Sequence[Motion]):
        self.robot, self.joints = robot, tuple(joints)
        self.moved = np.isin(robot.joint_names, self.joints)
        self.limits = _limits(robot, seen)
        q = np.concatenate([motion.q for motion in seen])
        width = self.limits.upper - self.limits.lower
        inside = np.clip(np.median(q, axis=0), self.limits.lower + 0.3 * width, self.limits.upper - 0.3 * width)
        self.pose = np.where(self.moved, inside, np.median(q, axis=0))
        self.reach = 0.8 * np.minimum(self.pose - self.limits.lower, self.limits.upper - self.pose)
        self.reach = np.minimum(self.reach, _TURN / 2) * self.moved
        self.speed, self.acceleration = _RESERVE * self.limits.speed, _RESERVE * self.limits.acceleration
        last = seen[-1]
        self.cutoff, self._last = last.cutoff, last
        self.rate = min(last.rate, _RATE * last.cutoff) if last.cutoff else min(last.rate, 100.0)
        self._walls: Walls | None = Walls(robot, self.limits, None)
        if not self._above_floor([q]):
            self._walls = None  # the floor is elsewhere
        effort = np.array([joint.effort if joint.effort > 0 else np.inf for joint in robot.joints])
        self._most = np.maximum(effort, self._torque(seen))

    def clear(self, build: Callable[[_Yard], ExperimentProgramme]) -> ExperimentProgramme | None:
        """Return the programme about the pose, smaller where it would touch the floor or last too long.

        Gentler where the described bodies would need more torque than joints have, or than was seen. None where no such
        one is clear.
        """
        whole = self.reach, self.acceleration
        try:
            for _ in range(_TRIES):
                try:
                    made = build(self)
                except _TooLong:
                    made = None
                if made is None or not self._above_floor([motion.q for motion in made.motions]):
                    self.reach = _SHRINK * self.reach
                elif (self._torque(made.motions) > self._most).any():
                    self.acceleration = _SHRINK * self.acceleration
                else:
                    return made
            return None
        finally:
            self.reach, self.acceleration = whole

    def _torque(self, motions: Sequence[Motion]) -> np.ndarray:
        """Return the greatest torque of each joint, (n,), that the described bodies need at some samples."""
        some = [motion.rows(slice(None, None, max(1, len(motion.time) // _CHECKED))) for motion in motions]
        torque = [inverse_dynamics(self.robot.model, motion.q, motion.dq, motion.ddq) for motion in some]
        return np.asarray(np.abs(np.concatenate(torque)).max(axis=0))

    def within(self, seconds: float) -> bool:
        """Return whether a programme may last so long: neither too many samples nor too few to differentiate."""
        return seconds <= LONGEST and _FEWEST_SAMPLES <= seconds * self.rate <= _MOST_SAMPLES

    def _above_floor(self, parts: Sequence[np.ndarray]) -> bool:
        q = np.concatenate(parts)
        every = max(1, len(q) // _CHECKED)
        return self._walls is None or float(self._walls.clearance(q[::every]).min(initial=1.0)) > 0

    def motion(
        self,
        stops: Sequence[np.ndarray],
        speeds: Sequence[np.ndarray],
        accelerations: Sequence[np.ndarray] | None = None,
        hold: float = 0.1,
    ) -> Motion:
        """Move from stop to stop (n,), each move at most at its speed and acceleration (n,); rest `hold` s at each.

        Raises _TooLong.
        """
        accelerations = accelerations or [self.acceleration] * len(speeds)
        moves = list(zip(stops, stops[1:], speeds, accelerations, strict=False))
        whole = hold * len(stops) + sum(1 / fast + fast / sharp for fast, sharp in (_pace(*move) for move in moves))
        if not self.within(whole):
            raise _TooLong
        rest = np.zeros((max(1, round(hold * self.rate)), len(self.pose)))
        parts = [(stops[0] + rest, rest, rest)]
        for start, stop, speed, acceleration in moves:
            parts += [_move(start, stop, speed, acceleration, self.rate), (stop + rest, rest, rest)]
        q, dq, ddq = (np.concatenate(part) for part in zip(*parts, strict=True))
        return self.planned(np.arange(len(q)) / self.rate, q, dq, ddq)

    def planned(self, time: np.ndarray, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray) -> Motion:
        """Return a motion of joints that are as warm as the robot was last, where that is known."""
        warm = None if self._last.temperature is None else np.tile(self._last.temperature[-1], (len(q), 1))
        return Motion(time, q, dq, ddq, run="planned", cutoff=self.cutoff, temperature=warm)

    def programme(self, kind: str, text: str, motion: Motion, **settings: Any) -> ExperimentProgramme:
        """Return the programme of one motion about the pose."""
        pose = {name: round(float(value), 4) for name, value in zip(self.robot.joint_names, self.pose, strict=True)}
        named = "all joints" if self.moved.all() else ", ".join(self.joints)
        return ExperimentProgramme(
            kind, f"{named}: {text}", self.joints, (motion,), settings=Settings(pose=pose, **settings)
        )

    def by_joint(self, values: np.ndarray) -> dict[str, tuple[float, ...]]:
        """Return (M, n) values of the joints that move, by name, to four digits."""
        return {
            name: tuple(float(f"{value:.4g}") for value in np.atleast_2d(values)[:, self.robot.index(name)])
            for name in self.joints
        }

    @property
    def unit(self) -> str:
        """The unit of the joints that move, in words."""
        units = {joint.unit for joint in self.robot.joints if joint.name in self.joints}
        return " or ".join(sorted(units, reverse=True))


class _TooLong(Exception):
    """A programme would last longer, or have more samples, than one may."""


def _pace(start: np.ndarray, stop: np.ndarray, speed: np.ndarray, acceleration: np.ndarray) -> tuple[float, float]:
    """Return the largest speed (1/s) and acceleration (1/s^2) of a move, as shares of its way."""
    size = np.maximum(np.abs(stop - start), 1e-12)
    fast, sharp = float((speed / size).min()), float((acceleration / size).min())
    return min(fast, sharp**0.5), sharp


def _move(
    start: np.ndarray, stop: np.ndarray, speed: np.ndarray, acceleration: np.ndarray, rate: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return q, dq, ddq (N, n) from rest to rest on a straight line in joint space, by a trapezoid of speed."""
    way = stop - start
    fast, sharp = _pace(start, stop, speed, acceleration)
    needed = 1 / fast + fast / sharp
    count = int(np.ceil(needed * rate))
    slower = needed * rate / count
    fast, sharp = fast * slower, sharp * slower**2
    time = np.arange(1, count + 1) / rate
    left = count / rate - time
    ramp = fast / sharp
    s = np.where(time < ramp, sharp * time**2 / 2, fast * (time - ramp / 2))
    s = np.where(left < ramp, 1 - sharp * left**2 / 2, s)
    ds = np.minimum(np.minimum(sharp * time, sharp * left), fast)
    dds = np.where(time < ramp, sharp, np.where(left < ramp, -sharp, 0.0))
    return start + s[:, None] * way, ds[:, None] * way, dds[:, None] * way


def _limits(robot: Robot, seen: Sequence[Motion]) -> JointLimits:
    try:
        return JointLimits.of(robot)
    except InputError:
        q, dq, ddq = (np.concatenate([getattr(m, name) for m in seen]) for name in ("q", "dq", "ddq"))
        margin = np.maximum(np.ptp(q, axis=0), 1e-3) * 1e-3
        return JointLimits(
            q.min(axis=0) - margin,
            q.max(axis=0) + margin,
            np.maximum(np.abs(dq).max(axis=0), 1e-2),
            np.maximum(np.abs(ddq).max(axis=0), 1e-1),
        )


def _ladder(yard: _Yard) -> ExperimentProgramme:
    lowest = np.minimum(_SLOWEST / yard.speed, 0.5)
    speeds = np.array([yard.speed * lowest ** (1 - k / (_LEVELS - 1)) for k in range(_LEVELS)])
    seconds = [min(_LEG, float((2 * yard.reach / speed)[yard.moved].min())) for speed in speeds]
    half = np.array([speed * length / 2 * yard.moved for speed, length in zip(speeds, seconds, strict=True)])
    stops, rates = [yard.pose], []
    for speed, way in zip(speeds, half, strict=True):
        stops += [yard.pose - way, yard.pose + way, yard.pose - way]
        rates += [speed] * 3
    return yard.programme(
        "speed_ladder",
        f"a ladder of {_LEVELS} constant speeds, each both ways, from {speeds[0][yard.moved].min():.2g} to "
        f"{speeds[-1][yard.moved].max():.2g} {yard.unit}/s",
        yard.motion([*stops, yard.pose], [*rates, yard.speed]),
        speeds=yard.by_joint(speeds),
        amplitudes=yard.by_joint(half),
    )


def _sweep(yard: _Yard) -> ExperimentProgramme:
    speed = 2 * np.maximum(yard.reach, 1e-6) / _SWEEP
    low, high = yard.pose - yard.reach, yard.pose + yard.reach
    return yard.programme(
        "slow_sweep",
        f"one slow, constant speed both ways over {2 * yard.reach.max():.2g} {yard.unit}",
        yard.motion([yard.pose, low, high, low, yard.pose], [yard.speed / 2, speed, speed, yard.speed / 2]),
        speeds=yard.by_joint(speed),
        amplitudes=yard.by_joint(yard.reach),
    )


def _reversals(yard: _Yard) -> ExperimentProgramme:
    stops, rates = [yard.pose], []
    for size in _SMALL:
        way = np.minimum(size, yard.reach) * yard.moved
        stops += [yard.pose + way, yard.pose - way] * 3
        rates += [np.maximum(2 * way, 1e-6)] * 6
    return yard.programme(
        "small_reversals",
        f"slow reversals of {_SMALL[0]:g} to {_SMALL[-1]:g} {yard.unit} about one pose, a second each way",
        yard.motion([*stops, yard.pose], [*rates, yard.speed]),
        amplitudes=dict.fromkeys(yard.joints, _SMALL),
    )


def _steps(yard: _Yard) -> ExperimentProgramme:
    way = np.minimum(yard.reach, 0.25 * yard.speed) * yard.moved
    stops, sharp = [yard.pose], []
    for share in _STEPS:
        stops += [yard.pose + way, yard.pose - way] * 4
        sharp += [share * yard.acceleration] * 8
    shares = ", ".join(f"{100 * share:g}" for share in _STEPS)
    return yard.programme(
        "acceleration_steps",
        f"short moves forth and back with {shares} % of the largest acceleration",
        yard.motion([*stops, yard.pose], [yard.speed] * 25, [*sharp, yard.acceleration]),
        amplitudes=yard.by_joint(way),
        accelerations=yard.by_joint(np.outer(_STEPS, yard.acceleration)),
    )


def _poses(yard: _Yard) -> ExperimentProgramme:
    spread = np.random.default_rng(0).uniform(-1, 1, (_POSES, len(yard.pose)))
    stops = [yard.pose, *(yard.pose + spread * yard.reach)]
    made = yard.programme(
        "holding_poses",
        f"holding {_POSES} poses for {_HOLD:g} s each",
        yard.motion(stops, [yard.speed / 2] * _POSES, hold=_HOLD),
    )
    return replace(made, settings=Settings(poses=yard.by_joint(np.array(stops)), hold_seconds=_HOLD))


def _exciting(robot: Robot, yard: _Yard) -> ExperimentProgramme | None:
    """Return an exciting motion of all joints, good enough to compare; None where the robot's limits allow none."""

    def step(iteration: int, condition: float, seconds: float) -> None:
        tell_step(f"  exciting motion, step {iteration}")

    try:
        made = excite(robot, _EXCITING, iterations=_ITERATIONS, progress=step).sample(yard.rate)
    except InputError:
        return None
    return ExperimentProgramme(
        "exciting_motion",
        f"an exciting motion of all joints, {_EXCITING:g} s",
        robot.joint_names,
        (yard.planned(*made),),
        settings=Settings(command=f"irtwin robot excite URDF --seconds {_EXCITING:g} --out motion.csv"),
    )


def _loaded(exciting: ExperimentProgramme, mass: float) -> ExperimentProgramme:
    (plain,) = exciting.motions
    return replace(
        exciting,
        kind="payload",
        text=f"{exciting.text}, without and with a weighed payload of {mass:g} kg",
        motions=(plain, replace(plain, run="planned, loaded", payload_mass=mass, payload_com=_CENTRE)),
        set_up=_SET_UP,
        settings=replace(exciting.settings, payload_com=_CENTRE),
    )


def _warmed(exciting: ExperimentProgramme) -> ExperimentProgramme:
    (plain,) = exciting.motions
    shape = plain.q.shape
    return replace(
        exciting,
        kind="warm_up",
        text=f"{exciting.text}, from cold and again after half an hour of work, joint temperatures logged",
        motions=(
            replace(plain, temperature=np.full(shape, _COLD)),
            replace(plain, run="planned, warm", temperature=np.full(shape, _WARM)),
        ),
        set_up=_WARM_UP,
        settings=replace(exciting.settings, temperatures=(_COLD, _WARM)),
    )


def _payload(robot: Robot) -> float:
    """Return a load that the arm surely carries, kg to one digit; a payload that it must not exceed is its maker's."""
    arm = float(sum(link.mass for link in robot.links[1:]))
    return float(f"{_PAYLOAD_SHARE * arm:.1g}")
