"""The account of a motion: its ledger with intervals, where what data cannot part is one entry."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from irtwin.effects.effect import NORMAL, JointEffect
from irtwin.identification.power_line import power_rise
from irtwin.signals.motion import Motion
from irtwin.twin.price import cost, trapezoid
from irtwin.twin.twin import LedgerEntry, Twin

_PIECE = 4096  # samples whose regressor is held at once
_LEARNT = 0.5  # of an energy: half an interval that is wider tells nothing of it

Key = tuple[str, str | None]  # effect and joint


@dataclass(frozen=True)
class Share:
    """Energy (J) that one effect took in one joint, None for the whole robot; with its 95 % interval, if known."""

    effect: str
    joint: str | None
    energy: float
    lower: float | None
    upper: float | None


@dataclass(frozen=True)
class Entry:
    """Shares that the data do not part, or one alone: their energy together (J), with its 95 % interval, if known."""

    shares: tuple[Share, ...]
    energy: float
    lower: float | None
    upper: float | None


def account(twin: Twin, motion: Motion) -> tuple[Entry, ...]:
    """Return the ledger of a motion as entries that the data tell; they sum to its energy.

    A share whose interval is wider than that of the whole energy, and than its own, is not told: where others make up
    for it, they are one entry.
    """
    ledger = twin.ledger(motion)
    if twin.covariance is None:
        shares = [Share(entry.effect, entry.joint, entry.energy, None, None) for entry in ledger]
        return tuple(Entry((share,), share.energy, None, None) for share in shares)
    whole = cost(twin, [motion]).energy.half_width
    assert whole is not None
    covariance = ledger_covariance(twin, motion, ledger)
    energies = np.array([entry.energy for entry in ledger])
    one_way = _one_way(twin)

    def interval(places: Sequence[int]) -> tuple[float, float]:
        energy, half = energies[places].sum(), NORMAL * _deviation(covariance, places)
        never_less = all((ledger[k].effect, ledger[k].joint) in one_way and energies[k] >= 0 for k in places)
        return float(max(energy - half, 0.0) if never_less else energy - half), float(energy + half)

    return tuple(
        Entry(
            tuple(Share(ledger[k].effect, ledger[k].joint, ledger[k].energy, *interval([k])) for k in places),
            float(energies[places].sum()),
            *interval(places),
        )
        for places in _joined(energies, covariance, whole)
    )


def ledger_covariance(twin: Twin, motion: Motion, ledger: Sequence[LedgerEntry]) -> np.ndarray:
    """Return the (E, E) covariance of the ledger's E energies, J^2, of a twin that has one of its parameters."""
    slopes = _slopes(twin, motion, ledger)
    found = np.asarray(slopes @ twin.covariance @ slopes.T)
    if twin.remainder:  # what lasts of it looks like what is drawn at rest
        at_rest = {effect.id for effect in twin.stack.effects if effect.drawn_at_rest}
        lasting = twin.remainder.energy(float(motion.time[-1] - motion.time[0]))
        found += np.diag([lasting**2 if entry.effect in at_rest else 0.0 for entry in ledger])
    return found


def _joined(energies: np.ndarray, covariance: np.ndarray, whole: float) -> list[list[int]]:
    """Return the places of shares by entry: what is not told goes with what makes their sum surest."""
    groups = [[k] for k in range(len(energies))]
    while len(groups) > 1:
        join = np.array([[k in group for k in range(len(energies))] for group in groups], dtype=float)
        own, sums = join @ covariance @ join.T, np.abs(join @ energies)
        variance = np.diag(own)
        half = NORMAL * np.sqrt(np.maximum(variance, 0.0))
        open_ones = (half > whole) & (half > _LEARNT * sums)
        together = variance[:, None] + variance + 2 * own
        np.fill_diagonal(together, np.inf)
        gain = np.where(open_ones[:, None], variance[:, None] - together, -np.inf)
        one, other = np.unravel_index(int(np.argmax(gain)), gain.shape)
        if gain[one, other] <= 0:
            break
        groups[one] = sorted(groups[one] + groups[other])
        del groups[other]
    return groups


def _deviation(covariance: np.ndarray, places: Sequence[int]) -> float:
    return float(np.sqrt(max(covariance[np.ix_(places, places)].sum(), 0.0)))


def _one_way(twin: Twin) -> set[Key]:
    """Return the shares of power whose coefficients are never negative: losses."""
    terms = [(effect, term) for effect, term in twin.stack.power_terms if not effect.carries_torque]
    free = {(effect.id, term.joint) for effect, term in terms if term.lowest < 0}
    return {(effect.id, term.joint) for effect, term in terms} - free


def _slopes(twin: Twin, motion: Motion, ledger: Sequence[LedgerEntry]) -> np.ndarray:
    """Return the slope of each entry's energy over each of the twin's p parameters, (E, p).

    To first order; effects that build on predicted power are taken as they are, and so is what a meter adds.
    """
    stack, names = twin.stack, twin.robot.joint_names
    rows = {(entry.effect, entry.joint): row for row, entry in enumerate(ledger)}
    values = [np.array([twin.value(e.id, t) for e, t in terms]) for terms in (stack.torque_terms, stack.power_terms)]
    over_torque, over_power = (np.zeros((len(ledger), len(own))) for own in values)
    weights = trapezoid(motion.time)
    for piece in motion.pieces(_PIECE):
        own = weights[piece.start - motion.start : piece.start - motion.start + len(piece.time)]
        columns = stack.torque_columns(piece, values[0])
        if any(effect.carries_torque for effect in stack.effects):
            work = np.einsum("t,tj,tjk->jk", own, piece.dq, columns)
            for joint, k in zip(*np.nonzero(stack.pattern & stack.real), strict=True):
                over_torque[rows[stack.torque_terms[k][0].id, names[joint]], k] += work[joint, k]
        power = own @ stack.predicted_power_columns(piece, *values)
        rise = power_rise(stack, piece, stack.real_torque(piece, values[0]), np.ones(len(names))) * values[1]
        for k, (effect, term) in enumerate(stack.power_terms):
            row = rows.get((effect.id, term.joint))
            if row is None or effect.carries_torque:
                continue
            over_power[row, k] += power[k]
            if isinstance(effect, JointEffect) and term.joint and effect.needs == "torque":
                over_torque[row] += own * rise[:, k] @ columns[:, twin.robot.index(term.joint)] * stack.real
    places = {(each.effect, each.joint, each.link, each.name): place for place, each in enumerate(twin.parameters)}
    slopes = np.zeros((len(ledger), len(places)))
    for terms, over in ((stack.torque_terms, over_torque), (stack.power_terms, over_power)):
        for k, (effect, term) in enumerate(terms):
            if not term.fixed:
                slopes[:, places[effect.id, term.joint, term.link, term.name]] += over[:, k]
    return slopes
