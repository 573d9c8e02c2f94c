"""Commands of a log, played through a model in MuJoCo."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from irtwin.errors import InputError
from irtwin.signals.log import Run
from irtwin.signals.sampling import interval
from irtwin.simulator.engine import mujoco
from irtwin.simulator.feedforward import Feedforward
from irtwin.simulator.model import EFFORT, Model
from irtwin.simulator.servos import NAMES, Servos
from irtwin.simulator.variant import PlayedModel

_AROUND = 0.1  # s about a beginning, of which position and speed there are taken
_DELAY, _OFFSET = NAMES.index("delay"), NAMES.index("offset")
_MOST = 20_000_000  # values of states that are held at a time: 160 MB


@dataclass(frozen=True)
class Push:
    """A force (3,) at the flange, N, along the world's axes, from `start` to `stop`, s of its run's clock.

    It comes and goes in `rise` s.
    """

    run: str
    force: np.ndarray
    start: float
    stop: float
    rise: float = 0.1

    def share(self, time: np.ndarray) -> np.ndarray:
        """Return how much of it acts at times of its run (N,), 0 to 1."""
        return np.asarray(np.clip(np.minimum(time - self.start, self.stop - time) / self.rise, 0.0, 1.0))


@dataclass(frozen=True)
class PlayedStretch:
    """A part of a run that is played by itself: `rows` of it, from `begin` s; it begins as the robot did there.

    `pushes`: what the model is pushed by; those of other runs are nothing to it.
    """

    run: Run
    rows: slice
    begin: float
    pushes: tuple[Push, ...] = ()

    @property
    def time(self) -> np.ndarray:
        """The times of its samples (N,), s since its beginning."""
        return np.asarray(self.run.signals.time[self.rows] - self.begin)

    @property
    def q(self) -> np.ndarray:
        """The robot's positions (N, n)."""
        return np.asarray(self.run.signals.q[self.rows])

    @property
    def measured(self) -> np.ndarray:
        """What the robot did, (N, c, n): positions, and torques where they were logged."""
        torque = self.run.signals.torque
        return self.q[:, None] if torque is None else np.stack([self.q, torque[self.rows]], axis=1)

    @property
    def speed(self) -> np.ndarray:
        """The robot's speeds (N, n)."""
        return speeds(self.time, self.q)

    def state(self) -> tuple[np.ndarray, np.ndarray]:
        """Return position and speed (n,) of the robot where it begins."""
        time, q = self.run.signals.time - self.begin, self.run.signals.q
        near = np.abs(time) <= _AROUND
        columns = np.column_stack([np.ones(near.sum()), time[near]])
        position, speed = np.linalg.lstsq(columns, q[near], rcond=None)[0]
        return position, speed

    def pushed(self, model: Model, begin: np.ndarray, step: float) -> np.ndarray:
        """Return the torque (N, n) of pushes over steps that begin at times (N,), s since its beginning."""
        torques = np.zeros((len(begin), len(model.joints)))
        for push in (push for push in self.pushes if push.run == self.run.name):
            share = push.share(self.begin + begin + step / 2)
            rows = np.flatnonzero(share)
            if len(rows):
                inside = np.abs(self.time - begin[rows].mean()) <= np.ptp(begin[rows]) / 2 + _AROUND
                torque = push.force @ model.flange_jacobian(self.q[inside])
                torques[rows] += share[rows, None] * _at(begin[rows], self.time[inside], torque)
        return torques

    def fed(self, feedforward: Feedforward, begin: np.ndarray, numbers: np.ndarray) -> np.ndarray:
        """Return the torque (N, n) that a controller adds over steps that begin at times (N,), s, by numbers (k, n)."""
        return feedforward.torque(self.run, self.begin + begin, numbers[_DELAY])

    def commands(
        self, begin: np.ndarray, step: float, numbers: np.ndarray, lead: np.ndarray | float = 0.0,
        damps_error: bool = False,
    ) -> np.ndarray:  # fmt: skip
        """Return the commands (N, n) in force, on average, over steps that begin at times (N,), s since its beginning.

        Each command is in force until the next comes; the delay of `numbers` (k, n) is in them, and so is a commanded
        speed over `lead` (n,) s, where one was logged, or by `damps_error` that of the commands.
        """
        time, told, speed = self.run.signals.time, self.run.signals.command, self.run.signals.command_speed
        assert told is not None
        if damps_error:
            speed = np.diff(told, axis=0, prepend=told[:1]) / interval(time)
        told = told if speed is None else told + lead * speed
        ends = np.concatenate([[time[0] - 1e4], time, [time[-1] + 1e4]])
        held = np.vstack([told[:1], told])  # before the first sample: the first
        summed = np.vstack([np.zeros(told.shape[1]), np.cumsum(held * np.diff(ends)[:, None], axis=0)])
        commands = np.empty((len(begin), told.shape[1]))
        for k in range(told.shape[1]):
            at = self.begin + begin - numbers[_DELAY, k]
            commands[:, k] = (np.interp(at + step, ends, summed[:, k]) - np.interp(at, ends, summed[:, k])) / step
        return commands


