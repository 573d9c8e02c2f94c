"""Are commands what the joints were told: each its joint's, in its unit and sense, of this run, by its clock?"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy

from irtwin.robot.description import Joint, Robot
from irtwin.signals.channels import CHANNELS
from irtwin.signals.finding import LogFinding
from irtwin.signals.log import DataSet, Run, own_runs
from irtwin.signals.motion import stretches

_FOLLOWS = 0.8  # correlation of positions with commands, from which a joint goes where it is told
_DEGREES = (50.0, 65.0)  # commands over positions, as slope: 180/pi is between
_UNMOVED = 0.1  # rad or m: a joint that is told to go farther moves, whatever its friction and play
_STEP, _LATEST, _MOST = 0.02, 1.0, 20_000  # s between looks, s by which positions may be behind, looks at a run
_LAGS = np.arange(-round(_LATEST / _STEP), round(_LATEST / _STEP) + 1)  # steps by which positions are looked for behind
_BEHIND = _LAGS >= 0  # of the lags: those of positions that are not ahead of commands
_LEAST = 3  # times that, of a run that tells
_STANDS = 5.0  # s that a command stands while its joint settles
_LEAD = 0.1  # s: no filter of positions or feed-forward brings these as much ahead of commands
_LEFT = 0.02  # of the squares of positions: explained as well as may be
_GAIN = 2.0  # by which what is left has to shrink, at each joint
_FOREIGN = 0.4  # of the squares of positions: commands of another run explain less; a run's own 0.84 in 431 runs


def command_findings(data_set: DataSet) -> list[LogFinding]:
    """Return what is wrong with commands: of no use to be played where that is certain, else to be looked at.

    Where torque or power was logged nothing has to be played, and none is certain.
    """
    findings = faults(data_set.robot, [run for run in own_runs(data_set.runs) if run.signals.command is not None])
    return findings if data_set.is_commanded else [replace(finding, certain=False) for finding in findings]


def faults(robot: Robot, runs: Sequence[Run]) -> list[LogFinding]:
    """Return what is wrong with the commands that all of these runs have: one finding a column, of the first kind."""
    if not runs:
        return []
    together = [_Log(run, np.asarray(run.signals.command)) for run in runs]
    whole, each = [together], [[log] for log in together]
    for kind, groups in (
        (_late, whole), (_exchanged, whole), (_late, each), (_by_run, each), (_exchanged, each), (_by_joint, whole),
        (_foreign, each),
    ):  # fmt: skip
        by_column: dict[str, LogFinding] = {}
        for finding in (finding for logs in groups for finding in kind(robot, logs)):
            known = by_column.get(finding.channel)
            by_column[finding.channel] = replace(known, runs=known.runs + finding.runs) if known else finding
        if by_column:
            return list(by_column.values())
    return []


@dataclass(frozen=True, eq=False)
class _Log:
    """A run and its commands (N, n)."""

    run: Run
    told: np.ndarray

    @property
    def q(self) -> np.ndarray:
        return self.run.signals.q

    @cached_property
    def products(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Sums of command times position (L, n, n), by lag, of squared commands (L, n) and positions (n,)."""
        n, time = self.q.shape[1], self.run.signals.time
        most, both, of_told = _LAGS.max(), np.zeros((len(_LAGS), n, n)), np.zeros((len(_LAGS), n))
        at = time[0] + _STEP * np.arange(min(_MOST, (time[-1] - time[0]) // _STEP))
        if len(at) <= _LEAST * most:
            return both, of_told, np.zeros(n)
        told, q = (np.column_stack([np.interp(at, time, column) for column in some.T]) for some in (self.told, self.q))
        q = q[most:-most] - q[most:-most].mean(axis=0)
        for place, lag in enumerate(_LAGS):
            earlier = told[most - lag : len(at) - most - lag]
            earlier = earlier - earlier.mean(axis=0)
            both[place], of_told[place] = earlier.T @ q, (earlier**2).sum(axis=0)
        return both, of_told, (q**2).sum(axis=0)


def _exchanged(robot: Robot, logs: Sequence[_Log]) -> Iterator[LogFinding]:
    """Yield that commands stand in each other's columns: there they leave half of what they leave in their own."""
    _, moves = _spans(logs)
    left = np.where(moves, _left(logs)[_BEHIND].min(axis=0), 1.0) + _LEFT
    _, place = scipy.optimize.linear_sum_assignment(np.log(left.T))  # by joint, whose commands it follows
    own = np.arange(len(moves))
    followed = (place != own) & moves
    if not followed.any() or (left[place, own][followed] * _GAIN > left[own, own][followed]).any():
        return
    names = CHANNELS["command"].columns(robot.joint_names)
    exchanged = [names[joint] for joint in sorted({*np.flatnonzero(followed), *place[followed]})]
    follow = ", ".join(f"{robot.joint_names[joint]} follows {names[place[joint]]}" for joint in own[followed])
    run, all_runs = logs[0].run, ", as in all runs" if len(logs) > 1 else ""
    say = f"{run.file}: {', '.join(exchanged)} stand in each other's columns{all_runs}: {follow}; "
    say += "name them by their joints"
    fault = "swap" if len(exchanged) == 2 else "order"
    yield LogFinding(fault, " <-> ".join(exchanged), (run.name,), True, False, {}, say)


def _by_run(robot: Robot, logs: Sequence[_Log]) -> Iterator[LogFinding]:
    """Yield dead positions, dead commands and degrees of a run alone."""
    (log,) = logs
    for joint, told, q in zip(robot.joints, log.told.T, log.q.T, strict=True):
        if np.ptp(q) == 0 and np.ptp(told) > _UNMOVED:
            yield _finding(
                "dead", log.run, _column("q", joint), f"does not change, though the joint is told to move by "
                f"{np.ptp(told):.2g} {joint.unit}: a dead channel, or a joint without power; leave the run out",
            )  # fmt: skip
        if joint.unit == "rad" and _in_degrees(told, q):
            yield _finding(
                "unit", log.run, _column("command", joint), "is in degrees beside positions in rad; give it in rad"
            )
        if (still := _frozen(log.run, told, q)) is not None:
            yield _finding(
                "dead", log.run, _column("command", joint), f"does not change from {still:.4g} s on, though the joint "
                "goes on moving; log what the joint was told, or leave the run out",
            )  # fmt: skip


def _in_degrees(told: np.ndarray, q: np.ndarray) -> bool:
    slope = np.polyfit(q - q.mean(), told - told.mean(), 1)[0] if np.ptp(q) > 0 else 1.0
    follows = slope * q.std() >= _FOLLOWS * told.std()  # a joint that is stuck may have any slope
    return bool(_DEGREES[0] < slope < _DEGREES[1] and follows)


def _frozen(run: Run, told: np.ndarray, q: np.ndarray) -> float | None:
    """Return from when on, s, a command stands while its joint moves in both halves of that time: one falls once."""
    time = run.signals.time
    for still in stretches(np.diff(told) == 0):
        halves = np.array_split(q[still], 2)
        if time[still.stop] - time[still.start] >= _STANDS and all(np.ptp(half) > _UNMOVED for half in halves):
            return float(time[still.start])
    return None


def _by_joint(robot: Robot, logs: Sequence[_Log]) -> Iterator[LogFinding]:
    """Yield commands that go against the joint's positions in all runs, or are these."""
    run = logs[0].run
    for k, joint in enumerate(robot.joints):
        told, q = (
            np.concatenate([values[:, k] - values[:, k].mean() for values in some])
            for some in ([log.told for log in logs], [log.q for log in logs])
        )
        column, measured = _column("command", joint), _column("q", joint)
        if np.ptp(told) > _UNMOVED and all(np.array_equal(log.told[:, k], log.q[:, k]) for log in logs):
            yield _finding("copy", run, column, f"is {measured}; log what the joint was told")
        if told @ q < -_FOLLOWS * np.linalg.norm(told) * np.linalg.norm(q):
            yield _finding("sign", run, column, f"goes against {measured}, as in all runs; reverse the sign of one")


def _foreign(robot: Robot, logs: Sequence[_Log]) -> Iterator[LogFinding]:
    """Yield that the joints do not follow the commands."""
    joints = _followed(logs)
    left = _left(logs)[_BEHIND].min(axis=0).diagonal()[joints]
    if len(joints) and (1 - left).mean() < _FOREIGN:
        yield _finding(
            "foreign", logs[0].run, CHANNELS["command"].prefix + "_JOINT", "is not followed by the joints that it "
            "tells to move, as if it were of another run; leave the run out, or log what they were told",
        )  # fmt: skip


def _late(robot: Robot, logs: Sequence[_Log]) -> Iterator[LogFinding]:
    """Yield that commands come after the positions that follow them."""
    joints = _followed(logs)
    left = _left(logs)[:, joints, joints] + _LEFT
    if not len(joints):
        return
    behind, ahead = (left[some].min(axis=0) for some in (_BEHIND, _LAGS * _STEP <= -_LEAD))
    if np.log(behind / ahead).mean() > np.log(_GAIN):
        by = -_STEP * _LAGS[np.log(left).mean(axis=1).argmin()]
        yield _finding(
            "delay", logs[0].run, CHANNELS["command"].prefix + "_JOINT", f"comes some {by:.2g} s after the positions "
            "that follow it; give both by one clock",
        )  # fmt: skip


def _spans(logs: Sequence[_Log]) -> np.ndarray:
    """Return which joints are told to move, and which do (2, n)."""
    spans = [[np.ptp(values, axis=0) for values in (log.told, log.q)] for log in logs]
    return np.asarray(np.max(spans, axis=0) > _UNMOVED)


def _followed(logs: Sequence[_Log]) -> np.ndarray:
    """Return the joints that are told to move, and do."""
    return np.flatnonzero(_spans(logs).all(axis=0))


def _left(logs: Sequence[_Log]) -> np.ndarray:
    """Return by lag, command and position (L, n, n) which share of its squares commands leave; none of short runs."""
    both, of_told, of_q = (np.sum(some, axis=0) for some in zip(*(log.products for log in logs), strict=True))
    squares = of_told[:, :, None] * of_q
    return np.asarray(1 - np.divide(both**2, squares, out=np.zeros_like(both), where=squares > 0))


def _column(field: str, joint: Joint) -> str:
    return CHANNELS[field].column(joint.name)


def _finding(fault: str, run: Run, column: str, wrong: str) -> LogFinding:
    return LogFinding(fault, column, (run.name,), True, False, {}, f"{run.file}: column {column} {wrong}")
