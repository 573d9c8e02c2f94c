"""Weighing causes of torque by the power that was measured."""

from __future__ import annotations

import numpy as np

from irtwin.effects.drive import CopperLoss
from irtwin.effects.stack import Stack
from irtwin.gap.data.case import Case
from irtwin.gap.isolation.cause import Cause
from irtwin.gap.isolation.explained import ExplainedTorque
from irtwin.gap.isolation.power_consistency import PowerBalance
from irtwin.gap.regression.channel_equations import Torque, power_system
from irtwin.gap.regression.moments import summed
from irtwin.gap.regression.normal_equations import noise_before
from irtwin.signals.motion import Motion


def power_balances(case: Case, stack: Stack, explained: ExplainedTorque) -> tuple[PowerBalance, ...]:
    """Weigh each cause of torque by the power that was measured; `stack` holds the effects that explain power."""
    return tuple(_weigh(case, stack, explained, cause) for cause in explained.finding.causes)


def _weigh(case: Case, stack: Stack, explained: ExplainedTorque, cause: Cause) -> PowerBalance:
    shown = _squares(case, stack, _taken(explained, cause, carried=False))
    carried = _squares(case, stack, _taken(explained, cause, carried=True))
    gain = np.log(shown / carried)
    error = float(np.std(gain, ddof=1)) / np.sqrt(len(gain)) if len(gain) > 1 else np.inf
    mean = float(gain.mean())
    return PowerBalance(mean, float(mean / max(error, np.finfo(float).tiny)), case.thresholds.power_consistency)


def _taken(explained: ExplainedTorque, cause: Cause, *, carried: bool) -> Torque:
    """Return the real joint torque with all that a cause adds to what is measured, or with none of it."""
    held: dict[str, np.ndarray] = {}

    def torque(motion: Motion) -> np.ndarray:
        whole = motion.whole or motion
        if whole.run not in held:
            held.clear()
            held[whole.run] = explained(whole) - explained.added(cause, whole, real=True)
            if carried:
                held[whole.run] = held[whole.run] + explained.added(cause, whole)
        return held[whole.run][motion.start : motion.start + len(motion.time)]

    return torque


def _squares(case: Case, stack: Stack, torque: Torque) -> np.ndarray:
    """Return the squares of power's residual in each observed group left out, (G,).

    Losses in the windings are refitted even where the twin has none: they grow with torque as its work does.
    """

    def nothing(motion: Motion, taken: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return np.zeros(len(taken)), np.zeros(len(taken))

    nuisance = () if CopperLoss.id in stack.ids else (CopperLoss(),)
    system = power_system(stack, case.with_power, case.grouping, nuisance, torque, nothing)
    chosen = range(system.base, system.base + len(system.columns))
    moments = system.moments(noise_before(system))
    total = summed(moments)
    groups = np.flatnonzero(system.group_observed)
    squares = [system.squares(system.solution(chosen, total - moments[g]), int(g)).sum() for g in groups]
    return np.asarray(np.maximum(squares, np.finfo(float).tiny))