def speeds(time: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Return the speeds (N, n) of positions (N, n) at times (N,), s, over 0.1 s."""
    apart = max(1, round(_AROUND / 2 / interval(time)))
    rows = np.arange(len(time))
    before, after = np.maximum(rows - apart, 0), np.minimum(rows + apart, len(rows) - 1)
    return np.asarray((q[after] - q[before]) / (time[after] - time[before])[:, None])


def whole(run: Run, pushes: tuple[Push, ...] = ()) -> PlayedStretch:
    """Return a run as one stretch."""
    return PlayedStretch(run, slice(None), float(run.signals.time[0]), pushes)


def each(run: Run, seconds: float, most: int, pushes: tuple[Push, ...] = ()) -> list[PlayedStretch]:
    """Return stretches of a run that do not overlap, of `most` at most, evenly spread; at least one."""
    time = run.signals.time
    lasts = float(time[-1] - time[0])
    count = min(max(1, int(lasts / seconds)), most)
    begins = time[0] + np.maximum((np.arange(count) + 0.5) * lasts / count - seconds / 2, 0.0)
    ends = [np.searchsorted(time, [begin - 1e-9, begin + seconds - 1e-9]) for begin in begins]
    return [PlayedStretch(run, slice(*rows), float(begin), pushes) for rows, begin in zip(ends, begins, strict=True)]


def commanded(
    servos: Servos, played: Iterable[tuple[np.ndarray, PlayedStretch]], begin: np.ndarray, step: float
) -> Iterator[np.ndarray]:
    """Yield the commands (N, n), offset and all, of numbers (k, n) and a stretch each, over steps as `commands` has."""
    known: dict[tuple[bytes, int], np.ndarray] = {}  # many numbers have them as late, and led as far
    for numbers, stretch in played:
        lead = servos.lead(numbers)
        asked = np.vstack([numbers[_DELAY], lead]).tobytes(), id(stretch)
        if asked not in known:
            known[asked] = stretch.commands(begin, step, numbers, lead, servos.model.file.damps_error)
        yield known[asked] + numbers[_OFFSET]


def play(
    servos: Servos, numbers: Sequence[np.ndarray], stretches: Sequence[PlayedStretch], *, strict: bool = False
) -> list[list[np.ndarray]]:
    """Return, for each set of numbers (k, n) and each stretch, what the model does at its samples, as `measured`.

    Joints that the robot lacks are told zero. Where numbers make the simulation unstable MuJoCo begins it anew, and a
    fit sees that it is far off; `strict`: raises InputError there.
    """
    needed = [servos.needs(number_set) for number_set in numbers]
    moved: list[list[np.ndarray]] = [[] for _ in numbers]
    for needs in dict.fromkeys(needed):
        places = [place for place, own in enumerate(needed) if own == needs]
        played = _played(servos, servos.variant(needs), [numbers[place] for place in places], stretches, strict)
        for place in places:
            moved[place] = [next(played) for _ in stretches]
    return moved


def _played(
    servos: Servos,
    variant: PlayedModel,
    numbers: Sequence[np.ndarray],
    stretches: Sequence[PlayedStretch],
    strict: bool,
) -> Iterator[np.ndarray]:
    """Yield, set by set and stretch by stretch, what the model does (N, c, n)."""
    from mujoco.rollout import rollout

    compiled = variant.compiled
    step = compiled.opt.timestep
    steps = int(np.ceil(max(stretch.time[-1] for stretch in stretches) / step)) + 1
    size = mujoco.mj_stateSize(compiled, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    datas = [mujoco.MjData(compiled) for _ in os.sched_getaffinity(0)]
    pairs = [(set_index, place) for set_index in range(len(numbers)) for place in range(len(stretches))]
    models = [servos.compiled(number_set, variant) for number_set in numbers]
    for model in models if all(stretch.run.signals.torque is None for stretch in stretches) else ():
        model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_SENSOR)  # torque alone is asked of sensors
    on_links = [servos.on_links(number_set) for number_set in numbers]
    states = {
        (set_index, place): _state(servos, variant, models[set_index], stretches[place], size, on_links[set_index])
        for set_index, place in pairs
    }
    efforts = [int(compiled.sensor(f"{joint}{EFFORT}").adr[0]) for joint in servos.model.joints]
    inputs = mujoco.mjtState.mjSTATE_CTRL | mujoco.mjtState.mjSTATE_QFRC_APPLIED
    at_once = max(1, _MOST // (steps * size))
    begin, after = np.arange(steps) * step, np.arange(1, steps + 1) * step
    for first in range(0, len(pairs), at_once):
        some = pairs[first : first + at_once]
        told = np.zeros((len(some), steps, compiled.nu + compiled.nv))
        played = ((numbers[set_index], stretches[place]) for set_index, place in some)
        every = zip(some, commanded(servos, played, begin, step), strict=True)
        for row, ((set_index, place), commands) in enumerate(every):
            for drives in (servos.actuators, *([variant.second] if len(variant.second) else [])):
                told[row][:, drives] = commands
            torque = stretches[place].pushed(servos.model, begin, step)
            told[row][:, compiled.nu + variant.speeds] = torque
            told[row][:, compiled.nu + variant.behind] = torque[:, variant.soft]
            if servos.feedforward:
                told[row][:, variant.fed] = stretches[place].fed(servos.feedforward, begin, numbers[set_index])
        begun = np.array([states[pair] for pair in some])
        with _unlogged():
            reached, sensed = rollout(
                [models[set_index] for set_index, _ in some], datas, begun, told, control_spec=int(inputs)
            )
        if strict:
            _check_stable(
                servos, [stretches[place].run.name for _, place in some], reached[:, :, 0] - begun[:, :1], after
            )
        for row, (set_index, place) in enumerate(some):
            time = stretches[place].time
            q = variant.measured(np.vstack([begun[row], reached[row]])[:, 1 : 1 + compiled.nq], on_links[set_index])
            moved = [_at(time, np.concatenate([[0.0], after]), q)]
            if stretches[place].run.signals.torque is not None:
                moved.append(_at(time, begin, sensed[row][:, efforts]))
            yield np.stack(moved, axis=1)


@contextmanager
def _unlogged() -> Iterator[None]:
    """Keep MuJoCo from writing MUJOCO_LOG.TXT where the user is: a fit tries numbers at which it is unstable."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda warning: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)


def _check_stable(servos: Servos, runs: Sequence[str], clocks: np.ndarray, expected: np.ndarray) -> None:
    """Raise InputError where a simulation's clock (M, N) is not the expected one (N,): MuJoCo began it anew."""
    wrong = ~(np.abs(clocks - expected) < expected[0] / 2)  # NaN is wrong, too
    for run, stopped in zip(runs, wrong, strict=True):
        if stopped.any():
            raise InputError(
                f"{servos.model.file.path}: its simulation is unstable {expected[int(np.argmax(stopped))]:.3g} s into "
                f"run {run}; give it a smaller timestep, lower gains, or more armature"
            )


def _at(time: np.ndarray, times: np.ndarray, values: np.ndarray) -> np.ndarray:
    return np.column_stack([np.interp(time, times, column) for column in values.T])


def _state(
    servos: Servos,
    variant: PlayedModel,
    compiled: mujoco.MjModel,
    stretch: PlayedStretch,
    size: int,
    on_links: np.ndarray,
) -> np.ndarray:
    """Return the state of a variant with numbers: time, positions, speeds, then what its actuators remember.

    Links hang from soft joints as in rest.
    """
    position, speed = stretch.state()
    data = mujoco.MjData(compiled)
    data.qpos[variant.positions], data.qvel[variant.speeds] = position, speed
    if len(variant.behind):
        mujoco.mj_forward(compiled, data)
        twist = data.qfrc_bias[variant.behind] / compiled.jnt_stiffness[compiled.dof_jntid[variant.behind]]
        data.qpos[variant.links] = -twist
        data.qpos[variant.positions[variant.soft]] += twist * on_links[variant.soft]
    memory = compiled.actuator_actadr[servos.actuators]
    data.act[memory[memory >= 0]] = position[memory >= 0]
    state = np.empty(size)
    mujoco.mj_getState(compiled, data, state, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    return state
