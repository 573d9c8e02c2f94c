"""The pseudo-inertia of a body: positive definite where some mass, spread in space, is that body (Wensing 2018)."""

from __future__ import annotations

import numpy as np

_AXES = ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))  # of an inertia's six numbers, in Pinocchio's order
_CONSISTENT = 1e-10  # of the largest: a smaller eigenvalue of a scaled pseudo-inertia is none


def _basis() -> np.ndarray:
    """Return (10, 4, 4): the pseudo-inertia of a unit of each inertial parameter, in Pinocchio's order."""
    units = np.zeros((10, 4, 4))
    units[0, 3, 3] = 1.0
    for axis in range(3):
        units[1 + axis, axis, 3] = units[1 + axis, 3, axis] = 1.0
    for unit, (row, column) in zip(units[4:], _AXES, strict=True):
        unit[row, column] = unit[column, row] = -1.0
        if row == column:
            unit[:3, :3] += np.eye(3) / 2
    return units


BASIS = _basis()


def pseudo_inertias(bodies: np.ndarray) -> np.ndarray:
    """Return (n, 4, 4): second moments, kg m^2, first moments, kg m, and mass, kg, of inertial parameters (n, 10)."""
    return np.asarray(np.tensordot(bodies, BASIS, 1))


def inertial_parameters(pseudo: np.ndarray) -> np.ndarray:
    """Return the inertial parameters (n, 10) of pseudo-inertias (n, 4, 4), in Pinocchio's order."""
    second = pseudo[:, :3, :3]
    inertia = np.trace(second, axis1=1, axis2=2)[:, None, None] * np.eye(3) - second
    return np.column_stack([pseudo[:, 3, 3], pseudo[:, :3, 3], *(inertia[:, row, column] for row, column in _AXES)])


def consistent(bodies: np.ndarray) -> np.ndarray:
    """Return (n,) whether some mass, spread in space, has the inertial parameters (n, 10)."""
    pseudo = pseudo_inertias(bodies)
    size = np.sqrt(np.abs(np.diagonal(pseudo, axis1=1, axis2=2)))
    scaled = pseudo / np.maximum(size[:, :, None] * size[:, None, :], np.finfo(float).tiny)
    return np.asarray(np.linalg.eigvalsh(scaled)[:, 0] > _CONSISTENT)
