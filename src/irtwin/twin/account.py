"""The account of a motion: its ledger with intervals, where what data cannot part is one entry."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np

from irtwin.effects.effect import NORMAL, JointEffect
from irtwin.identification.power_line import power_rise, power_slope, rise_over_axes
from irtwin.signals.motion import Motion, trapezoid
from irtwin.twin.price import cost
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
    covariance = _covariance(twin, motion, ledger)
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


def _covariance(twin: Twin, motion: Motion, ledger: Sequence[LedgerEntry]) -> np.ndarray:
    """Return the (E, E) covariance of the ledger's E energies, J^2, of a twin that has one of its parameters."""
    slopes = _slopes(twin, motion, ledger)
    covariance = np.asarray(slopes @ twin.covariance @ slopes.T)
    seconds = float(motion.time[-1] - motion.time[0])
    lasting = twin.remainder.energy(seconds) if twin.remainder else 0.0  # it looks like what is drawn at rest
    unsure = {
        parameter.effect: parameter.upper - parameter.value
        for parameter in twin.parameters
        if parameter.upper is not None
    }
    for k, entry in enumerate(ledger):
        if entry.effect in twin.at_rest:
            alone = unsure.get(entry.effect, 0.0) / NORMAL * seconds
            covariance[k, k] = max(covariance[k, k] + lasting**2, alone**2)
    return covariance


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
        first, second = np.unravel_index(int(np.argmax(gain)), gain.shape)
        if gain[first, second] <= 0:
            break
        groups[first] = sorted(groups[first] + groups[second])
        del groups[second]
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

    To first order; what a store holds is taken as it is, and so is what a meter adds.
    """
    stack = twin.stack
    rows = {(entry.effect, entry.joint): row for row, entry in enumerate(ledger)}
    over_torque, over_power = (np.zeros((len(ledger), len(own))) for own in (stack.torque_terms, stack.power_terms))
    weights = trapezoid(motion.time)
    for piece in motion.pieces(_PIECE):
        own = weights[piece.start - motion.start : piece.start - motion.start + len(piece.time)]
        about = _About.of(twin, piece, own)
        over_torque += _of_work(about, rows, over_torque.shape)
        for row, torque, power in chain(_of_losses(about, rows), _of_burnt(about, rows)):
            over_torque[row] += torque
            over_power[row] += power
    return twin.over_parameters(over_torque, over_power)


@dataclass(frozen=True)
class _About:
    """What a twin predicts of a piece of a motion, whose samples have `weights` (N,) s.

    columns: (N, n, K) of torque; torque: (N, n) N m, the real one; flows: (N, L), the columns of power.
    """

    twin: Twin
    piece: Motion
    weights: np.ndarray
    columns: np.ndarray
    torque: np.ndarray
    flows: np.ndarray

    @classmethod
    def of(cls, twin: Twin, piece: Motion, weights: np.ndarray) -> _About:
        stack, values = twin.stack, twin.torque_values
        columns, torque = stack.torque_columns(piece, values), stack.real_torque(piece, values)
        flows = stack.predicted_power_columns(piece, values, twin.power_values, torque)
        return cls(twin, piece, weights, columns, torque, flows)


_Slope = tuple[int, np.ndarray, np.ndarray]  # an entry's row, and its slope over (K,) and (L,) coefficients


def _of_work(about: _About, rows: dict[Key, int], shape: tuple[int, ...]) -> np.ndarray:
    """Return the slopes of what joints' torque works, `shape`: (E, K)."""
    stack, names, slopes = about.twin.stack, about.twin.robot.joint_names, np.zeros(shape)
    if any(effect.carries_torque for effect in stack.effects):
        work = np.einsum("t,tj,tjk->jk", about.weights, about.piece.dq, about.columns)
        for joint, k in zip(*np.nonzero(stack.pattern & stack.real), strict=True):
            slopes[rows[stack.torque_terms[k][0].id, names[joint]], k] += work[joint, k]
    return slopes


def _of_losses(about: _About, rows: dict[Key, int]) -> Iterator[_Slope]:
    """Yield the slopes of what is drawn beside, by its own coefficients and by the torque of its joint."""
    stack, robot = about.twin.stack, about.twin.robot
    power = about.weights @ about.flows
    rise = power_rise(stack, about.piece, about.torque, np.ones(len(robot.joints))) * about.twin.power_values
    for k, (effect, term) in enumerate(stack.power_terms):
        row = rows.get((effect.id, term.joint))
        if row is None or effect.carries_torque:
            continue
        own, torque = np.zeros(len(power)), np.zeros(len(stack.torque_terms))
        own[k] = power[k]
        if isinstance(effect, JointEffect) and term.joint and effect.needs == "torque":
            torque = about.weights * rise[:, k] @ about.columns[:, robot.index(term.joint)] * stack.real
        yield row, torque, own


def _of_burnt(about: _About, rows: dict[Key, int]) -> Iterator[_Slope]:
    """Yield the slopes of what is made of the power that axes give back, by what that power depends on."""
    stack, piece = about.twin.stack, about.piece
    on_bus = np.where(stack.on_the_bus, about.twin.power_values, 0.0)
    axes = about.flows @ on_bus
    for effect in stack.effects:
        row = rows.get((effect.id, None))
        if row is None or effect.needs != "power" or effect.memory:
            continue
        own = about.twin.values((effect, term) for term in effect.terms(about.twin.robot))
        rise = about.weights * rise_over_axes(stack, effect, piece, about.torque, axes, own)
        over_torque = rise[:, None] * power_slope(stack, piece, about.torque, on_bus)
        torque = np.einsum("tj,tjk->k", over_torque, about.columns) * stack.real
        yield row, torque, rise @ about.flows * stack.on_the_bus
