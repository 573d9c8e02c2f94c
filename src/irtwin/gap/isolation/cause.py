"""The cause: an effect that the data show beyond the twin's, and how sure its gain is."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from irtwin.gap.regression.cross_validation import Trial
from irtwin.gap.regression.hypotheses import CHANGED, Hypothesis, Variant
from irtwin.gap.regression.normal_equations import System
from irtwin.gap.thresholds import Selection
from irtwin.robot.description import Robot


@dataclass(frozen=True)
class Find:
    """A hypothesis taken in one shape; gain, t and p as a cause's."""

    hypothesis: Hypothesis
    variant: Variant
    gain: float
    t: float
    p: float


@dataclass(frozen=True)
class Cause:
    """An effect in one or more joints (the variants chosen), with what it explains on groups left out.

    gain: of weighted squares, a row; t: of the gain, between groups; p: adjusted for the whole catalogue; `rivals`: the
    effects that explain it as well; `rival_gains` and `rival_correlations` (canonical, 0 to 1) of all that compete.
    Where runs are few: `p_remembered` as p, where residuals remember; `repeats`, 0 to 1: of what it closes in a half of
    the time, what it closes with the other half's size; `in_halves`: whether the first and the last half show it by
    themselves. None: not judged.
    """

    effect: str
    scope: str
    joints: tuple[str, ...]
    variants: tuple[Variant, ...]
    gain: float
    t: float
    p: float
    rivals: tuple[str, ...] = ()
    rival_gains: dict[str, float] = field(default_factory=dict)
    rival_correlations: dict[str, float] = field(default_factory=dict)
    p_remembered: float | None = None
    repeats: float | None = None
    in_halves: tuple[bool, bool] | None = None

    @property
    def of_bodies(self) -> bool:
        """Whether it is the robot's bodies that differ."""
        return self.variants[0].effect.bodies

    @property
    def carries_power(self) -> bool:
        """Whether it is real torque."""
        return self.variants[0].effect.channel == "torque"

    def touched(self, robot: Robot) -> tuple[str, ...]:
        """Return the joints that it acts on; none for an effect of the whole robot."""
        named = [(one.effect, term.joint) for one in self.variants for term in one.terms if term.link is None]
        touched = [effect.touched(robot, joint) for effect, joint in named if joint is not None]
        return tuple(dict.fromkeys(joint for joints in touched for joint in joints))

    @property
    def columns(self) -> tuple[int, ...]:
        """The indices of its columns."""
        return tuple(k for variant in self.variants for k in variant.columns)


def gains(system: System, trial: Trial) -> np.ndarray:
    """Return each hypothesis' gain per row in each group, (H, G)."""
    return np.asarray((trial.start - trial.loss) / rows(system))


def rows(system: System) -> np.ndarray:
    """Return how many rows each group has, (G,)."""
    return np.asarray(np.maximum(system.rows.max(axis=1), 1.0))


def judged(system: System, scope: str) -> np.ndarray:
    """Return whether a group counts for a hypothesis of a scope, (G,)."""
    return np.asarray(system.group_observed if scope == CHANGED else np.ones(system.groups, dtype=bool))


def between_groups(gain: np.ndarray, said: np.ndarray, limits: Selection) -> float:
    """Return the t of the gain between groups, (G,): mean over standard error of its signed root; 0 of one group.

    The root, since a group in which much happens gains more than others: that speaks not against an effect. Nor does
    a group in which it has nothing to say: of what it adds, `said` (G,), there is next to nothing.
    """
    speaks = said >= limits.speaks * said.max(initial=0.0)
    if speaks.sum() >= limits.fewest_speaking:
        gain = gain[speaks]
    if len(gain) < 2:
        return 0.0
    root = np.sign(gain) * np.sqrt(np.abs(gain))
    return float(root.mean() / max(root.std(ddof=1) / np.sqrt(len(root)), 1e-12))
