"""What acts about a place of a joint: a worn spot of its gear, a spring near the end of its range."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from irtwin.effects.effect import (
    Coefficients,
    Effect,
    JointEffect,
    Possible,
    Predicted,
    Quantity,
    Stated,
    Term,
    force_unit,
)
from irtwin.effects.friction import direction
from irtwin.robot.description import Joint, Robot
from irtwin.signals.motion import Motion

_FLANKS = 1.5  # widths of a bump on either side that runs have to pass, or it is no bump
_WIDTHS = (1 / 40, 1 / 20, 1 / 10)  # of the way that runs cover: wider ones are friction over the whole turn
_ENDS = tuple(share / 20 for share in range(12, 20))  # of that way: where a spring near its end may begin


@dataclass(frozen=True)
class LocalEffect(JointEffect):
    """An effect by position and direction alone, at a place q0 that the data tell before it is tried.

    A grid of places at every joint is too many for the search: `gap.screening.local` finds that which explains most.
    """

    q0: float = 0.0  # rad or m

    @property
    def screened(self) -> bool:
        """True: its place is screened for."""
        return True

    @abstractmethod
    def law(self, q: np.ndarray, signs: np.ndarray) -> np.ndarray:
        """Return the column at positions and directions (-1, 0, 1) of one shape, each."""

    @abstractmethod
    def over(self, lower: float, upper: float) -> tuple[tuple[LocalEffect, ...], ...]:
        """Return the shapes that runs can show in which a joint goes from `lower` to `upper`.

        In groups, of one shape at least, which the rest of the twin may make alike: the best of each is to be tried.
        """

    def candidates(self, robot: Robot | None = None) -> tuple[Effect, ...]:
        """Return shapes over the range of the joints; the widest of them, or a turn."""
        limits = [(joint.lower, joint.upper) for joint in robot.joints] if robot else []
        known = [pair for pair in limits if np.isfinite(pair).all()]
        lower = min((pair[0] for pair in known), default=-np.pi)
        upper = max((pair[1] for pair in known), default=np.pi)
        return self._coarse(lower, upper)

    def _coarse(self, lower: float, upper: float) -> tuple[Effect, ...]:
        """Return few shapes from `lower` to `upper`."""
        return tuple(shape for group in self.over(lower, upper) for shape in group)

    def samples(self, robot: Robot, motion: Motion, predicted: Predicted | None) -> tuple[np.ndarray, ...]:
        """Return the law along the motion."""
        return (self.law(motion.q, direction(robot, motion.dq)),)

    def parameters(self, robot: Robot, given: Coefficients) -> tuple[Quantity, ...]:
        """Return the coefficient, the place, and what else is the shape's."""
        return (*super().parameters(robot, given), *self.shape_of_joints(robot, q0="{}"))


@dataclass(frozen=True)
class LocalWear(LocalEffect):
    """Fw s exp(-((q - q0)/w)^2): Coulomb friction that is more, or less, about a place: a pitted or a dry spot.

    Friction of robot joints depends on the angle (Bittencourt and Gunnarsson, J. Dyn. Syst. Meas. Control 134(5), 2012)
    and rises with wear (Bittencourt and Axelsson, report LiTH-ISY-R-3058, Linköping 2013); the bump is our form.
    """

    id: ClassVar[str] = "local_wear"
    family: ClassVar[str] = "friction"
    ranges: ClassVar[dict[str, tuple[float, float]]] = {"q0": (-2 * np.pi, 2 * np.pi), "w": (0.01, 1.0)}

    w: float = 0.1  # rad or m, where the bump has fallen to 37 %

    def law(self, q: np.ndarray, signs: np.ndarray) -> np.ndarray:
        """Return s exp(-((q - q0)/w)^2)."""
        return np.asarray(signs * np.exp(-(((q - self.q0) / self.w) ** 2)))

    def over(self, lower: float, upper: float) -> tuple[tuple[LocalEffect, ...], ...]:
        """Return bumps of which both flanks are passed, in one group."""
        shapes: list[LocalEffect] = []
        for width in (share * (upper - lower) for share in _WIDTHS):
            first, last = lower + _FLANKS * width, upper - _FLANKS * width
            places = np.linspace(first, last, 1 + round(2 * (last - first) / width))
            shapes += [replace(self, q0=float(place), w=float(width)) for place in places]
        return (tuple(shapes),)

    def _coarse(self, lower: float, upper: float) -> tuple[Effect, ...]:
        places = np.linspace(lower, upper, 22)
        return replace(self, w=float(places[1] - places[0])).variants(q0=tuple(map(float, places[1:-1])))

    def joint_terms(self, joint: Joint) -> tuple[Term, ...]:
        """Return Fw."""
        return (Term("Fw", force_unit(joint), joint.name, spread=5.0),)

    def parameters(self, robot: Robot, given: Coefficients) -> tuple[Quantity, ...]:
        """Return Fw, q0 and w."""
        return (*super().parameters(robot, given), *self.shape_of_joints(robot, w="{}"))


@dataclass(frozen=True)
class JointLimitSpring(LocalEffect):
    """k max(0, q - q0), or -k max(0, q0 - q) on the lower side: a stop, or a hose that is tight from a place on.

    The one-sided spring by which simulators make limits of joints soft (Todorov, Erez and Tassa, MuJoCo, IROS 2012),
    without its damper.
    """

    id: ClassVar[str] = "joint_limit_spring"
    family: ClassVar[str] = "load"
    taken_off: ClassVar[str | None] = "with the hose package off"
    ranges: ClassVar[dict[str, tuple[float, float]]] = {"q0": (-2 * np.pi, 2 * np.pi)}

    side: float = 1.0  # 1: it acts above q0; -1: below

    def law(self, q: np.ndarray, signs: np.ndarray) -> np.ndarray:
        """Return how far q is beyond q0, positive above and negative below."""
        return np.asarray(self.side * np.maximum(self.side * (q - self.q0), 0.0))

    def over(self, lower: float, upper: float) -> tuple[tuple[LocalEffect, ...], ...]:
        """Return springs at the upper end of the way, and at the lower: beside one on all of it, each is the other."""
        way = upper - lower
        return (
            tuple(replace(self, q0=lower + share * way, side=1.0) for share in _ENDS),
            tuple(replace(self, q0=upper - share * way, side=-1.0) for share in _ENDS),
        )

    def joint_terms(self, joint: Joint) -> tuple[Term, ...]:
        """Return k."""
        return (Term("k", f"{force_unit(joint)}/{joint.unit}", joint.name, spread=100.0, lowest=0.0),)

    def parameters(self, robot: Robot, given: Coefficients) -> tuple[Quantity, ...]:
        """Return k, q0 and the side."""
        return (*super().parameters(robot, given), *self.shape_of_joints(robot, side="1"))

    def possible(self, robot: Robot, stated: Stated) -> Mapping[str, Possible]:
        """Return that it pulls back."""
        return {"k": Possible(0.0, np.inf, "a spring pulls a joint back to where it is at rest")}
