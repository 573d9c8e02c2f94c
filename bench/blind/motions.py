"""Motions of a case: exciting ones (Fourier series that start and end at rest) and work cycles."""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from irtwin.demo.plant.machine import Drawings
from irtwin.demo.plant.motion import PlantMotion, programme

HARMONICS = 5
JERK_TIME = 0.08  # s


def exciting(drawings: Drawings, seconds: float, reach: float, speed: float, rng: np.random.Generator) -> PlantMotion:
    """Return a random Fourier motion of all joints; `reach` and `speed` are shares of the limits."""
    limits = drawings.limits
    n = len(limits.lower)
    w = 2 * np.pi / seconds * np.arange(1, HARMONICS + 1)
    time = drawings.step * np.arange(round(seconds / drawings.step))
    sine, cosine = rng.standard_normal((2, HARMONICS, n)) / np.arange(1, HARMONICS + 1)[:, None] ** 0.5
    sine -= w[:, None] * (w @ sine) / (w @ w)  # at rest at both ends
    cosine -= (w**2)[:, None] * (w**2 @ cosine) / (w**2 @ w**2)
    sin, cos = np.sin(np.outer(time, w)), np.cos(np.outer(time, w))
    q, dq, ddq = (
        sin @ sine + cos @ cosine,
        (cos * w) @ sine - (sin * w) @ cosine,
        -(sin * w**2) @ sine - (cos * w**2) @ cosine,
    )
    half = np.minimum((limits.upper - limits.lower) / 2, 1.6)
    middle = (limits.upper + limits.lower) / 2
    scale = np.minimum(
        reach * half / (np.ptp(q, axis=0) / 2),
        np.minimum(speed * limits.speed / np.abs(dq).max(0), speed * limits.acceleration / np.abs(ddq).max(0)),
    )
    centre = middle - scale * (q.max(0) + q.min(0)) / 2
    return PlantMotion(centre + scale * q, scale * dq, scale * ddq)


def work(drawings: Drawings, seconds: float, joints: int, speed: float, rng: np.random.Generator) -> PlantMotion:
    """Return point-to-point moves between four poses with pauses; only the first `joints` joints move."""
    limits = drawings.limits
    middle, half = (limits.upper + limits.lower) / 2, np.minimum((limits.upper - limits.lower) / 2, 1.3)
    moving = np.arange(len(middle)) < joints
    poses = [middle + moving * half * rng.uniform(-0.8, 0.8, len(middle)) for _ in range(4)]
    moves = [
        {"to": np.degrees(pose), "speed": speed, "pause": pause, "profile": profile}
        for pose, pause, profile in zip(poses, (0.3, 1.2, 0.0, 0.6), ("quintic", "trapezoid") * 2, strict=True)
    ]
    motion = programme(moves, limits, drawings.step, cycles=12)
    rows = round(seconds / drawings.step)
    smooth = [_without_jerks(getattr(motion, name), round(JERK_TIME / drawings.step)) for name in ("q", "dq", "ddq")]
    return PlantMotion(*(signal[:rows] for signal in smooth))


def _without_jerks(signal: np.ndarray, steps: int) -> np.ndarray:
    """Return the mean over the last `steps` steps: accelerations then change no faster than a controller lets them."""
    before = np.repeat(signal[:1], steps - 1, axis=0)
    return sliding_window_view(np.concatenate([before, signal]), steps, axis=0).mean(axis=-1)
