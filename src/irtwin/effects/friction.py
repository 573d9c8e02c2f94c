"""Friction in the joints (Yan 2018, eq. 3, and what that leaves out)."""

from __future__ import annotations

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
    quantity,
    ratio,
)
from irtwin.robot.description import Joint, Robot
from irtwin.signals.conditioning import STANDSTILL
from irtwin.signals.motion import Motion

SLOW = 0.02  # rad/s, across which friction surely changes its sign, whatever its law
_SHARP = 3e-3  # rad/s: what turns sooner hardly differs from what turns at once
_TURNS = ((4e-3, 4.0), (0.01, 4.0), (0.025, 4.0), (0.025, 1.25))  # of a mixture: three ramps and a tail, as of `turn`
_TURNED = 2.0  # widths, where most of a turn is over
OVER = 3.0  # widths, where a turn is over
_FROM_REST, _REST = 0.06, 0.2  # rad, over which friction builds up again, and s, after which a joint rested
_MOST_FIRST = 0.5  # of a run's motion: a joint of which more is over this way is modelled there, too
_LAW = 0.02  # of a joint's dry friction: as well as its law over speed is known, one standard deviation
_MOST_LOST = 0.6  # of a load, in gears: those that lose half when driven back hold by themselves


def sharp_sign(dq: np.ndarray) -> np.ndarray:
    """Return the sign of speeds, zero at standstill."""
    return np.where(np.abs(dq) < STANDSTILL, 0.0, np.sign(dq))


def turn(dq: np.ndarray, width: float | np.ndarray, exponent: float) -> np.ndarray:
    """Return u/(1 + |u|^p)^(1/p), u = dq/width: the sign of dry friction that turns over a speed, not at once.

    Exponent 2 is the usual regularised sign; near 1 the tails are as long as an arctangent's, above 3 nearly a ramp.
    """
    return np.asarray(dq / (width**exponent + np.abs(dq) ** exponent) ** (1 / exponent))


def direction(robot: Robot, dq: np.ndarray) -> np.ndarray:
    """Return (N, n), by speeds, the sign that dry friction has in each joint: as sharp as the joint's is."""
    directions = sharp_sign(dq)
    for place, joint in enumerate(robot.joints):
        if joint.friction_width is not None and joint.friction_exponent is not None:
            directions[:, place] = turn(dq[:, place], joint.friction_width, joint.friction_exponent)
    return directions


def turning(robot: Robot, dq: np.ndarray) -> np.ndarray:
    """Return (N, n), by speeds, where a joint is so slow that its dry friction turns: its law there is its own."""
    widths = np.array([joint.friction_widest or joint.friction_width or _SHARP for joint in robot.joints])
    return np.asarray(np.abs(dq) < _TURNED * widths)


def _rested(standing: np.ndarray, count: int) -> np.ndarray:
    """Return (N, n) where each joint has stood for some samples."""
    stood = np.cumsum(standing, axis=0)
    moved = np.maximum.accumulate(np.where(standing, 0, stood), axis=0)
    return np.asarray(stood - moved > count)


def _law(joint: Joint) -> float:
    """Return how well the law of a joint's dry friction is known, N m or N."""
    return _LAW * (joint.dry_friction or 0.0)


@dataclass(frozen=True)
class FrictionTurn(JointEffect):
    """Sum of Fc_w (s_w - s): dry friction that turns about zero speed over several speeds w, by `turn`.

    The joint's own s is one such turn, or none; what of it no other law says is a mixture, as friction only drags. In a
    twin the mixture is known but for its size.
    """

    id: ClassVar[str] = "friction_turn"
    family: ClassVar[str] = "friction"
    about_reversals: ClassVar[bool] = True
    nuisance: ClassVar[bool] = True
    never_changed: ClassVar[bool] = True

    mixture: tuple[float, ...] | None = None  # of each speed, N m or N; None: open

    def joint_terms(self, joint: Joint) -> tuple[Term, ...]:
        """Return the friction that turns over each speed, or how much of the mixture there is."""
        if self.mixture:
            return (Term("share", "1", joint.name, expected=1.0, spread=1.0, lowest=0.0),)
        unit, spread = force_unit(joint), joint.dry_friction or 15.0
        names = [f"Fc_{width:g}_{exponent:g}" for width, exponent in _TURNS]
        return tuple(Term(name, unit, joint.name, spread=spread, lowest=0.0) for name in names)

    def samples(self, robot: Robot, motion: Motion, predicted: Predicted | None) -> tuple[np.ndarray, ...]:
        """Return s_w - s of each w, or of the mixture."""
        own = direction(robot, motion.dq)
        turns = tuple(turn(motion.dq, width, exponent) - own for width, exponent in _TURNS)
        return (np.tensordot(self.mixture, turns, 1),) if self.mixture else turns


