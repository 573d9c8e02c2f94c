"""How a run was sampled: at what interval, with what holes in time, and whether channels were held, or froze."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
import scipy

from irtwin.errors import InputError
from irtwin.signals.channels import CHANNELS, Signals
from irtwin.signals.filter import FEWEST_PERIODS
from irtwin.signals.finding import LogFinding
from irtwin.signals.holes import HOLE
from irtwin.signals.samples import FEWEST

_MOST_PIECES = 100  # of one run; more, and it is not sampled but sprinkled
_BURST = 4.0  # times the median: where a tenth of the samples lies farther apart, the stamps come in bursts
_REGULAR = 0.9  # of the updates of held positions come at one pace, a sample more or less
_STEPS = 2.0  # times its smallest, the usual step of a position; an encoder that counts up takes the smallest
LEAST_RANGE = 0.02  # rad or m: a joint that spans less does not move
_LONGER = 10.0  # times as long as a value stays otherwise; tiago's torque, in steps of 0.02 N m, stays 7 times as long
_JUMP = 5.0  # times the longest usual step of a position, or the median one of others: it changed meanwhile


def interval(time: np.ndarray) -> float:
    """Return the sampling interval (s) of rising times (N,): the median one, longer where stamps come in bursts."""
    gaps = np.diff(time)
    return float(max(np.median(gaps), np.quantile(gaps, 0.9) / _BURST))


def as_sampled(signals: Signals, path: Path, joints: Sequence[str] = ()) -> tuple[list[Signals], list[LogFinding]]:
    """Return a run's samples at the rate at which they were taken, in pieces without a hole; say what was done.

    Held positions: one sample of each update stays. Samples at which a channel of the `joints` froze are left out; none
    of a motion that nobody measured. A piece of fewer than 20 samples is left out. A run that has none of these comes
    back as it is. Raises InputError where no piece is left, or there are more than 100.
    """
    signals, note = _without_held(signals, path)
    if joints:
        signals, lost = _without_frozen(signals, path, joints)
        note += lost
    pieces = _cut(signals)
    if len(pieces) == 1:
        return pieces, note
    long = [piece for piece in pieces if len(piece.time) >= FEWEST]
    first = f"from {pieces[0].time[-1]:.12g} s to {pieces[1].time[0]:.12g} s"
    if not 0 < len(long) <= _MOST_PIECES:
        raise InputError(
            f"{path}: {len(pieces) - 1} holes in time, the first {first}, leave {len(long)} pieces of {FEWEST} "
            f"samples; a run needs 1 to {_MOST_PIECES}: log it at an even rate"
        )
    others = "" if len(pieces) == 2 else f" (the first of {len(pieces) - 1} holes)"
    left_out = sum(len(piece.time) for piece in pieces if len(piece.time) < FEWEST)
    dropped = f"; {left_out} samples left out, in pieces of fewer than {FEWEST}" if left_out else ""
    taken = "one run" if len(long) == 1 else f"{len(long)} runs"
    message = f"{path}: no samples {first}{others}; taken as {taken}{dropped}"
    evidence = {"holes": float(len(pieces) - 1), "left_out": float(left_out)}
    return long, [*note, LogFinding("hole", "time", (path.stem,), True, True, evidence, message)]


def interpolated(time: np.ndarray, values: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return values (N, ...) of rising times (N,) at others (M,), (M, ...): straight in between, at the ends beyond."""
    return np.asarray(scipy.interpolate.make_interp_spline(time, values, k=1)(np.clip(at, time[0], time[-1])))


def earlier(time: np.ndarray, values: np.ndarray, lag: float) -> np.ndarray:
    """Return values (N, ...) as they are a `lag` (s) later, as splines say; beyond the ends, as there."""
    return np.asarray(scipy.interpolate.CubicSpline(time, values)(np.clip(time + lag, time[0], time[-1])))


def holes(time: np.ndarray) -> np.ndarray:
    """Return the samples (from 1 on) before which nothing was sampled for far longer than the interval."""
    if len(time) < FEWEST:
        return np.empty(0, dtype=int)
    return np.flatnonzero(np.diff(time) > HOLE * interval(time)) + 1


def _cut(signals: Signals) -> list[Signals]:
    """Return the pieces between holes; what is a hole in a piece, by its own interval, cuts that again."""
    todo, done = [signals], []
    while todo:
        piece = todo.pop()
        cuts = holes(piece.time).tolist()
        if cuts:
            parts = [piece.rows(slice(*ends)) for ends in pairwise([0, *cuts, len(piece.time)])]
            todo += reversed(parts)
        else:
            done.append(piece)
    return done


def _without_held(signals: Signals, path: Path) -> tuple[Signals, list[LogFinding]]:
    step = _hold(signals.q)
    if step is None:
        return signals, []
    rows = _updates(signals.q, step)
    logged, true = 1 / interval(signals.time), 1 / interval(signals.time[rows])
    note = f"{path}: positions change at {true:.4g} Hz, samples are stamped at {logged:.4g} Hz; taken at the former"
    evidence = {"logged_hz": logged, "true_hz": true}
    return signals.rows(rows), [LogFinding("held_samples", "q", (path.stem,), True, True, evidence, note)]


