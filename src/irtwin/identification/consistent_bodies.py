"""Physically consistent bodies: of positive definite pseudo-inertia, and as near to what torque asks for as any.

What torque leaves open is decided by the robot's description: the divergence of each body from its own there,
D = tr(P P0^-1) - log det(P P0^-1) - 4 of pseudo-inertias P (Lee and Park 2018), is the pull of a weak prior and the
barrier of the cone (Wensing, Kim and Slotine 2018) in one, whatever the units and frames. So the problem is convex and
smooth, and Newton's method along its path solves it; no solver of semidefinite programs is needed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy

from irtwin.effects.rigid_body import RigidBody
from irtwin.effects.stack import Stack
from irtwin.identification.accumulate import triangle
from irtwin.identification.estimators import Estimate
from irtwin.identification.fits import Terms
from irtwin.robot.pseudo_inertia import BASIS, inertial_parameters, pseudo_inertias

PULL = 1.0  # times a body's divergence, as much as half a squared deviation of the data
_THINNEST = 0.05  # of a link's length: the least radius of gyration of a described body
_FASTER = 0.1  # how the pull shrinks along the path
_NEAR = 0.3  # Newton's decrement, over the root of the pull, below which it may shrink
_DONE = 1e-6  # the same, at the end
_STEPS = 400
_INSIDE = 0.9  # of the way to the edge of consistent bodies


@dataclass(frozen=True)
class _Problem:
    """Equations `left` @ x = `right` (K,) of noise one; x[places] (n, 10) are bodies, pulled to `described`'s."""

    left: np.ndarray
    right: np.ndarray
    places: np.ndarray
    described: np.ndarray  # (n, 4, 4) inverse pseudo-inertias

    def value(self, x: np.ndarray, pull: float) -> float:
        """Return what is to be least; infinite where a body is not consistent."""
        pseudo = pseudo_inertias(x[self.places])
        try:
            roots = np.linalg.cholesky(pseudo)
        except np.linalg.LinAlgError:
            return np.inf
        volume = 2 * np.log(np.diagonal(roots, axis1=1, axis2=2)).sum()
        apart = np.einsum("nij,nji->", pseudo, self.described) - volume
        return float(np.sum((self.left @ x - self.right) ** 2) / 2 + pull * apart)

    def step(self, x: np.ndarray, pull: float, free: np.ndarray) -> tuple[np.ndarray, float]:
        """Return Newton's step of the `free` (K,) ones, others zero, and its decrement.

        The Hessian of -log det is a sum of squares, so the step is one of least squares, and none is squared.
        """
        roots = np.linalg.cholesky(pseudo_inertias(x[self.places]))
        inverse = np.linalg.inv(roots)
        moved = np.einsum("nij,ajk,nlk->nila", inverse, BASIS, inverse).reshape(len(roots), 16, 10)
        excess = roots.transpose(0, 2, 1) @ self.described @ roots - np.eye(4)
        barrier = np.zeros((len(roots), 16, len(x)))
        for own, block, place in zip(barrier, moved, self.places, strict=True):
            own[:, place] = block
        weight = np.sqrt(pull)
        rows = np.concatenate([self.left, weight * barrier.reshape(-1, len(x))])[:, free]
        target = np.concatenate([self.right - self.left @ x, -weight * excess.ravel()])
        size = np.linalg.norm(rows, axis=0)
        factor = triangle(np.column_stack([rows / size, target]))
        step = np.zeros(len(x))
        step[free] = scipy.linalg.solve_triangular(factor[:-1, :-1], factor[:-1, -1]) / size
        return step, float(np.linalg.norm(factor[:-1, -1]))


