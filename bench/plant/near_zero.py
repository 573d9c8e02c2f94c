"""Laws of dry friction about zero speed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

# how much of dry friction there is, by speed over a width: none of them is the form that a twin has
LAWS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "sharp": np.ones_like,
    "tanh": np.tanh,
    "arctangent": lambda u: 2 / np.pi * np.arctan(u),
    "root": lambda u: u / np.sqrt(1 + u**2),
    "ramp": lambda u: np.minimum(u, 1.0),
}


@dataclass(frozen=True)
class NearZero:
    """The law of dry friction about zero speed: one of `LAWS`, over a width of each joint, (n,) rad/s."""

    law: str
    width: np.ndarray

    def share(self, dq: np.ndarray) -> np.ndarray:
        """Return the part of dry friction that there is at speeds (..., n), 0 to 1."""
        return np.asarray(LAWS[self.law](np.abs(dq) / self.width))
