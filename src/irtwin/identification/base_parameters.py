"""Base parameters: the combinations of coefficients that torque can show at all."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irtwin.effects.effect import Term
from irtwin.effects.stack import Stack
from irtwin.signals.motion import Motion

_STATES = 200  # random ones, many more rows than columns
_INDEPENDENT = 1e-7  # of a scaled column: the rest of it outside the span of those before
_VISIBLE = 1e-6  # of a grouping coefficient


@dataclass(frozen=True)
class BaseParameters:
    """B base parameters of K coefficients: base = `grouping` @ coefficients, (B, K).

    `independent` (B,) are the columns that span the rest: columns @ coefficients = columns[:, independent] @ base.
    """

    terms: tuple[Term, ...]
    independent: np.ndarray
    grouping: np.ndarray

    def names(self) -> tuple[str, ...]:
        """Return each combination, readable: "Izz_2 + Ia_2 + 0.101 m_3"."""
        return tuple(self._name(row) for row in self.grouping)

    def _name(self, row: np.ndarray) -> str:
        order = np.argsort(-np.isin(np.arange(len(row)), self.independent).astype(int), kind="stable")
        parts = [_part(row[k], _label(self.terms[k])) for k in order if abs(row[k]) > _VISIBLE]
        return " ".join(parts).removeprefix("+ ")


def base_parameters(stack: Stack) -> BaseParameters:
    """Find the base parameters of a robot and its effects, numerically (Gautier 1991, QR).

    Columns are taken from the base to the tip, mass last within a link, rotor inertia after it: what depends is
    grouped into links nearer to the base.
    """
    robot = stack.robot
    terms = tuple(term for _, term in stack.torque_terms)
    rng = np.random.default_rng(0)
    n = len(robot.joints)
    speeds = rng.uniform(-2, 2, (_STATES, n))
    positions, accelerations = rng.uniform(-3, 3, (_STATES, n)), rng.uniform(-5, 5, (_STATES, n))
    states = Motion(np.arange(float(_STATES)), positions, speeds, accelerations, run="random")
    columns = stack.torque_columns(states).reshape(_STATES * n, len(terms))
    order = sorted(range(len(terms)), key=lambda k: _rank(terms[k], robot.joint_names))
    norms = np.linalg.norm(columns, axis=0)
    norms[norms < _VISIBLE * norms.max(initial=0.0)] = 0.0  # an angle of 1.5708 is a right one
    basis = np.zeros((len(columns), 0))
    independent: list[int] = []
    for k in order:
        if norms[k] == 0:
            continue
        rest = columns[:, k] / norms[k]
        for _ in range(2):  # twice is enough for orthogonality
            rest = rest - basis @ (basis.T @ rest)
        if np.linalg.norm(rest) > _INDEPENDENT:
            independent.append(k)
            basis = np.column_stack([basis, rest / np.linalg.norm(rest)])
    scale = norms[independent]
    grouping = np.linalg.lstsq(columns[:, independent] / scale, columns, rcond=None)[0] / scale[:, None]
    grouping[np.abs(grouping) < _VISIBLE] = 0.0
    return BaseParameters(terms, np.array(independent, dtype=int), grouping)


def condition_number(factor: np.ndarray, base: BaseParameters) -> float:
    """Return the condition number of the base regressor with columns scaled to one.

    `factor`: (r, K) triangular factor of the torque regressor. Infinite where the motion leaves a column empty; one
    where there is no column, and so nothing to tell apart.
    """
    columns = factor[:, base.independent]
    if columns.shape[1] == 0:
        return 1.0
    norms = np.linalg.norm(columns, axis=0)
    if np.any(norms == 0):
        return float("inf")
    return float(np.linalg.cond(columns / norms))


def _rank(term: Term, joints: tuple[str, ...]) -> tuple[int, int, int]:
    joint = joints.index(term.joint) if term.joint else len(joints)
    return (term.link is None, joint, 1 if term.name == "m" else 0)


def _label(term: Term) -> str:
    place = term.link or term.joint
    return f"{term.name}_{place}" if place else term.name


def _part(coefficient: float, label: str) -> str:
    size = abs(coefficient)
    factor = "" if abs(size - 1) < _VISIBLE else f"{size:.3g} "
    return f"{'-' if coefficient < 0 else '+'} {factor}{label}"
