"""Transient effects: those with a start or a stop, so that joints have to agree on them, not runs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irtwin.effects.effect import Effect
from irtwin.effects.load import ExternalContact


@dataclass(frozen=True)
class Transient:
    """A contact: `effect` has its runs, start and stop.

    gain: squares explained in a joint, in units of the noise's, predicted from the other joints, over the runs (R, n);
    t: between joints and runs, of the gain or of its share; p: of the search as a whole.
    """

    effect: ExternalContact
    gain: np.ndarray
    t: float
    p: float


def is_transient(effect: Effect) -> bool:
    """Return whether an effect has a start or a stop, so that joints have to agree on it, not runs."""
    return isinstance(effect, ExternalContact) and bool(np.isfinite([effect.start, effect.stop]).any())
