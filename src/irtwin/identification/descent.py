"""Quasi-Newton descent inside a region: a step that leaves it costs infinity and is shortened."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

Cost = Callable[[np.ndarray], tuple[float, np.ndarray]]

_SUFFICIENT = 1e-4  # Armijo's share of the promised decrease
_SHORTEN = 0.4
_SHORTEST = 1e-8


def descend(cost: Cost, start: np.ndarray, iterations: int, tolerance: float = 1e-4) -> Iterator[np.ndarray]:
    """Yield ever better points, (k,) each, by BFGS with backtracking.

    `cost` gives value and gradient, or an infinite value outside the region; `start` lies inside. Ends after
    `iterations` steps, or where a step gains less than `tolerance` or no step helps.
    Source: Nocedal and Wright, Numerical Optimization, 2006, section 6.1.
    """
    x = start
    value, gradient = cost(x)
    inverse: np.ndarray | None = None
    for _ in range(iterations):
        if inverse is None:
            direction = -gradient * (0.01 * np.linalg.norm(x) / np.linalg.norm(gradient))
        else:
            direction = -inverse @ gradient
        slope = float(direction @ gradient)
        if slope >= 0:
            return
        length = 1.0
        while True:
            new_value, new_gradient = cost(x + length * direction)
            if new_value < value + _SUFFICIENT * length * slope:
                break
            length *= _SHORTEN
            if length < _SHORTEST:
                return
        step, change = length * direction, new_gradient - gradient
        inverse = _update(inverse, step, change)
        gain = value - new_value
        x, value, gradient = x + step, new_value, new_gradient
        yield x
        if gain < tolerance:
            return


def _update(inverse: np.ndarray | None, step: np.ndarray, change: np.ndarray) -> np.ndarray | None:
    """Return the inverse Hessian, (k, k), that maps the gradient's change to the step (BFGS)."""
    curvature = float(step @ change)
    if curvature <= 1e-10 * np.linalg.norm(step) * np.linalg.norm(change):
        return inverse
    if inverse is None:
        inverse = np.eye(len(step)) * (curvature / float(change @ change))
    turned = inverse @ change
    scale = (1 + float(change @ turned) / curvature) / curvature
    return inverse + scale * np.outer(step, step) - (np.outer(turned, step) + np.outer(step, turned)) / curvature
