"""Motions that a robot is programmed to do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class PlantLimits:
    """What the joints may do, (n,): positions in rad, speed in rad/s, acceleration in rad/s^2."""

    lower: np.ndarray
    upper: np.ndarray
    speed: np.ndarray
    acceleration: np.ndarray


@dataclass(frozen=True)
class PlantMotion:
    """Programmed positions, speeds and accelerations: (N, n) rad, rad/s, rad/s^2, one row a control step."""

    q: np.ndarray
    dq: np.ndarray
    ddq: np.ndarray

    def held(self, rows: int) -> PlantMotion:
        """Return the motion with its first pose held for `rows` steps before it starts."""
        rest = np.zeros((rows, self.q.shape[1]))
        return PlantMotion(
            np.vstack([np.repeat(self.q[:1], rows, axis=0), self.q]),
            np.vstack([rest, self.dq]),
            np.vstack([rest, self.ddq]),
        )


def programme(moves: Sequence[dict[str, Any]], limits: PlantLimits, step: float, cycles: int = 1) -> PlantMotion:
    """Return the motion of a list of point-to-point moves, repeated `cycles` times.

    A move has `to` (deg), `speed` (share of the robot's own limits), `pause` (s, after it) and `profile`
    ("quintic", the default, or "trapezoid"). The motion starts at the end of the last move.
    """
    at = np.radians(moves[-1]["to"])
    parts = []
    for move in list(moves) * cycles:
        to = np.radians(move["to"])
        parts.append(_point_to_point(at, to, move.get("speed", 1.0), move.get("profile", "quintic"), limits, step))
        parts.append(_pause(to, move.get("pause", 0.0), step))
        at = to
    return PlantMotion(*(np.vstack([getattr(part, field) for part in parts]) for field in ("q", "dq", "ddq")))


def _pause(q: np.ndarray, seconds: float, step: float) -> PlantMotion:
    rows = np.repeat(q[None], round(seconds / step), axis=0)
    return PlantMotion(rows, 0 * rows, 0 * rows)


_PEAKS = {"quintic": (1.875, 5.7735), "trapezoid": (1.5, 4.5)}  # peak speed and acceleration of a unit move


def _point_to_point(
    start: np.ndarray, end: np.ndarray, speed: float, profile: str, limits: PlantLimits, step: float
) -> PlantMotion:
    distance = end - start
    peak_speed, peak_acceleration = _PEAKS[profile]
    by_speed = peak_speed * np.abs(distance) / (speed * limits.speed)
    by_acceleration = np.sqrt(peak_acceleration * np.abs(distance) / (speed * limits.acceleration))
    rows = max(1, int(np.ceil(max(by_speed.max(), by_acceleration.max()) / step)))
    duration = rows * step
    s = np.arange(1, rows + 1)[:, None] / rows
    travelled, rate, acceleration = _quintic(s) if profile == "quintic" else _trapezoid(s)
    return PlantMotion(start + distance * travelled, distance * rate / duration, distance * acceleration / duration**2)


def _quintic(s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return (
        s**3 * (10 - 15 * s + 6 * s**2),
        30 * s**2 * (1 - s) ** 2,
        60 * s * (1 - s) * (1 - 2 * s),
    )


def _trapezoid(s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A third each of speeding up, steady speed and slowing down."""
    up, down = s < 1 / 3, s > 2 / 3
    travelled = np.where(up, 2.25 * s**2, np.where(down, 1 - 2.25 * (1 - s) ** 2, 1.5 * s - 0.25))
    rate = np.where(up, 4.5 * s, np.where(down, 4.5 * (1 - s), 1.5))
    return travelled, rate, 4.5 * (up.astype(float) - down.astype(float))


def check(motion: PlantMotion, limits: PlantLimits) -> None:
    """Raise ValueError where a motion asks more than the robot may do."""
    slack = 1 + 1e-6
    beyond = {
        "position": (motion.q < limits.lower) | (motion.q > limits.upper),
        "speed": np.abs(motion.dq) > slack * limits.speed,
        "acceleration": np.abs(motion.ddq) > slack * limits.acceleration,
    }
    for quantity, where in beyond.items():
        if where.any():
            row, joint = np.argwhere(where)[0]
            raise ValueError(f"joint {joint + 1} passes its {quantity} limit at step {row}")