def with_consistent_bodies(stack: Stack, terms: Terms, fit: Estimate) -> Estimate:
    """Return the estimate of terms (K) that is best with consistent bodies; as it is where there are none."""
    places = _places(terms)
    if not len(places):
        return fit
    described = described_bodies(stack)
    problem = _Problem(fit.equations[:, :-1], fit.equations[:, -1], places, np.linalg.inv(described))
    lowest = np.array([term.lowest for _, term in terms])
    x = fit.values.copy()
    x[places] = inertial_parameters(described)
    free = x > lowest
    while True:
        solved = _solved(problem, x, free)
        below = free & (solved < lowest)
        if not below.any():
            return replace(fit, values=solved)
        x, free = np.where(below, lowest, solved), free & ~below


def spreads(stack: Stack, terms: Terms) -> np.ndarray:
    """Return (K,) the standard deviation of each term that is known before any data: of bodies by the pull, too."""
    deviations, places = np.array([term.spread for _, term in terms]), _places(terms)
    if len(places):
        inverse = np.linalg.inv(described_bodies(stack))
        known = PULL * np.einsum("nij,ajk,nkl,bli->nab", inverse, BASIS, inverse, BASIS)
        widths = np.sqrt(np.diagonal(np.linalg.inv(known), axis1=1, axis2=2))
        deviations[places] = np.minimum(deviations[places], widths)
    return deviations


def _places(terms: Terms) -> np.ndarray:
    """Return (n, 10) where the terms of bodies stand."""
    return np.array([place for place, (effect, _) in enumerate(terms) if effect.bodies], dtype=int).reshape(-1, 10)


def described_bodies(stack: Stack) -> np.ndarray:
    """Return (n, 4, 4) the pseudo-inertias of the robot's bodies as its description has them.

    A body without mass gets what the robot's weight leaves for each; one without extent a small one.
    """
    terms = RigidBody().terms(stack.robot)
    pseudo = pseudo_inertias(np.array([term.expected for term in terms]).reshape(-1, 10))
    arm = terms[1].spread / terms[0].spread
    mass = np.maximum(pseudo[:, 3, 3], 0.0)
    mass = np.where(mass > 0, mass, terms[0].spread / (2 * len(pseudo)))
    centre = pseudo[:, :3, 3] / mass[:, None]
    shape = pseudo[:, :3, :3] / mass[:, None, None] - centre[:, :, None] * centre[:, None, :]
    extents, axes = np.linalg.eigh(shape)
    extents = np.maximum(extents, (_THINNEST * arm) ** 2)
    shape = np.einsum("nij,nj,nkj->nik", axes, extents, axes) + centre[:, :, None] * centre[:, None, :]
    return np.asarray(
        np.block([[shape, centre[:, :, None]], [centre[:, None, :], np.ones((len(mass), 1, 1))]]) * mass[:, None, None]
    )


def _solved(problem: _Problem, x: np.ndarray, free: np.ndarray) -> np.ndarray:
    """Return the x of least value, from one of consistent bodies, by a pull that shrinks to what it is."""
    misfit = float(np.sum((problem.left @ x - problem.right) ** 2))
    now = max(PULL, misfit / len(x))
    for _ in range(_STEPS):
        step, decrement = problem.step(x, now, free)
        x = _moved(problem, x, step, decrement, now)
        if now == PULL and decrement < _DONE * np.sqrt(PULL):
            break
        if decrement < _NEAR * np.sqrt(now):
            now = max(PULL, _FASTER * now)
    return x


def _moved(problem: _Problem, x: np.ndarray, step: np.ndarray, decrement: float, pull: float) -> np.ndarray:
    """Return x moved along a step, as far as bodies stay consistent and the value falls as it should."""
    roots = np.linalg.inv(np.linalg.cholesky(pseudo_inertias(x[problem.places])))
    change = roots @ pseudo_inertias(step[problem.places]) @ roots.transpose(0, 2, 1)
    shrinks = -float(np.linalg.eigvalsh(change)[:, 0].min())
    length = min(1.0, _INSIDE / shrinks) if shrinks > 0 else 1.0
    before = problem.value(x, pull)
    while length > _DONE and problem.value(x + length * step, pull) > before - 0.1 * length * decrement**2:
        length /= 2
    return x + length * step
