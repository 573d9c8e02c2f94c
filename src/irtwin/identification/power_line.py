"""Power as a line in the joint torque about one: what a coefficient of real torque carries into power."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from irtwin.effects.effect import Effect, JointEffect, Predicted
from irtwin.effects.stack import Stack, expected
from irtwin.identification.accumulate import Columns, Given, Rows
from irtwin.signals.motion import Motion

Carried = TypeVar("Carried", np.ndarray, Columns)  # columns (N, r), or arrays of them to stand side by side

_STEP = 1e-2  # N m, exact for what is quadratic in torque
_STEP_OF_AXES = 1e-3  # W


@dataclass(frozen=True)
class PowerLine(Generic[Carried]):
    """The equation of power of N samples: carried @ x + free @ p + known = power, of r coefficients x of real torque.

    slope: (N, n) W/(N m), of power over each joint's torque; carried: (N, r); free: (N, F), of the coefficients p of
    power that are not fixed; known: (N,) W.
    """

    slope: np.ndarray
    carried: Carried
    free: np.ndarray
    known: np.ndarray


def power_line(
    stack: Stack,
    motion: Motion,
    carrying: Callable[[np.ndarray], Carried],
    torque: np.ndarray,
    power: np.ndarray,
    values: np.ndarray,
    told: np.ndarray | bool = False,
) -> PowerLine[Carried]:
    """Return the equation of power, linear in the coefficients of torque about the real `torque` (N, n).

    carrying: gives (N, R) what real columns carry by a slope; power: (N, L) columns of power on that torque; values:
    (L,) its coefficients; told: (N, n) where a log tells that torque, so that no coefficient does.
    """
    slope = np.where(told, 0.0, power_slope(stack, motion, torque, values))
    real = carrying(slope)
    fixed = expected(stack.power_terms)[stack.fixed]
    shifted = stack.shift_torque(motion, sparse=True)
    known = power[:, stack.fixed] @ fixed + (slope * (shifted - torque)).sum(axis=1)
    return PowerLine(slope, real, power[:, ~stack.fixed], known)


def carried(rows: Sequence[np.ndarray], slope: np.ndarray, pattern: np.ndarray, real: np.ndarray) -> np.ndarray:
    """Return (N, R) the power that each real column carries: what it has in each joint's `rows`, times the slope.

    `slope` (N, n) of power over each joint's torque; `pattern` (n, K) which columns the rows have; `real` (K,).
    """
    place = np.cumsum(real) - 1
    power = np.zeros((int(real.sum()), len(slope)))
    for own, rise, used in zip(rows, np.ascontiguousarray(slope.T), pattern, strict=True):
        for column, k in zip(own.T, np.flatnonzero(used), strict=True):
            if real[k]:
                power[place[k]] += rise * column
    return power.T


def power_slope(stack: Stack, motion: Motion, torque: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the slope of power over each joint's torque, (N, n) W/(N m), about `torque` (N, n); values: (L,)."""
    names = stack.robot.joint_names
    within = np.array([isinstance(effect, JointEffect) for effect, _ in stack.power_terms], dtype=bool)
    of_joint = np.array([[term.joint == name for name in names] for _, term in stack.power_terms], dtype=float)
    of_joint = of_joint.reshape(len(within), len(names)) * within[:, None]
    slope = power_rise(stack, motion, torque, np.ones(len(names))) @ (of_joint * values[:, None])
    if any(
        effect.needs == "torque" and not inside for (effect, _), inside in zip(stack.power_terms, within, strict=True)
    ):
        others = np.where(within, 0.0, values)
        for joint in range(len(names)):
            slope[:, joint] += power_rise(stack, motion, torque, np.eye(len(names))[joint]) @ others
    return np.asarray(slope)


def power_rise(stack: Stack, motion: Motion, torque: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Return the slope of the columns of power, (N, L), where the joints' torques (N, n) rise `along` (n,)."""
    step = _STEP * along
    rise = stack.power_columns(motion, torque + step) - stack.power_columns(motion, torque - step)
    return np.asarray(rise / (2 * _STEP))


def rise_over_axes(
    stack: Stack, effect: Effect, motion: Motion, torque: np.ndarray, axes: np.ndarray, values: np.ndarray
) -> np.ndarray:
    """Return by how much what an effect takes rises with the power of the axes, (N,) W/W, about `axes` (N,) W.

    values: (k,), the effect's coefficients. What depends on the past is taken as it is.
    """
    if effect.needs != "power" or effect.memory:
        return np.zeros(len(axes))
    more, less = (
        effect.columns(stack.robot, motion, Predicted(torque, axes + step, axes + step))
        for step in (_STEP_OF_AXES, -_STEP_OF_AXES)
    )
    return np.asarray((more - less) @ values / (2 * _STEP_OF_AXES))


def rows_of_both(
    stack: Stack,
    motion: Motion,
    columns: Sequence[Given],
    known: tuple[np.ndarray, np.ndarray],
    unsure: np.ndarray | bool = False,
) -> Rows:
    """Return the rows of the n equations of torque and, last, that of power; what was not measured is undecided.

    columns: those of each equation, as `Rows` takes them; known: (N, n) N m and (N,) W; unsure: (N,) where power does
    not hold.
    """
    torque, power = motion.torque, power_rows(motion, columns[-1], known[1], unsure)
    assert power.undecided is not None
    unknown = np.ones(motion.dq.shape, dtype=bool)
    return Rows(
        columns,
        np.column_stack(known),
        np.column_stack([np.zeros_like(motion.dq) if torque is None else torque, power.measured]),
        np.column_stack([unknown if torque is None else stack.undecided(motion), power.undecided]),
    )


def power_rows(motion: Motion, columns: Given, known: np.ndarray, unsure: np.ndarray | bool = False) -> Rows:
    """Return the last of these rows alone, those of power; arguments as above."""
    power = np.zeros_like(known) if motion.power is None else motion.power
    undecided = np.full(len(known), motion.power is None) | unsure
    return Rows([columns], known[:, None], power[:, None], undecided[:, None])
