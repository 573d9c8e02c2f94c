"""How much of the gap a flexible regression on the motion could close, a diagnosis' `yardstick`. It names nothing."""

from __future__ import annotations

import numpy as np
import scipy

from irtwin.document.document import Closeable
from irtwin.effects.friction import sharp_sign
from irtwin.gap.localisation.channel_residuals import ChannelResidual
from irtwin.gap.regression.normal_equations import System
from irtwin.identification.progress import tell_step
from irtwin.signals.filter import decimation, lagged
from irtwin.signals.motion import Motion

_ROWS = 5_000  # that the regression sees
_FOLDS = 8
_TENTS = 7  # over each variable
_WAVES = 60  # random features
_DIMENSIONS = 3  # at most, that one random feature depends on
_SCALES = (0.25, 0.5, 1.0)  # waves over the range of a variable
_RIDGES = (1e-3, 1e-2, 1e-1)  # of the mean square of a feature
_MEMORY = (0.1, 0.5)  # s


def closeable(squares: np.ndarray, floor: np.ndarray | None, least_gap: float) -> Closeable:
    """Return which part of the gap above the floor could be closed, in all equations together.

    squares: (4, g) mean squares on groups left out: of what the twin leaves, refitted to all runs, of what a regression
    of that on the motion does, and of both with the causes. `floor` (g,): RMS of the noise, None where unknown; then
    fractions are of the mean square. They are None where the gap is smaller than `least_gap`, of the floor's.
    """
    plain = squares[0]
    least = np.zeros_like(plain) if floor is None else floor**2
    level = plain if floor is None else least
    gap = float(np.maximum((plain - least) / level, 0.0).sum())

    def share(before: np.ndarray, after: np.ndarray) -> float | None:
        won = float(np.maximum((before - after.clip(least)) / level, 0.0).sum())
        return min(won / gap, 1.0) if gap > least_gap * len(plain) else None

    regressed, closed, rest = squares[1:]
    return Closeable(
        closed=share(plain, closed),
        closeable=share(plain, np.minimum(regressed, rest)),
        by_regression=share(plain, regressed),
        nameless=share(closed, rest),
        of="the mean square, as no floor is known" if floor is None else "the gap above the floor",
    )