@dataclass(frozen=True)
class CoulombFriction(JointEffect):
    """Fc s, s the sign of dq by `direction`.

    At standstill friction holds what it has to, up to Fc either way: undecided, predicted as none.
    """

    id: ClassVar[str] = "coulomb_friction"
    family: ClassVar[str] = "friction"
    differs_by_run: ClassVar[str] = "dry"
    in_mjcf: ClassVar[Mapping[str, str]] = {"Fc": "frictionloss"}

    def joint_terms(self, joint: Joint) -> tuple[Term, ...]:
        """Return Fc."""
        return (Term("Fc", force_unit(joint), joint=joint.name, spread=15.0, lowest=0.0),)

    def samples(self, robot: Robot, motion: Motion, predicted: Predicted | None) -> tuple[np.ndarray, ...]:
        """Return s."""
        return (direction(robot, motion.dq),)

    def undecided(self, motion: Motion) -> np.ndarray:
        """Return where a joint stands still, as filtered or as logged: it may stick for a moment as it turns back."""
        slow = np.abs(motion.dq) < STANDSTILL
        return np.asarray(slow if motion.standing is None else slow | motion.standing)


@dataclass(frozen=True)
class ViscousFriction(JointEffect):
    """Fv dq."""

    id: ClassVar[str] = "viscous_friction"
    family: ClassVar[str] = "friction"
    differs_by_run: ClassVar[str] = "viscous"
    in_mjcf: ClassVar[Mapping[str, str]] = {"Fv": "damping"}

    def joint_terms(self, joint: Joint) -> tuple[Term, ...]:
        """Return Fv."""
        return (Term("Fv", f"{force_unit(joint)} s/{joint.unit}", joint=joint.name, spread=30.0, lowest=0.0),)

    def samples(self, robot: Robot, motion: Motion, predicted: Predicted | None) -> tuple[np.ndarray, ...]:
        """Return dq."""
        return (motion.dq,)


@dataclass(frozen=True)
class StribeckFriction(JointEffect):
    """Fs s exp(-(|dq|/vs)^d): what sticks more while it is slow."""

    id: ClassVar[str] = "stribeck_friction"
    family: ClassVar[str] = "friction"
    about_reversals: ClassVar[bool] = True
    ranges: ClassVar[dict[str, tuple[float, float]]] = {"vs": (0.005, 0.2), "d": (0.5, 2.0)}

    vs: float = 0.05  # rad/s
    d: float = 1.0

    def candidates(self, robot: Robot | None = None) -> tuple[StribeckFriction, ...]:
        """Return a grid of speeds and two forms, where dry friction has turned by then: what is slower is that turn."""
        grid = [replace(self, vs=vs, d=d) for vs in (0.01, 0.025, 0.05, 0.1, 0.2) for d in (1.0, 2.0)]
        if robot is None:
            return tuple(grid)
        widths = {joint.name: joint.friction_width or 0.0 for joint in self.acting(robot)}
        turned = [[name for name, width in widths.items() if form.vs >= OVER * width] for form in grid]
        return tuple(form.on(*joints) for form, joints in zip(grid, turned, strict=True) if joints)

    def joint_terms(self, joint: Joint) -> tuple[Term, ...]:
        """Return Fs."""
        return (Term("Fs", force_unit(joint), joint.name, spread=10.0, lowest=0.0, unnamed=_law(joint)),)

    def samples(self, robot: Robot, motion: Motion, predicted: Predicted | None) -> tuple[np.ndarray, ...]:
        """Return s exp(-(|dq|/vs)^d)."""
        return (direction(robot, motion.dq) * np.exp(-((np.abs(motion.dq) / self.vs) ** self.d)),)

    def parameters(self, robot: Robot, given: Coefficients) -> tuple[Quantity, ...]:
        """Return Fs, vs and d."""
        return (*super().parameters(robot, given), *self.shape_of_joints(robot, vs="{}/s", d="1"))


