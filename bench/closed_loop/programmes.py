"""Programmes that a robot is given: many sines at once, and picking and placing by way of points in joint space."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np
from scipy.interpolate import CubicSpline

from closed_loop.machine import Machine

HALF = 1.3  # rad, most that a joint moves to either side
SPEED, ACCELERATION = 1.6, 6.0  # rad/s and rad/s^2, peaks
AT_HOME, MOST = 0.3, 0.75  # shares of the drives' torque that a pose and a programme may take
SINES = 6
LOOKED_AT = 10  # steps from one sample whose torque is looked at to the next
RISE = 1.5  # s, in which sines grow and fade


@dataclass(frozen=True)
class Programme:
    """Positions wanted at each step, their speeds and accelerations, (T, n) each."""

    q: np.ndarray
    dq: np.ndarray
    ddq: np.ndarray

    def every(self, stride: int) -> Programme:
        return Programme(self.q[::stride], self.dq[::stride], self.ddq[::stride])


Draft = Callable[[float, float], Programme]  # of a reach and a pace


def exciting(machine: Machine, seconds: float, rng: np.random.Generator) -> Programme:
    """Return sines of drawn frequencies and phases in every joint, at rest at both ends."""
    n = len(machine.model.joints)
    frequency = np.exp(rng.uniform(np.log(0.08), np.log(0.7), (SINES, n)))
    phase, size = rng.uniform(0, 2 * np.pi, (SINES, n)), rng.uniform(0.3, 1.0, (SINES, n)) / frequency**0.7
    middle, half = _home(machine, rng)

    def draft(reach: float, pace: float) -> Programme:
        time = machine.step * np.arange(round(seconds / machine.step))
        waves = np.sin(2 * np.pi * pace * frequency * time[:, None, None] + phase)
        q = (size * waves).sum(axis=1) * _window(time)[:, None]
        q *= reach * half / np.abs(q).max(axis=0)
        return _derived(middle + q, machine.step)

    return _within(machine, draft)


def working(machine: Machine, seconds: float, rng: np.random.Generator) -> Programme:
    """Return moves from pose to pose by way of a point, with a pause at each pose, over and over."""
    middle, half = _home(machine, rng)
    n, poses = len(middle), int(rng.integers(3, 6))
    places = rng.uniform(-0.9, 0.9, (poses, n))
    ways = [(a + b) / 2 + rng.uniform(-0.15, 0.15, n) for a, b in zip(places, np.roll(places, -1, axis=0), strict=True)]
    pauses, speeds = rng.uniform(0.1, 0.9, poses), rng.uniform(0.5, 1.0, poses)

    def draft(reach: float, pace: float) -> Programme:
        parts, rows, leg = [np.repeat(places[:1], round(0.3 / machine.step), axis=0)], 0, 0
        while rows < round(seconds / machine.step):
            here, there = places[leg % poses], places[(leg + 1) % poses]
            longest = np.max(np.abs(there - here) * half) * reach
            duration = max(1.875 * longest / SPEED, np.sqrt(5.8 * longest / ACCELERATION)) / speeds[leg % poses] / pace
            s = np.linspace(0, 1, max(round(1.15 * duration / machine.step), 2))
            through = CubicSpline([0, 0.5, 1], [here, ways[leg % poses], there])
            pause = np.repeat(there[None], round(pauses[leg % poses] / machine.step), axis=0)
            parts += [through(s**3 * (10 - 15 * s + 6 * s**2)), pause]
            rows, leg = sum(map(len, parts)), leg + 1
        q = np.concatenate(parts)[: round(seconds / machine.step)]
        return _derived(middle + reach * half * np.clip(q, -1, 1), machine.step)

    return _within(machine, draft)


def _home(machine: Machine, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return a pose that the drives hold with ease, and how far each joint goes from it, (n,) rad each."""
    lower, upper = machine.model.lower, machine.model.upper
    for _ in range(200):
        pose = (lower + upper) / 2 + rng.uniform(-0.5, 0.5, len(lower)) * np.minimum((upper - lower) / 2, 2.0)
        still = Programme(pose[None], *np.zeros((2, 1, len(lower))))
        if (np.abs(forward(machine, still)) < AT_HOME * machine.model.torque).all():
            return pose, np.minimum(0.9 * np.minimum(upper - pose, pose - lower), HALF)
    raise RuntimeError(f"{machine.model.name}: no pose within its torque")


def _window(time: np.ndarray) -> np.ndarray:
    s = np.clip(np.minimum(time, time[-1] - time) / RISE, 0, 1)
    return np.asarray(s**3 * (10 - 15 * s + 6 * s**2))


def _derived(q: np.ndarray, step: float) -> Programme:
    dq = np.gradient(q, step, axis=0)
    return Programme(q, dq, np.gradient(dq, step, axis=0))


def _within(machine: Machine, draft: Draft) -> Programme:
    """Slow a programme down, and draw it in, until speeds and torque are what the drives can give."""
    reach, pace = 1.0, 1.0
    for _ in range(40):
        programme = draft(reach, pace)
        fast = np.abs(programme.dq).max() > SPEED * 1.1
        forced = np.abs(programme.ddq).max() > ACCELERATION * 2
        heavy = (np.abs(forward(machine, programme.every(LOOKED_AT))) > MOST * machine.model.torque).any()
        if not (fast or forced or heavy):
            return programme
        pace *= 0.88
        reach *= 0.92 if heavy else 0.96
    raise RuntimeError(f"{machine.model.name}: no such programme within its torque")


def forward(machine: Machine, programme: Programme) -> np.ndarray:
    """Return the torque that the nominal model gives for a programme, (T, n) N m."""
    model, data = machine.nominal, mujoco.MjData(machine.nominal)
    out = np.empty_like(programme.q)
    for row, state in enumerate(zip(programme.q, programme.dq, programme.ddq, strict=True)):
        data.qpos[:], data.qvel[:], data.qacc[:] = state
        mujoco.mj_inverse(model, data)
        out[row] = data.qfrc_inverse
    return np.asarray(out + machine.friction_forward * programme.dq)