def _without_frozen(signals: Signals, path: Path, joints: Sequence[str]) -> tuple[Signals, list[LogFinding]]:
    lost = list(frozen(signals, joints)) if len(signals.time) >= FEWEST else []
    if not lost:
        return signals, []
    measured = np.ones(len(signals.time), dtype=bool)
    for _, stretch in lost:
        measured[stretch] = False
    columns = list(dict.fromkeys(column for column, _ in lost))
    ends = sorted((float(signals.time[rows.start]), float(signals.time[rows.stop - 1])) for _, rows in lost)
    start, stop = ends[0]
    others = "" if len({rows.start for _, rows in lost}) == 1 else ", and later"
    say = (
        f"{path}: {', '.join(columns)} froze from {start:.2f} to {stop:.2f} s{others}, though the robot moved: nothing "
        f"was measured there; {np.sum(~measured)} samples are left out"
    )
    evidence = {"start": start, "stop": stop, "left_out": float(np.sum(~measured))}
    findings = [LogFinding("frozen", column, (path.stem,), True, True, evidence, say) for column in columns]
    return signals.rows(measured), findings


def _hold(q: np.ndarray) -> int | None:
    """Return for how many samples positions (N, n) are held; None where they are not.

    They are where some position changes at a pace of several samples and by steps of any size; where a joint stands or
    creeps, so that its encoder counts up only now and then, they are not.
    """
    steps = np.abs(np.diff(q, axis=0))
    changes = np.flatnonzero(steps.any(axis=1))
    if len(changes) < FEWEST:
        return None
    paces = np.diff(changes)
    usual = float(np.median(paces))
    moving = paces[paces <= 2 * usual]
    if usual < 2 or np.mean(np.abs(moving - usual) <= 1) < _REGULAR or np.mean(paces == 1) > 1 - _REGULAR:
        return None
    smallest = np.where(steps > 0, steps, np.inf).min(axis=0)
    sizes = (steps / smallest)[steps > 0]
    return round(usual) if np.median(sizes) > _STEPS else None


def _updates(q: np.ndarray, step: int) -> np.ndarray:
    """Return the rows at which positions are updated; while they stand, every `step`-th."""
    changes = [0, *(np.flatnonzero(np.diff(q, axis=0).any(axis=1)) + 1).tolist(), len(q)]
    rows = [np.arange(start, max(stop - step // 2, start + 1), step) for start, stop in pairwise(changes)]
    return np.concatenate(rows)


def checked_cutoff(hz: float, runs: Sequence[Signals], label: str) -> float:
    """Return a stated cutoff, Hz. Raises InputError, beginning with `label`, where runs cannot be filtered with it."""
    longest = max(float(run.time[-1] - run.time[0]) for run in runs)
    least, most = FEWEST_PERIODS / longest, min(0.5 / interval(run.time) for run in runs)
    if not least <= hz < most:
        raise InputError(
            f"{label} should be at least {least:.3g} Hz, {FEWEST_PERIODS} periods in the longest run, and below "
            f"{most:.4g} Hz, half the slowest sampling rate, not {hz:g} Hz"
        )
    return hz


def frozen(signals: Signals, joints: Sequence[str]) -> Iterator[tuple[str, slice]]:
    """Yield the columns of positions, torques and power that froze for a while, each with these samples.

    A torque or the power stays the same for far longer than it does otherwise, though its joint moves, and jumps before
    or after; at its greatest or least value it may be cut off there, which is another fault. A position stays, and then
    jumps.
    """
    for column, q in zip(CHANNELS["q"].columns(joints), signals.q.T, strict=True):
        steps = np.abs(np.diff(q))
        jump = max(LEAST_RANGE, _JUMP * np.quantile(steps, 0.99))
        yield from ((column, own) for own in _long(q) if own.stop < len(q) and steps[own.stop - 1] > jump)
    for field in ("torque", "power"):
        values = getattr(signals, field)
        if values is None:
            continue
        channel = CHANNELS[field]
        for k, column in enumerate(channel.columns(joints)):
            samples, q = (values[:, k], signals.q[:, k : k + 1]) if channel.per_joint else (values, signals.q)
            ends = {samples.min(), samples.max()} - {0.0}
            # before each sample, and after the last
            steps = np.abs(np.diff(samples, prepend=samples[0], append=samples[-1]))
            jump = _JUMP * np.median(steps[steps > 0]) if steps.any() else np.inf
            for own in _long(samples):
                jumps = max(steps[own.start], steps[own.stop]) > jump
                if jumps and samples[own.start] not in ends and np.ptp(q[own], axis=0).max(initial=0.0) > LEAST_RANGE:
                    yield column, own


def _long(values: np.ndarray) -> Iterator[slice]:
    """Yield where values (N,) stay the same for far longer than they do otherwise."""
    edges = np.concatenate([[0], np.flatnonzero(np.diff(values)) + 1, [len(values)]])
    lengths = np.diff(edges)
    far = np.flatnonzero(lengths >= _LONGER * np.quantile(lengths, 0.99))
    return (slice(int(edges[k]), int(edges[k + 1])) for k in far)
