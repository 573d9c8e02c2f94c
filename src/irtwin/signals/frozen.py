"""Stretches in which a channel froze: it was logged on, and nothing was measured."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from irtwin.signals.channels import CHANNELS, Signals

LEAST_RANGE = 0.02  # rad or m: a joint that spans less does not move
_LONGER = 10.0  # times as long as a value stays otherwise; tiago's torque, in steps of 0.02 N m, stays 7 times as long
_JUMP = 5.0  # times the longest usual step of a position, or the median one of others: it changed meanwhile


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
            one, q = (values[:, k], signals.q[:, k : k + 1]) if channel.per_joint else (values, signals.q)
            ends = {one.min(), one.max()} - {0.0}
            steps = np.abs(np.diff(one, prepend=one[0], append=one[-1]))  # before each sample, and after the last
            jump = _JUMP * np.median(steps[steps > 0]) if steps.any() else np.inf
            for own in _long(one):
                jumps = max(steps[own.start], steps[own.stop]) > jump
                if jumps and one[own.start] not in ends and np.ptp(q[own], axis=0).max(initial=0.0) > LEAST_RANGE:
                    yield column, own


def _long(values: np.ndarray) -> Iterator[slice]:
    """Yield where values (N,) stay the same for far longer than they do otherwise."""
    edges = np.concatenate([[0], np.flatnonzero(np.diff(values)) + 1, [len(values)]])
    lengths = np.diff(edges)
    far = np.flatnonzero(lengths >= _LONGER * np.quantile(lengths, 0.99))
    return (slice(int(edges[k]), int(edges[k + 1])) for k in far)
