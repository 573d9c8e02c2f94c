"""Can the numbers be what they are said to be: positions in rad, times in s, power in W, masses in kg?"""

from __future__ import annotations

import math

import numpy as np

from irtwin.check.moving import Moving
from irtwin.robot.description import Joint, Robot
from irtwin.robot.model import inverse_dynamics
from irtwin.signals.channels import CHANNELS
from irtwin.signals.finding import LogFinding
from irtwin.signals.log import DataSet
from irtwin.signals.motion import Motion
from irtwin.signals.sampling import interval

_FARTHEST = 30.0  # m between two joints: no arm has a longer link
_HEAVIEST = 1.5  # times the robot's own mass: no arm carries more
_SLOWEST = 0.5  # s between samples that show a motion
_CREEPING = 0.01  # of a joint's speed limit
_ELECTRICAL = 0.1  # of the greatest mechanical power: less electrical power cannot make it
_KILO = 1000.0
_MECHANICAL = 1.0  # W: less is friction's and noise's


def plausibility_findings(data_set: DataSet, moving: Moving) -> list[LogFinding]:
    """Return what cannot be, by the robot's own sizes and limits."""
    findings = [
        urdf_finding(data_set.robot),
        _payload(data_set),
        *(_position(moving, index, joint) for index, joint in enumerate(data_set.robot.joints)),
        _time(data_set.robot, moving),
        _power(data_set.robot, moving),
    ]
    return [finding for finding in findings if finding is not None]


def urdf_finding(robot: Robot) -> LogFinding | None:
    """Return the finding where a description's lengths are no metres."""
    longest = max((float(np.linalg.norm(at.translation)) for at in robot.model.jointPlacements), default=0.0)
    if longest < _FARTHEST:
        return None
    say = f"robot.urdf puts two joints {longest:.4g} m apart: it looks like millimetres; give lengths in m"
    return LogFinding("implausible", "robot.urdf", (), True, False, {"length_m": longest}, say)


def _payload(data_set: DataSet) -> LogFinding | None:
    own = data_set.robot.weight or sum(link.mass for link in data_set.robot.links)
    heavy = [run for run in data_set.runs if own > 0 and run.payload_mass > _HEAVIEST * own]
    if not heavy:
        return None
    mass = max(run.payload_mass for run in heavy)
    say = f"payload_mass = {mass:g} is more than a robot of {own:.3g} kg can carry: it looks like g; give kg"
    names = tuple(run.name for run in heavy)
    return LogFinding("unit", "payload_mass", names, True, False, {"payload_kg": mass, "robot_kg": own}, say)


def _position(moving: Moving, index: int, joint: Joint) -> LogFinding | None:
    """Positions in degrees leave the joint's range and speed far behind."""
    if joint.kind == "prismatic":
        return None
    for run in moving.runs:
        time, q = run.signals.time, run.signals.q[:, index]
        speed = float(np.quantile(np.abs(np.diff(q) / np.diff(time)), 0.99))
        bounds, spans = joint.upper - joint.lower, float(np.ptp(q))
        too_fast = math.isfinite(joint.velocity) and speed > 4 * joint.velocity
        too_far = math.isfinite(bounds) and bounds > 0 and spans > 1.5 * bounds
        unbounded = not math.isfinite(bounds) and spans > 100
        if too_far or unbounded or (too_fast and np.abs(q).max() > 2 * np.pi):
            name = CHANNELS["q"].column(joint.name)
            say = (
                f"{run.file}: column {name} spans {spans:.3g} at up to {speed:.3g} per second, far beyond the joint's "
                "limits in rad: it looks like degrees; convert it to rad"
            )
            return LogFinding("unit", name, (run.name,), True, False, {"span": spans, "speed": speed}, say)
    return None


def _time(robot: Robot, moving: Moving) -> LogFinding | None:
    """Times in ms make every motion a thousand times slower."""
    limits = np.array([joint.velocity for joint in robot.joints])
    slow = [
        run for run, motion in zip(moving.runs, moving.motions, strict=True)
        if interval(run.signals.time) > _SLOWEST and (np.abs(motion.dq).max(axis=0) < _CREEPING * limits).all()
    ]  # fmt: skip
    if not slow or len(slow) < len(moving.runs) or not np.isfinite(limits).all():
        return None
    step = interval(slow[0].signals.time)
    say = (
        f"{slow[0].file}: a sample every {step:.3g} s, and every joint slower than 1 % of its speed limit: time looks "
        "like ms; convert it to s"
    )
    return LogFinding("unit", "time", tuple(run.name for run in slow), True, False, {"interval_s": step}, say)


def _power(robot: Robot, moving: Moving) -> LogFinding | None:
    """Electrical power far below what the joints do is in kW, far beyond it in mW."""
    pairs = [(motion.power, _done(robot, motion)) for motion in moving.motions if motion.power is not None]
    if not pairs:
        return None
    power, done = (float(np.quantile(np.concatenate(parts), 0.99)) for parts in zip(*pairs, strict=True))
    if done < _MECHANICAL or not power > 0:
        return None
    in_kilowatts = power < _ELECTRICAL * done and power * _KILO > done
    in_milliwatts = power > 100 * _KILO * done or (power > _KILO * done and power > 200 * _KILO)
    if not (in_kilowatts or in_milliwatts):
        return None
    unit = "kW" if in_kilowatts else "mW"
    say = f"power reaches {power:.3g} where the joints do {done:.3g} W: it looks like {unit}; convert it to W"
    return LogFinding("unit", "power", moving.names, True, False, {"power": power, "mechanical_w": done}, say)


def _done(robot: Robot, motion: Motion) -> np.ndarray:
    """Return the power that the joints put into the motion, W (N,); by the URDF's bodies where no torque was logged."""
    torque = motion.torque
    if torque is None:
        torque = inverse_dynamics(robot.model, motion.q, motion.dq, motion.ddq)
    return np.asarray(np.maximum(np.sum(torque * motion.dq, axis=1), 0.0))