@dataclass(frozen=True)
class NonlinearViscousFriction(JointEffect):
    """k s |dq|^d: viscous friction that thins (d < 1) or stirs (d > 1)."""

    id: ClassVar[str] = "nonlinear_viscous_friction"
    family: ClassVar[str] = "friction"
    alters: ClassVar[str | None] = "viscous_friction"
    ranges: ClassVar[dict[str, tuple[float, float]]] = {"d": (0.2, 3.0)}

    d: float = 2.0

    def candidates(self, robot: Robot | None = None) -> tuple[NonlinearViscousFriction, ...]:
        """Return exponents on either side of one."""
        return self.variants(d=(0.3, 0.5, 0.7, 1.5, 2.0, 3.0))

    def joint_terms(self, joint: Joint) -> tuple[Term, ...]:
        """Return k, the torque at one unit of speed."""
        return (Term("k", force_unit(joint), joint.name, spread=10.0, unnamed=_law(joint)),)

    def samples(self, robot: Robot, motion: Motion, predicted: Predicted | None) -> tuple[np.ndarray, ...]:
        """Return s |dq|^d."""
        return (direction(robot, motion.dq) * np.abs(motion.dq) ** self.d,)

    def parameters(self, robot: Robot, given: Coefficients) -> tuple[Quantity, ...]:
        """Return k and d."""
        return (*super().parameters(robot, given), *self.shape_of_joints(robot, d="1"))


@dataclass(frozen=True)
class AsymmetricFriction(JointEffect):
    """a |s| + b |dq|: friction that differs by direction."""

    id: ClassVar[str] = "asymmetric_friction"
    family: ClassVar[str] = "friction"

    def joint_terms(self, joint: Joint) -> tuple[Term, ...]:
        """Return a and b."""
        unit = force_unit(joint)
        return Term("a", unit, joint.name, spread=5.0), Term("b", f"{unit} s/{joint.unit}", joint.name, spread=5.0)

    def samples(self, robot: Robot, motion: Motion, predicted: Predicted | None) -> tuple[np.ndarray, ...]:
        """Return |s| and |dq|."""
        return np.abs(direction(robot, motion.dq)), np.abs(motion.dq)


@dataclass(frozen=True)
class LoadDependentFriction(JointEffect):
    """mu |tau| s: gear teeth rub more under load; one coefficient where the joint is driven, one where it drives."""

    id: ClassVar[str] = "load_dependent_friction"
    family: ClassVar[str] = "friction"
    needs: ClassVar[str | None] = "torque"
    stage: ClassVar[int] = 1

    def joint_terms(self, joint: Joint) -> tuple[Term, ...]:
        """Return mu when driving, mu when driven back."""
        return tuple(Term(name, "1", joint.name, spread=0.3, lowest=0.0) for name in ("mu", "mu_back"))

    def samples(self, robot: Robot, motion: Motion, predicted: Predicted | None) -> tuple[np.ndarray, ...]:
        """Return |tau| s while tau dq is positive, and while it is not."""
        assert predicted is not None
        column = np.abs(predicted.torque) * direction(robot, motion.dq)
        drives = predicted.torque * motion.dq > 0
        return np.where(drives, column, 0.0), np.where(drives, 0.0, column)

    def possible(self, robot: Robot, stated: Stated) -> Mapping[str, Possible]:
        """Return what gears lose, or lose less than before."""
        lost = Possible(-_MOST_LOST, _MOST_LOST, "gears of robots do not lose more of a load")
        return {"mu": lost, "mu_back": lost}


