"""Do logged speeds agree with those of the positions? Where not, the latter are used."""

from __future__ import annotations

import numpy as np

from irtwin.check.moving import Moving
from irtwin.check.robust_fit import fit
from irtwin.robot.description import Robot
from irtwin.signals.channels import CHANNELS
from irtwin.signals.conditioning import differentiate
from irtwin.signals.filter import low_pass
from irtwin.signals.finding import LogFinding
from irtwin.signals.sampling import interpolated

_ALIKE = 0.9  # correlation of two speeds of one joint
_UNITS = {"deg/s": 180 / np.pi, "rpm": 30 / np.pi, "turns/s": 0.5 / np.pi}
_TIMES = {"ms": 1e3, "µs": 1e6, "ns": 1e9}
_NEAR = 0.03  # share by which a factor may miss a unit's
_SCALED = 1.15  # a gain beyond it, or its inverse, is another scale
_LATE = 0.008  # s: a shorter delay is a filter's
_SURE = 4.0  # standard deviations of a delay from none
_BEYOND = 2.0  # standard deviations by which it exceeds a filter's
_SLOW = 0.25  # of the cutoff, which is ten times the motion's band: above, derivatives are noise, which hides a delay

_Speeds = tuple[float, float, np.ndarray, np.ndarray]


def speed_findings(robot: Robot, moving: Moving) -> list[LogFinding]:
    """Return the speed channels that contradict the positions, or `time` where its unit alone explains it."""
    speeds = _speeds(moving)
    if not speeds:
        return []
    derived, logged = (np.vstack([of_run[place] for of_run in speeds]) for place in (2, 3))
    alike = _correlation(derived, logged)
    names = CHANNELS["dq"].columns(robot.joint_names)
    joints = np.flatnonzero(moving.joints).tolist()
    gains = {joint: _gain(derived[:, joint], logged[:, joint]) for joint in joints if abs(alike[joint, joint]) > _ALIKE}
    if (time := _time_unit(list(gains.values()), moving)) is not None:
        return [time]
    findings = []
    for joint in joints:
        name = names[joint]
        if np.ptp(logged[:, joint]) == 0:
            findings.append(_finding("dead", name, moving, {}, "never changes, though the joint moves"))
        elif (other := _exchanged(alike, joint)) is not None:
            if joint < other:
                advice = "stand in each other's columns: name them by their joints"
                findings.append(_finding("swap", f"{name} <-> {names[other]}", moving, {}, advice))
        elif joint in gains:
            findings += _scaled(name, gains[joint], moving) or _delayed(name, joint, moving, speeds)
        else:
            findings += _delayed(name, joint, moving, speeds)
    return findings


def _finding(fault: str, channel: str, moving: Moving, evidence: dict[str, float], problem: str) -> LogFinding:
    return LogFinding(
        fault, channel, moving.names, certain=True, mended=True, evidence=evidence,
        say=f"{channel} {problem}; the speeds of the positions are used instead",
    )  # fmt: skip


def _speeds(moving: Moving) -> list[_Speeds]:
    """Return rate and cutoff, Hz, of runs, and speeds (N, n) of their positions and as logged, filtered alike."""
    speeds = []
    for run, motion in zip(moving.runs, moving.motions, strict=True):
        if run.signals.dq is not None and motion.cutoff is not None:
            even = interpolated(run.signals.time, run.signals.dq, motion.time)
            logged = low_pass(even, motion.rate, motion.cutoff)
            speeds.append((motion.rate, motion.cutoff, differentiate(motion.q, motion.rate), logged))
    return speeds


def _correlation(derived: np.ndarray, logged: np.ndarray) -> np.ndarray:
    """Return (n, n): how alike the speed of joint a's positions and column b are."""
    a, b = derived - derived.mean(axis=0), logged - logged.mean(axis=0)
    sizes = np.outer(np.linalg.norm(a, axis=0), np.linalg.norm(b, axis=0))
    return np.asarray(np.divide(a.T @ b, sizes, out=np.zeros_like(sizes), where=sizes > 0))


def _exchanged(alike: np.ndarray, joint: int) -> int | None:
    """Return the joint whose speed stands in this one's column, and this one's in its; None where there is none."""
    other = int(np.argmax(alike[joint]))
    crossed, own = (alike[joint, other], alike[other, joint]), (alike[joint, joint], alike[other, other])
    return other if min(crossed) > _ALIKE and sum(crossed) > sum(np.abs(own)) else None


def _gain(derived: np.ndarray, logged: np.ndarray) -> float:
    return float(derived @ logged / (derived @ derived))


def _is(gain: float, factor: float) -> bool:
    return bool(abs(gain / factor - 1) < _NEAR)


def _time_unit(gains: list[float], moving: Moving) -> LogFinding | None:
    """Times in another unit make the positions' speeds smaller by its factor, those of all joints alike."""
    for unit, factor in _TIMES.items():
        if gains and all(_is(gain, factor) for gain in gains):
            evidence = {"factor": float(np.median(gains))}
            problem = f"is in {unit}: logged speeds are {factor:g} times those of the positions; convert it to s"
            return LogFinding("unit", "time", moving.names, True, False, evidence, f"time {problem}")
    return None


def _scaled(name: str, gain: float, moving: Moving) -> list[LogFinding]:
    evidence = {"gain": round(gain, 4)}
    for unit, factor in _UNITS.items():
        if _is(gain, factor):
            return [_finding("unit", name, moving, evidence, f"is in {unit}: convert it to rad/s")]
    if gain < 0:
        return [_finding("sign", name, moving, evidence, "has the sign opposite to that of its position")]
    if not 1 / _SCALED < gain < _SCALED:
        return [_finding("scale", name, moving, evidence, f"is {gain:.3g} times the speed of its position")]
    return []


def _delayed(name: str, joint: int, moving: Moving, speeds: list[_Speeds]) -> list[LogFinding]:
    """Return the finding where a logged speed comes late or early.

    For short delays d, the speed v(t - d) is v - d dv/dt.
    """
    columns, values = [], []
    for rate, cutoff, *both in speeds:
        derived, logged = (low_pass(speed[:, joint], rate, _SLOW * cutoff) for speed in both)
        columns.append(np.column_stack([derived, differentiate(derived, rate)]))
        values.append(logged)
    delay_fit = fit(np.vstack(columns), np.concatenate(values))
    gain, change = delay_fit.coefficients
    t = abs(delay_fit.t(np.array([0.0, 1.0])))
    if not gain or t < _SURE or abs(delay := float(-change / gain)) * (1 - _BEYOND / t) < _LATE:
        return []
    problem = f"comes {1000 * abs(delay):.3g} ms {'after' if delay > 0 else 'before'} the speed of its position"
    return [_finding("delay", name, moving, {"delay_ms": round(1000 * delay, 1), "t": round(t, 1)}, problem)]
