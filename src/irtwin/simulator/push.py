"""Forces that push a robot at its flange for a while, told by where it is beside what its model does.

What a joint is off is made into the torque that would do that: by its inertia, its damping and its servo. Where in time
a force at the flange explains the torques of all joints together, it is fitted by rollouts of the whole model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from irtwin.effects.effect import NORMAL
from irtwin.gap.thresholds import DEFAULT
from irtwin.identification.progress import tell_step
from irtwin.signals.filter import smoothed
from irtwin.signals.sampling import interval
from irtwin.simulator.choice import DifferingNumbers, certainty
from irtwin.simulator.fit import Fit, Played
from irtwin.simulator.play import PlayedStretch, Push, play
from irtwin.simulator.servos import NAMES

_BIN = 0.1  # s, in which torque that is left is one sample
_BLOCK = 0.5  # s, of which what is left is one number
_SMOOTH = 0.3  # s, over which what is off is smoothed for its acceleration
_SHORTEST, _MOST = 3, 3  # bins of a push; pushes
_LIKELY = 100.0  # N, standard deviation of a force along an axis
_DEVIATIONS = np.array([_LIKELY] * 3 + [1e6] * 3)  # of its ends, s, nothing is known before
_ROUGH = 0.01  # of a force: how it comes and goes is not known
_SHARP = 0.01  # s, in which a push comes at least
_STEPS = np.array([1.0] * 3 + [0.02] * 3)  # N; s, of difference quotients
_PASSES = 6


@dataclass(frozen=True)
class FoundPush:
    """A push, with how sure it is: natural logarithm of odds, and standard deviations of force (3,), N, and of ends."""

    push: Push
    odds: float
    deviation: np.ndarray

    @property
    def numbers(self) -> list[tuple[str, str, float, float]]:
        """Its force, that along three axes, start and stop: symbol, unit, number, half of its 95 % interval."""
        push, half = self.push, NORMAL * self.deviation
        size = float(np.linalg.norm(push.force))
        values = [size, *push.force.tolist(), push.start, push.stop]
        halves = [float(np.linalg.norm(push.force / max(size, 1e-12) * half[:3])), *half[:5].tolist()]
        names = [("f", "N"), ("f_x", "N"), ("f_y", "N"), ("f_z", "N"), ("start", "s"), ("stop", "s")]
        return [(*name, value, width) for name, value, width in zip(names, values, halves, strict=True)]


def find_pushes(chosen: DifferingNumbers) -> tuple[FoundPush, ...]:
    """Return the pushes beside a model with numbers, those of most evidence first; none where the evidence has none."""
    pushes = list[FoundPush]()
    best = chosen.fit.rolled(chosen.played.at)
    fit = replace(chosen.fit, floor=np.maximum(_quiet(chosen.fit, best), chosen.fit.least))
    while len(pushes) < _MOST:
        first = _likeliest(fit, best)
        tried = None if first is None else _fitted(fit, best, *first)
        if tried is None or tried[0].odds <= 0 or not _matters(fit, best, tried[1]):
            break
        pushes.append(tried[0])
        best = tried[1]
        stretches = tuple(replace(stretch, pushes=(*stretch.pushes, tried[0].push)) for stretch in fit.stretches)
        fit = replace(fit, alone=replace(fit.alone, stretches=stretches), known={})
    return tuple(pushes)


def _matters(fit: Fit, before: Played, after: Played) -> bool:
    """Return whether any stretch is closer to its robot by what matters beside what is left at usual times."""
    least = (DEFAULT.matters.floors * fit.floor) ** 2
    return bool((before.squares - after.squares >= least).any())


def _quiet(fit: Fit, best: Played) -> np.ndarray:
    """Return what is left at usual times (c, n), root mean square: half of the time may be pushed."""
    squares = [
        _binned(left**2, interval(stretch.time), _BLOCK)
        for stretch, left in zip(fit.stretches, best.remainders, strict=True)
    ]
    return np.asarray(np.sqrt(np.median(np.concatenate(squares), axis=0)))


def _likeliest(fit: Fit, best: Played) -> tuple[int, Push] | None:
    """Return the stretch and the window where a constant force explains most of what torque is left."""
    numbers = fit.servos.of_chart(best.at)
    torques = [
        _left(fit, stretch, left[:, 0], numbers) for stretch, left in zip(fit.stretches, best.remainders, strict=True)
    ]
    every = np.concatenate(torques)
    noise = np.maximum(1.4826 * np.median(np.abs(every), axis=0), 1e-3 * np.abs(every).max(axis=0) + 1e-9)
    best_gain, likeliest = float(np.log(len(every) ** 2)), None
    for place, (stretch, torque) in enumerate(zip(fit.stretches, torques, strict=True)):
        if len(torque) < _SHORTEST:
            continue
        jacobian = _binned(fit.servos.model.flange_jacobian(stretch.q), interval(stretch.time))[-len(torque) :]
        gain, begin, stop, force = _window(jacobian, torque / noise, noise)
        if gain > best_gain:
            lasts = _samples(interval(stretch.time), _BIN) * interval(stretch.time)
            start = stretch.begin + stretch.time[-1] - (len(torque) - np.array([begin, stop])) * lasts
            best_gain, likeliest = gain, (place, Push(stretch.run.name, force, *start.tolist()))
    return likeliest


def _left(fit: Fit, stretch: PlayedStretch, off: np.ndarray, numbers: np.ndarray) -> np.ndarray:
    """Return the torque (bins, n) that would make joints off (N, n) from the model; bins are counted from the end."""
    gap = interval(stretch.time)
    smooth = smoothed(off, gap, _SMOOTH)
    inertia = fit.servos.model.links + numbers[NAMES.index("armature")]
    torque = inertia * smooth[2] + numbers[NAMES.index("damping")] * smooth[1]
    torque += (numbers[0] + numbers[NAMES.index("spring")]) * smooth[0]
    return _binned(torque, gap)


def _binned(values: np.ndarray, gap: float, lasts: float = _BIN) -> np.ndarray:
    size = _samples(gap, lasts)
    count = len(values) // size
    return np.asarray(values[len(values) - count * size :].reshape(count, size, *values.shape[1:]).mean(axis=1))


def _samples(gap: float, lasts: float) -> int:
    return max(1, round(lasts / gap))


def _window(jacobian: np.ndarray, torque: np.ndarray, noise: np.ndarray) -> tuple[float, int, int, np.ndarray]:
    """Return what the best window gains, in natural logarithms, its first bin and the one after it, and its force."""
    columns = jacobian / noise
    normal = np.einsum("bik,bjk->bij", columns, columns)
    right = np.einsum("bik,bk->bi", columns, torque)
    normals = np.concatenate([np.zeros((1, 3, 3)), np.cumsum(normal, axis=0)])
    rights = np.concatenate([np.zeros((1, 3)), np.cumsum(right, axis=0)])
    begin, stop = np.triu_indices(len(rights), _SHORTEST)
    least = np.eye(3) / _LIKELY**2
    force = np.linalg.solve(normals[stop] - normals[begin] + least, (rights[stop] - rights[begin])[..., None])[..., 0]
    gain = np.einsum("wi,wi->w", force, rights[stop] - rights[begin]) / 2
    at = int(gain.argmax())
    return float(gain[at]), int(begin[at]), int(stop[at]), force[at]


def _fitted(fit: Fit, best: Played, place: int, push: Push) -> tuple[FoundPush, Played] | None:
    """Return a push of a stretch, its force and its ends fitted by rollouts, and what the model does with it."""
    here = _played(fit, best, place, [push])[0]
    for _ in range(_PASSES):
        moved = _played(fit, best, place, [_changed(push, change) for change in np.diag(_STEPS)])
        sums = fit.sums(here, range(len(_STEPS)), moved, _STEPS)
        off = np.append(push.force, np.zeros(3)) / _LIKELY
        equations = sums.together().together().likely(off, _DEVIATIONS).damped(1e-9)
        step = equations.step()
        step[3:] = np.clip(step[3:], -0.2, 0.2)
        before, ways = fit.total(here), [_stepped(push, share * step) for share in (1.0, 0.3)]
        tried = zip((push, *ways), (here, *_played(fit, best, place, ways)), strict=True)
        push, here = min(tried, key=lambda pair: fit.total(pair[1]))
        tell_step(f"  a push of {np.linalg.norm(push.force):.3g} N from {push.start:.3g} to {push.stop:.3g} s")
        if before - fit.total(here) < 0.05:
            break
    fit = replace(fit, certainty=certainty(here))  # of what is left beside it
    variance = equations.variance.copy()
    runs = sum(stretch.time[-1] for stretch in fit.stretches) / _BIN
    worth = np.log(runs**2 / 2) + np.log(_LIKELY**2 / variance[:3]).sum() / 2 + np.log(len(NAMES))
    gain = fit.total(best) - fit.total(here)
    odds = gain - float(push.force @ push.force) / _LIKELY**2 / 2 - float(worth)
    variance[:3] += (_ROUGH * np.linalg.norm(push.force)) ** 2 / 3
    return FoundPush(push, odds, np.sqrt(variance)), here


def _changed(push: Push, change: np.ndarray) -> Push:
    """Return a push with its numbers, force, ends and rise, changed by so much (6,)."""
    start, stop, rise = (np.array([push.start, push.stop, push.rise]) + change[3:]).tolist()
    return replace(push, force=push.force + change[:3], start=start, stop=stop, rise=rise)


def _stepped(push: Push, step: np.ndarray) -> Push:
    """Return a push after a step (6,), no shorter and no sharper than one can be."""
    ahead = _changed(push, step)
    stop = max(ahead.stop, ahead.start + 2 * _BIN)
    return replace(ahead, stop=stop, rise=min(max(ahead.rise, _SHARP), (stop - ahead.start) / 2))


def _played(fit: Fit, best: Played, place: int, pushes: Sequence[Push]) -> list[Played]:
    """Return what the model does with each of some pushes in a stretch: the other stretches as they were."""
    numbers = fit.servos.of_chart(best.at)
    own = fit.stretches[place]
    stretches = [replace(own, pushes=(*own.pushes, push)) for push in pushes]
    moved = play(fit.servos, [numbers], stretches)[0]
    return [fit.replaced(best, place, motion) for motion in moved]
