"""Whether what changed is really new: reference runs must lack it."""

from __future__ import annotations

from collections.abc import Sequence, Set
from dataclasses import replace

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

    Each is tried in all runs alike, beside the other causes; and beside itself in the observed ones too, so that the
    reference runs alone tell what it gains there. Equations are weighted by `noise` (g,). An effect that is `inside`
    the twin is in all runs, and only its size has changed.
    """
    moments = system.moments(noise)
    chosen = [k for cause in causes for k in cause.columns]
    weights, seen = rows(system), system.group_observed
    found = set()
    for cause in causes:
        if cause.scope != CHANGED or cause.effect in inside:
            continue
        others = [k for k in chosen if k not in cause.columns]
        alike = [[_everywhere(system, cause)]]
        now = gains(system, attempt(system, moments, others, [[_joined(cause)]]))[0]
        before = np.minimum(*(gains(system, attempt(system, moments, beside, alike))[0] for beside in (chosen, others)))
        gained = float(np.average(now[seen], weights=weights[seen]))
        if float(np.average(before[~seen], weights=weights[~seen])) >= limits.before * gained > 0:
            found.add(cause.effect)
    return frozenset(found)


def _joined(cause: Cause) -> Variant:
    """Return a cause of several joints as one variant."""
    terms = tuple(term for variant in cause.variants for term in variant.terms)
    return Variant(cause.variants[0].effect, tuple(cause.columns), terms)


def _everywhere(system: System, cause: Cause) -> Variant:
    """Return a cause of observed runs with the same coefficients in all runs."""
    one = _joined(cause)
    return replace(one, columns=tuple(k - len(system.columns) if k >= system.changed else k for k in one.columns))