@dataclass(frozen=True)
class TemperatureDependentFriction(JointEffect):
    """Fv dq (exp(-k (T - T0)) - 1): oil that thins as the joint warms. Zero where no temperature was measured.

    The coefficient is k Fv, the column the secant dq (exp(-k (T - T0)) - 1)/k, so that both agree in the right shape.
    """

    id: ClassVar[str] = "temperature_dependent_friction"
    family: ClassVar[str] = "friction"
    requires: ClassVar[frozenset[str]] = frozenset({"temperature"})
    of_every_drive: ClassVar[bool] = True
    manual_test: ClassVar[str | None] = "log joint temperatures, from a cold start"
    ranges: ClassVar[dict[str, tuple[float, float]]] = {"k": (0.005, 0.06)}

    k: float = 0.02  # 1/K
    T0: float = 25.0  # degC, where viscous_friction's Fv holds

    def candidates(self, robot: Robot | None = None) -> tuple[Effect, ...]:
        """Return slow and fast thinning."""
        return self.variants(k=(0.005, 0.02, 0.05))

    @property
    def changed_in_mjcf(self) -> Mapping[str, str]:
        """Viscous friction's, which a change may have made another."""
        return ViscousFriction.in_mjcf

    def changes(self) -> tuple[Effect, ...]:
        """Return the change that leaves another friction at T0."""
        return (ChangedFrictionWithTemperature(self.k, self.T0, joints=self.joints, runs=self.runs),)

    def joint_terms(self, joint: Joint) -> tuple[Term, ...]:
        """Return k Fv."""
        return (Term("k Fv", f"{force_unit(joint)} s/({joint.unit} K)", joint.name, spread=1.0, lowest=0.0),)

    def samples(self, robot: Robot, motion: Motion, predicted: Predicted | None) -> tuple[np.ndarray, ...]:
        """Return dq (exp(-k (T - T0)) - 1)/k."""
        if motion.temperature is None:
            return (np.zeros_like(motion.dq),)
        return (motion.dq * np.expm1(-self.k * (motion.temperature - self.T0)) / self.k,)

    def parameters(self, robot: Robot, given: Coefficients) -> tuple[Quantity, ...]:
        """Return k, relative to the joint's Fv; the shape's k where Fv is not known."""
        quantities = []
        for joint, value, deviation in zip(self.acting(robot), given.values, given.deviations, strict=True):
            viscous = given.known.get(("viscous_friction", joint.name, "Fv"))
            part = (ratio(value, viscous), ratio(deviation, viscous)) if viscous else (self.k, None)
            quantities.append(quantity("k", joint.name, part[0], "1/K", part[1]))
        return tuple(quantities)


@dataclass(frozen=True)
class ChangedFrictionWithTemperature(TemperatureDependentFriction):
    """(Fv + dFv) dq exp(-k (T - T0)) - Fv dq: friction with temperature, where viscous friction is another at T0, too.

    Beside the former friction, which holds at every temperature, a change is known at T0 no better than elsewhere. Both
    are equal at a temperature of their own.
    """

    of_change: ClassVar[bool] = True

    def standing(self) -> Effect:
        """Return it in a twin, where viscous friction is what holds at T0."""
        return TemperatureDependentFriction(self.k, self.T0, joints=self.joints, runs=self.runs)

    def joint_terms(self, joint: Joint) -> tuple[Term, ...]:
        """Return k (Fv + dFv) and dFv."""
        unit = f"{force_unit(joint)} s/{joint.unit}"
        return (*super().joint_terms(joint), Term("dFv", unit, joint.name, spread=30.0))

    def samples(self, robot: Robot, motion: Motion, predicted: Predicted | None) -> tuple[np.ndarray, ...]:
        """Return dq (exp(-k (T - T0)) - 1)/k and dq; zero where no temperature was measured."""
        (thinning,) = super().samples(robot, motion, predicted)
        return (thinning, np.zeros_like(motion.dq) if motion.temperature is None else motion.dq)

    def parameters(self, robot: Robot, given: Coefficients) -> tuple[Quantity, ...]:
        """Return k, relative to the joint's former Fv, (k (Fv + dFv) - k dFv)/Fv, and by how much Fv is another."""
        thinning = np.kron(np.eye(len(self.acting(robot))), [1.0, -self.k])
        former = Coefficients(thinning @ given.values, thinning @ given.covariance @ thinning.T, given.known)
        changes = zip(self.acting(robot), given.values[1::2], given.deviations[1::2], strict=True)
        changed = (
            quantity("Fv", joint.name, value, f"{force_unit(joint)} s/{joint.unit}", deviation)
            for joint, value, deviation in changes
        )
        return (*super().parameters(robot, former), *changed)


