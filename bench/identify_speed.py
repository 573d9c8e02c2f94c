"""What `identify` of a long log costs, beside a loop over Pinocchio's regressor and `numpy.linalg.lstsq`.

In bench/: `python identify_speed.py [SAMPLES] [--loop | --read]`, each way in a process of its own, as memory is its
most. `--read` is the bound by memory: all numbers of the log, read once.
"""

from __future__ import annotations

import os
import sys
import time
from dataclasses import replace

import numpy as np
import pinocchio as pin

from irtwin.effects.catalogue import BASELINE
from irtwin.robot.description import Robot
from irtwin.robot.urdf import read_urdf
from irtwin.signals.motion import Motion
from irtwin.twin.identify import identify
from memory import most_used
from plant.drawings import URDFS

RATE, CUTOFF = 1000.0, 50.0  # Hz


def log(robot: Robot, samples: int) -> Motion:
    """Return a motion of sums of sines, with torque and power that some robot would show."""
    rng, n = np.random.default_rng(0), len(robot.joints)
    at = np.arange(samples) / RATE
    speeds, phases = rng.uniform(0.5, 4.0, (3, n)), rng.uniform(0, 6, (3, n))
    angle = at[:, None, None] * speeds + phases
    q, dq, ddq = (part.sum(axis=1) for part in (np.sin(angle), speeds * np.cos(angle), -(speeds**2) * np.sin(angle)))
    data = robot.model.createData()
    torque = np.array([pin.rnea(robot.model, data, *state) for state in zip(q, dq, ddq, strict=True)])
    torque += 5 * np.sign(dq) + 8 * dq + rng.standard_normal(dq.shape)
    power = 120 + (torque * dq).sum(axis=1) + 1e-3 * (torque**2).sum(axis=1)
    return replace(Motion(at, q, dq, ddq, run="log", cutoff=CUTOFF), torque=torque, power=power)


def loop(robot: Robot, motion: Motion) -> np.ndarray:
    """Return the coefficients of bodies and friction as a script would fit them."""
    data, n = robot.model.createData(), len(robot.joints)
    rows = np.empty((len(motion.time), n, 12 * n))
    for row, q, dq, ddq in zip(rows, motion.q, motion.dq, motion.ddq, strict=True):
        row[:, : 10 * n] = pin.computeJointTorqueRegressor(robot.model, data, q, dq, ddq)
    rows[:, :, 10 * n : 11 * n] = np.eye(n) * np.sign(motion.dq)[:, None]
    rows[:, :, 11 * n :] = np.eye(n) * motion.dq[:, None]
    assert motion.torque is not None
    return np.asarray(np.linalg.lstsq(rows.reshape(-1, 12 * n), motion.torque.ravel())[0])


def read(motion: Motion) -> None:
    """Read all numbers of the log once."""
    for part in (motion.time, motion.q, motion.dq, motion.ddq, motion.torque, motion.power):
        assert part is not None
        part.ravel() @ part.ravel()


def _processor() -> float:
    """Return the seconds of processor that this process and its copies took."""
    return sum(os.times()[:4])


def main() -> None:
    """Time one way on one log."""
    words = [word for word in sys.argv[1:] if not word.startswith("--")]
    robot = read_urdf(URDFS / "kuka_kr6_r700.urdf")
    motion = log(robot, int(float(words[0])) if words else 200_000)
    began, used, before = time.perf_counter(), _processor(), most_used()
    if "--loop" in sys.argv:
        loop(robot, motion)
    elif "--read" in sys.argv:
        read(motion)
    else:
        identify(robot, [motion], [*BASELINE, "copper_loss"])
    wall, processor = time.perf_counter() - began, _processor() - used
    print(f"{wall:.2f} s, {processor:.2f} s of processor, {(most_used() - before) / 1e6:.0f} MB more than the log")


if __name__ == "__main__":
    main()
