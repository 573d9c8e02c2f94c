"""Whether what changed is really new: reference runs must lack it."""

from __future__ import annotations

from collections.abc import Sequence, Set

import numpy as np

from irtwin.gap.isolation.cause import Cause, gains, rows
from irtwin.gap.regression.cross_validation import attempt
from irtwin.gap.regression.hypotheses import CHANGED, Variant
from irtwin.gap.regression.normal_equations import System
from irtwin.gap.thresholds import Changes


def shown_before(
    system: System, causes: Sequence[Cause], noise: np.ndarray, inside: Set[str], limits: Changes
) -> frozenset[str]:
    """Return the effects among the causes that are said to have changed, but act in the reference runs as well.

    Each is fitted to all runs alike, beside the other causes; equations weighted by `noise` (g,). An effect that is
    `inside` the twin is in all runs, and only its size has changed.
    """
    moments = system.moments(noise)
    found = set()
    for cause in causes:
        if cause.scope != CHANGED or cause.effect in inside:
            continue
        others = [k for other in causes if other is not cause for k in other.columns]
        gain = gains(system, attempt(system, moments, others, [[_everywhere(system, cause)]]))[0]
        before, now = (
            float(np.average(gain[of], weights=rows(system)[of]))
            for of in (~system.group_observed, system.group_observed)
        )
        if now > 0 and before >= limits.before * now:
            found.add(cause.effect)
    return frozenset(found)


def _everywhere(system: System, cause: Cause) -> Variant:
    """Return a cause of observed runs with the same coefficients in all runs."""
    columns = tuple(k - len(system.columns) if k >= system.changed else k for k in cause.columns)
    terms = tuple(term for variant in cause.variants for term in variant.terms)
    return Variant(cause.variants[0].effect, columns, terms)
