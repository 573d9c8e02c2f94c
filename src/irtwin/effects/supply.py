"""What the supply delivers: mechanical power, what the controller takes at rest, and what the bus keeps or burns."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from irtwin.effects.effect import Coefficients, Effect, JointEffect, Predicted, Quantity, Term, quantity
from irtwin.robot.description import Joint, Robot
from irtwin.signals.motion import Motion, moves

_MOVING = 1e-2  # rad/s
_DELAYS = (0.0, 0.2, 0.3, 0.4, 0.5, 1.0, 2.0, 5.0)  # s
_LEADS = (0.0, 0.05, 0.15)  # s


@dataclass(frozen=True)
class MechanicalPower(JointEffect):
    """sum_j tau_j dq_j (Yan 2018, eq. 7 and the sum in eq. 8): a coefficient of one in every joint."""

    id: ClassVar[str] = "mechanical_power"
    family: ClassVar[str] = "supply"
    carries_torque: ClassVar[bool] = True
    channel: ClassVar[str] = "power"
    signal: ClassVar[str] = "power"
    needs: ClassVar[str | None] = "torque"

    def joint_terms(self, joint: Joint) -> tuple[Term, ...]:
        """Return a fixed one."""
        return (Term("", "1", joint=joint.name, expected=1.0, fixed=True),)

    def samples(self, robot: Robot, motion: Motion, predicted: Predicted | None) -> tuple[np.ndarray, ...]:
        """Return tau_j dq_j."""
        assert predicted is not None
        return (predicted.torque * motion.dq,)


@dataclass(frozen=True)
class StandbyPower(Effect):
    """P0: controller, fans, brakes held open; Pconstant of Yan 2018, eq. 8."""

    id: ClassVar[str] = "standby_power"
    family: ClassVar[str] = "supply"
    drawn_at_rest: ClassVar[bool] = True
    electrical_loss: ClassVar[bool] = True
    channel: ClassVar[str] = "power"
    signal: ClassVar[str] = "power"

    def terms(self, robot: Robot) -> tuple[Term, ...]:
        """Return P0."""
        return (Term("P0", "W", spread=600.0, lowest=0.0),)

    def columns(self, robot: Robot, motion: Motion, predicted: Predicted | None = None) -> np.ndarray:
        """Return (N, 1) ones."""
        return np.ones((len(motion.time), 1))


@dataclass(frozen=True)
class BusCapacitor(Effect):
    """C V dV/dt: the bus keeps up to E of what braking axes give back, and feeds it to the next that drives.

    The column is the flow into a store of E joule, over E; the coefficient is E again where the shape is right.
    """

    id: ClassVar[str] = "bus_capacitor"
    family: ClassVar[str] = "supply"
    manual_test: ClassVar[str | None] = "hard stops from full speed, power logged at 100 Hz or more"
    channel: ClassVar[str] = "power"
    signal: ClassVar[str] = "power"
    needs: ClassVar[str | None] = "power"
    stage: ClassVar[int] = 1
    memory: ClassVar[bool] = True
    ranges: ClassVar[dict[str, tuple[float, float]]] = {"E": (5.0, 500.0)}

    E: float = 50.0  # J

    def candidates(self, robot: Robot | None = None) -> tuple[Effect, ...]:
        """Return stores over the range, and below it: what is small beside a stop is full at once."""
        return self.variants(E=(1.0, 2.0, 5.0, 12.0, 30.0, 75.0, 190.0, 500.0))

    def terms(self, robot: Robot) -> tuple[Term, ...]:
        """Return E."""
        return (Term("E", "J", spread=500.0, lowest=0.0),)

    def columns(self, robot: Robot, motion: Motion, predicted: Predicted | None = None) -> np.ndarray:
        """Return (N, 1) the flow into the store, over E."""
        assert predicted is not None and predicted.axes is not None
        step = 1 / motion.rate
        stored = _kept_between(-step * predicted.axes, self.E)
        flow = np.diff(stored, prepend=0.0) / step
        return flow[:, None] / self.E


def _kept_between(given: np.ndarray, most: float) -> np.ndarray:
    """Return (N,) what a store of `most` holds after each of N gifts, from empty on: x -> min(max(x + given, 0), most).

    Maps of the form x -> clip(x + a, low, high) compose to one of that form, so all are joined by doubling.
    """
    added, low, high = given.copy(), np.zeros_like(given), np.full_like(given, most)
    reach = 1
    while reach < len(given):
        mine, lowest, highest = added[reach:], low[reach:], high[reach:]
        joined = (np.clip(ends[:-reach] + mine, lowest, highest) for ends in (low, high))
        low[reach:], high[reach:] = joined
        added[reach:] = added[:-reach] + mine
        reach *= 2
    return np.asarray(np.clip(added, low, high))


@dataclass(frozen=True)
class NoRegeneration(Effect):
    """max(sum_j P_j, 0): the brake chopper burns what the axes give back. The coefficient is the burnt share."""

    id: ClassVar[str] = "no_regeneration"
    family: ClassVar[str] = "supply"
    manual_test: ClassVar[str | None] = (
        "log power while lowering a payload fast, one joint at a time, then two against each other"
    )
    channel: ClassVar[str] = "power"
    signal: ClassVar[str] = "power"
    needs: ClassVar[str | None] = "power"
    stage: ClassVar[int] = 2

    def terms(self, robot: Robot) -> tuple[Term, ...]:
        """Return the share that is burnt: all of it, unless data say otherwise."""
        return (Term("burnt", "1", expected=1.0, lowest=0.0, highest=1.0),)

    def columns(self, robot: Robot, motion: Motion, predicted: Predicted | None = None) -> np.ndarray:
        """Return (N, 1) what the axes give back together."""
        assert predicted is not None and predicted.axes is not None
        return np.asarray(np.maximum(-predicted.axes, 0.0)[:, None])

    def parameters(self, robot: Robot, given: Coefficients) -> tuple[Quantity, ...]:
        """Return the share that goes back to the mains: none to all of it."""
        burnt, deviation = float(given.values[0]), float(given.deviations[0])
        return (quantity("returned", None, burnt, "1", deviation, lambda share: float(np.clip(1 - share, 0, 1))),)


@dataclass(frozen=True)
class HoldingBrakes(Effect):
    """Pb while brakes are released, from `lead` before a joint moves to `delay` after. Closed, they carry the links."""

    id: ClassVar[str] = "holding_brakes"
    frees_joints: ClassVar[bool] = True
    family: ClassVar[str] = "supply"
    electrical_loss: ClassVar[bool] = True
    manual_test: ClassVar[str | None] = "log power while standing with brakes closed, then open"
    channel: ClassVar[str] = "power"
    signal: ClassVar[str] = "power"
    memory: ClassVar[bool] = True
    ranges: ClassVar[dict[str, tuple[float, float]]] = {"delay": (0.0, 10.0), "lead": (0.0, 1.0)}
    lately: ClassVar[frozenset[str]] = frozenset({"lead"})

    delay: float = 0.5  # s
    lead: float = 0.0  # s

    def candidates(self, robot: Robot | None = None) -> tuple[Effect, ...]:
        """Return delays after which brakes close, and how long before a motion they open."""
        return tuple(replace(self, delay=delay, lead=lead) for delay in _DELAYS for lead in _LEADS)

    def terms(self, robot: Robot) -> tuple[Term, ...]:
        """Return Pb."""
        return (Term("Pb", "W", spread=100.0, lowest=0.0),)

    def columns(self, robot: Robot, motion: Motion, predicted: Predicted | None = None) -> np.ndarray:
        """Return (N, 1) whether the brakes are released."""
        moving = moves(motion, np.any(np.abs(motion.dq) > _MOVING, axis=1))
        last = np.maximum.accumulate(np.where(moving, motion.time, -np.inf))
        following = np.minimum.accumulate(np.where(moving, motion.time, np.inf)[::-1])[::-1]
        released = (motion.time - last <= self.delay) | (following - motion.time <= self.lead)
        return released.astype(float)[:, None]