@dataclass(frozen=True)
class PreslidingHysteresis(JointEffect):
    """Fc (z - s), dz/dt = dq (1 - s z)/d: after a reversal friction builds up over an angle (Dahl 1968).

    Before the first reversal of a run it is taken to slide. A speed near standstill keeps its last direction. Whatever
    held a joint at rest, it is undecided over the first way from there.
    """

    id: ClassVar[str] = "presliding_hysteresis"
    family: ClassVar[str] = "friction"
    about_reversals: ClassVar[bool] = True
    memory: ClassVar[bool] = True
    ranges: ClassVar[dict[str, tuple[float, float]]] = {"d": (1e-4, 0.2)}

    d: float = 0.01  # rad

    def candidates(self, robot: Robot | None = None) -> tuple[Effect, ...]:
        """Return angles over the range."""
        return self.variants(d=(3e-4, 1e-3, 3e-3, 0.01, 0.03, 0.1))

    def joint_terms(self, joint: Joint) -> tuple[Term, ...]:
        """Return the Coulomb friction that builds up: the joint's own, where that is known."""
        known = joint.dry_friction
        return (Term("Fc", force_unit(joint), joint.name, expected=known or 0.0, spread=known or 15.0, lowest=0.0),)

    def samples(self, robot: Robot, motion: Motion, predicted: Predicted | None) -> tuple[np.ndarray, ...]:
        """Return z - s, at the acting joints."""
        column, slides = np.zeros_like(motion.dq), direction(robot, motion.dq)
        for joint in self.places(robot):
            signs = sharp_sign(motion.dq[:, joint])
            column[:, joint] = signs + self._lag(motion.q[:, joint], signs) - slides[:, joint]
        return (column,)

    def undecided(self, motion: Motion) -> np.ndarray:
        """Return where a joint has hardly moved from where the run began, or from where it rested for a while.

        Nowhere, where it hardly moves on in the whole run.
        """
        still = np.zeros(motion.q.shape, dtype=bool) if motion.standing is None else motion.standing
        place = np.arange(len(still))[:, None]
        begun = np.maximum.accumulate(np.where(_rested(still, round(_REST * motion.rate)), place, 0), axis=0)
        away = np.abs(motion.q - np.take_along_axis(motion.q, begun, axis=0)) >= _FROM_REST
        first = np.maximum.accumulate(np.where(away, place, -1), axis=0) <= begun
        speed = np.abs(motion.dq)
        first &= np.sum(first * speed, axis=0) < _MOST_FIRST * np.sum(speed, axis=0)
        return first

    def _lag(self, q: np.ndarray, signs: np.ndarray) -> np.ndarray:
        """Return z - sign(dq) (N,): minus twice the new direction at a reversal, decaying with the way from it."""
        moving = np.flatnonzero(signs)
        turns = moving[1:][np.diff(signs[moving]) != 0]
        lag = np.zeros(len(q))
        left = 0.0
        for start, stop in zip(turns, np.append(turns, len(q))[1:], strict=True):
            decay = np.exp(-np.abs(q[start:stop] - q[start]) / self.d)
            lag[start:stop] = (left - 2 * signs[start]) * decay
            left = lag[stop - 1]
        return lag

    def parameters(self, robot: Robot, given: Coefficients) -> tuple[Quantity, ...]:
        """Return d."""
        return self.shape_of_joints(robot, d="{}")


@dataclass(frozen=True)
class PositionDependentFriction(JointEffect):
    """Fc (a cos q + b sin q) s: a bent shaft or a worn sector. The coefficients are Fc a and Fc b."""

    id: ClassVar[str] = "position_dependent_friction"
    family: ClassVar[str] = "friction"

    def joint_terms(self, joint: Joint) -> tuple[Term, ...]:
        """Return Fc a and Fc b."""
        unit = force_unit(joint)
        return Term("Fc a", unit, joint.name, spread=5.0), Term("Fc b", unit, joint.name, spread=5.0)

    def samples(self, robot: Robot, motion: Motion, predicted: Predicted | None) -> tuple[np.ndarray, ...]:
        """Return s cos q and s sin q."""
        signs = direction(robot, motion.dq)
        return signs * np.cos(motion.q), signs * np.sin(motion.q)

    def parameters(self, robot: Robot, given: Coefficients) -> tuple[Quantity, ...]:
        """Return a and b, relative to the joint's Fc; nothing where that is not known."""
        return tuple(
            quantity(term.name.removeprefix("Fc "), term.joint, ratio(value, dry), "1", ratio(deviation, dry))
            for term, value, deviation in zip(self.terms(robot), given.values, given.deviations, strict=True)
            if (dry := given.known.get(("coulomb_friction", term.joint, "Fc")))
        )


def shapes_over_speed(turned: float) -> tuple[JointEffect, ...]:
    """Return the forms that friction may have over speed, in the shapes tried, that are not over by a speed, rad/s."""
    fading = (shape for shape in StribeckFriction().candidates() if shape.vs > turned)
    return (*fading, *NonlinearViscousFriction().candidates())
