"""Whether the 95 % intervals that a twin shows hold what is true of the case."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from energy_twin.cases import Case
from irtwin.identification.validation import energy
from irtwin.robot.pseudo_inertia import consistent
from irtwin.signals.motion import Motion
from irtwin.twin.account import account
from irtwin.twin.price import cost
from irtwin.twin.twin import Twin

KINDS = (
    "energy",
    "ledger parts",
    "standby_power",
    "copper_loss",
    "iron_loss",
    "inverter_loss",
    "rotor_inertia",
    "coulomb_friction",
    "viscous_friction",
    "torque_offset",
    "base parameters",
)
_READ = 1e-4  # of a run's energy: nearer than that a sampled log tells no part of it


@dataclass(frozen=True)
class Check:
    """An interval of a kind of `KINDS`, and what is true."""

    kind: str
    name: str
    lower: float
    upper: float
    true: float
    read: float = 0.0  # how near the truth is known

    @property
    def holds(self) -> bool:
        return self.lower - self.read <= self.true <= self.upper + self.read

    def __str__(self) -> str:
        return f"{self.kind}: {self.name} {self.lower:.4g} to {self.upper:.4g}, true {self.true:.4g}"


def checks(case: Case, twin: Twin, motions: Sequence[Motion]) -> Iterator[Check]:
    """Yield each interval that a twin shows of its robot and of motions, where the truth is known."""
    for motion in motions:
        yield from _of_run(case, twin, motion)
    for number in twin.stated:
        true = case.truth.numbers.get((number.effect, number.joint, number.name))
        if true is not None and number.lower is not None and number.upper is not None:
            yield Check(number.effect, f"{number.name} {number.joint or ''}", number.lower, number.upper, true)
    known = {"rigid_body", "rotor_inertia", "coulomb_friction", "viscous_friction", "torque_offset"}
    if case.truth.plain and {effect.id for effect, _ in twin.stack.torque_terms} == known:
        for base, true in zip(twin.base_parameters, case.truth.base(twin.stack), strict=True):
            yield Check("base parameters", base.name, base.lower, base.upper, float(true))


def _of_run(case: Case, twin: Twin, motion: Motion) -> Iterator[Check]:
    assert motion.power is not None
    taken, told = cost(twin, [motion]).energy, energy(motion.time, motion.power)
    assert taken.half_width is not None
    yield Check("energy", motion.run, taken.value - taken.half_width, taken.value + taken.half_width, told)
    for entry in account(twin, motion):
        true = [case.truth.energy(motion.run, (share.effect, share.joint)) for share in entry.shares]
        if entry.lower is not None and entry.upper is not None and None not in true:
            name = " + ".join(f"{share.effect} {share.joint or ''}" for share in entry.shares)
            total = sum(one for one in true if one is not None)
            yield Check("ledger parts", f"{motion.run} {name}", entry.lower, entry.upper, total, _READ * told)


def inconsistent(twin: Twin) -> int:
    """Return how many bodies of a twin have a pseudo-inertia that is not positive definite."""
    bodies = [one.value for one in twin.parameters if one.effect == "rigid_body"]
    return int(np.sum(~consistent(np.reshape(bodies, (-1, 10)))))
