"""The cause: an effect that the data show beyond the twin's, and how sure that is."""

from __future__ import annotations

from dataclasses import dataclass, field

from irtwin.document.document import LIKELY
from irtwin.effects.effect import Effect
from irtwin.gap.regression.hypotheses import Variant
from irtwin.robot.description import Robot


@dataclass(frozen=True)
class FoundCause:
    """An effect in one or more joints (the variants chosen), with what it explains beside the other causes.

    gain: of weighted squares, a row of each equation; log_odds: that it is there beside the other causes, against that
    nothing is in its place; probability: against all that could be; `rivals`: each other effect's, all scopes;
    `shapes`: of each variant those that it may have, 95 % of their posterior.
    """

    effect: str
    scope: str
    joints: tuple[str, ...]
    variants: tuple[Variant, ...]
    gain: float
    log_odds: float
    probability: float
    rivals: dict[str, float] = field(default_factory=dict)
    shapes: tuple[tuple[Effect, ...], ...] = ()

    def not_told_from(self, least: float) -> tuple[str, ...]:
        """Return the effects that the data do not tell from it: as likely as `least`, the likeliest first."""
        named = [rival for rival, chance in self.rivals.items() if chance >= least]
        return tuple(sorted(named, key=lambda rival: -self.rivals[rival]))

    @property
    def likely(self) -> bool:
        """Whether it is more likely than not, and no guess."""
        return self.probability >= LIKELY

    @property
    def nuisance(self) -> bool:
        """Whether it is what nobody states of any robot, and so no cause."""
        return self.variants[0].effect.nuisance

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
        named = [
            (variant.effect, term.joint) for variant in self.variants for term in variant.terms if term.link is None
        ]
        touched = [effect.touched(robot, joint) for effect, joint in named if joint is not None]
        return tuple(dict.fromkeys(joint for joints in touched for joint in joints))

    @property
    def columns(self) -> tuple[int, ...]:
        """The indices of its columns."""
        return tuple(k for variant in self.variants for k in variant.columns)