def flexible_regression(left: ChannelResidual, seed: int) -> Closeable | None:
    """Regress what the twin leaves on what the motion is, groups of observed runs left out in turn.

    A ridge on tents and random Fourier features (Rahimi and Recht 2007) of angle, speed, acceleration, load,
    temperature, time and what went before, of the joint and of its neighbours, each also times the direction, as
    friction jumps with it. None where there are fewer than two groups or too few samples.
    """
    finding = left.finding
    torque, motions = finding.name == "torque", [trace.motion for trace in left.refitted]
    warm = all(motion.temperature is not None for motion in motions)
    thinned = max(1, sum(len(motion.time) for motion in motions) // _ROWS)
    parts = []
    for plain, closed in zip(left.refitted, left.after or left.refitted, strict=True):
        motion = plain.motion
        tell_step(f"  how much of {finding.name} could be closed, {motion.run}")
        group = _groups(finding.system, motion)
        kept = np.arange(len(group)) % max(thinned, decimation(motion.rate, motion.cutoff) if motion.cutoff else 1) == 0
        kept &= group >= 0
        signs = sharp_sign(motion.dq) if torque else np.zeros((len(group), 1))
        variables = (_of_joints if torque else _of_power)(motion, plain.torque, warm)
        parts.append([each[kept] for each in (group, plain.residual, closed.residual, signs, variables)])
    group, before, after, signs, variables = (np.concatenate(each) for each in zip(*parts, strict=True))
    if len(np.unique(group)) < 2 or len(group) < 10 * _FOLDS:
        return None
    generator = np.random.default_rng(seed)
    sums = []
    for equation in range(before.shape[1]):
        tell_step(f"  how much of {finding.name} could be closed, {equation + 1} of {before.shape[1]}")
        features = _features(variables[:, equation], signs[:, equation], generator)
        sums.append(_regressed(features, np.column_stack([before[:, equation], after[:, equation]]), group))
    return closeable(np.array(sums).T, finding.floor, left.least)


def _groups(system: System, motion: Motion) -> np.ndarray:
    """Return (N,) the group in which samples of a run are left out; -1 for none."""
    found = np.full(len(motion.time), -1)
    for block, group in zip(system.blocks, system.group, strict=True):
        if block.run == motion.run:
            found[(motion.time >= block.start) & (motion.time <= block.stop)] = group
    return found


def _of_joints(motion: Motion, load: np.ndarray, warm: bool) -> np.ndarray:
    """Return each joint's variables, (N, n, v); a neighbour that is not there is still."""
    dq = motion.dq
    before = [_remembered(sharp_sign(dq), motion.rate, seconds) for seconds in _MEMORY]
    own = [motion.q, np.abs(dq), dq, motion.ddq, load, *before, np.repeat(_since(motion), dq.shape[1], axis=1)]
    for values in (motion.q, dq, motion.ddq):
        wide = np.pad(values, ((0, 0), (1, 1)))
        own += [wide[:, :-2], wide[:, 2:]]
    heat = [motion.temperature] if warm and motion.temperature is not None else []
    return np.asarray(np.stack([*own, *heat], axis=2))


def _of_power(motion: Motion, load: np.ndarray, warm: bool) -> np.ndarray:
    """Return the variables of power, (N, 1, v)."""
    dq, work = motion.dq, load * motion.dq
    total = work.sum(axis=1, keepdims=True)
    sums = [total, np.abs(work).sum(axis=1, keepdims=True), _since(motion)]
    slow = [_remembered(total, motion.rate, seconds) for seconds in _MEMORY]
    heat = [motion.temperature] if warm and motion.temperature is not None else []
    columns = np.hstack([work, load**2, np.abs(load), np.abs(dq), dq**2, *sums, *slow, *heat])
    return np.asarray(columns[:, None])


def _since(motion: Motion) -> np.ndarray:
    """Return the time since the run began, (N, 1) s."""
    return np.asarray((motion.time - motion.time[0])[:, None])


def _remembered(values: np.ndarray, rate: float, seconds: float) -> np.ndarray:
    keep = np.exp(-1 / (rate * seconds))
    return lagged(values, keep)


def _features(variables: np.ndarray, signs: np.ndarray, generator: np.random.Generator) -> np.ndarray:
    """Return (N, F): tents over each variable, random waves of a few of them each, and both times the direction."""
    ranks = np.argsort(np.argsort(variables, axis=0), axis=0) / len(variables)  # detail where samples are
    varied = np.ptp(variables, axis=0) > 1e-9
    ranks = ranks[:, varied]
    knots = np.linspace(0, 1, _TENTS)
    tents = np.maximum(1 - np.abs(ranks[:, :, None] - knots) * (_TENTS - 1), 0.0).reshape(len(ranks), -1)
    weights = np.zeros((ranks.shape[1], _WAVES))
    for wave in range(_WAVES):
        count = min(int(generator.integers(2, _DIMENSIONS + 1)), len(weights))
        chosen = generator.choice(len(weights), count, replace=False)
        weights[chosen, wave] = generator.standard_normal(len(chosen)) * _SCALES[wave % len(_SCALES)]
    waves = np.cos(2 * np.pi * ranks @ weights + generator.uniform(0, 2 * np.pi, _WAVES))
    both = np.column_stack([tents, waves])
    return np.column_stack([both, both * signs[:, None]]) if signs.any() else both


def _regressed(features: np.ndarray, residuals: np.ndarray, group: np.ndarray) -> np.ndarray:
    """Return (4,) mean squares on groups left out: of the first residual, after its regression, of the second, ..."""
    kept = np.isfinite(residuals).all(axis=1)
    features, residuals, group = features[kept], residuals[kept], group[kept]
    if len(group) < 2 * _FOLDS:
        return np.zeros(4)
    names = np.unique(group)
    fold = np.searchsorted(names, group) % _FOLDS
    folds = [fold == k for k in range(min(_FOLDS, len(names)))]
    normals = [features[inside].T @ features[inside] for inside in folds]
    rights = [features[inside].T @ residuals[inside] for inside in folds]
    normal, right = np.sum(normals, axis=0), np.sum(rights, axis=0)
    left = np.array([(residuals**2).sum(axis=0)] + [np.zeros(2)] * len(_RIDGES))
    for inside, own, part in zip(folds, normals, rights, strict=True):
        for place, ridge in enumerate(_RIDGES, start=1):
            damped = normal - own + ridge * np.diag(np.diag(normal - own) + 1.0)
            fitted = features[inside] @ scipy.linalg.cho_solve(scipy.linalg.cho_factor(damped), right - part)
            left[place] += ((residuals[inside] - fitted) ** 2).sum(axis=0)
    start, best = left[0] / len(group), left.min(axis=0) / len(group)
    return np.array([start[0], best[0], start[1], best[1]])
