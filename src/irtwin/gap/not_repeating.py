"""What does not repeat, in the document: listed, as causes where an effect explains it, and in what is closed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
import scipy

from irtwin.document import document
from irtwin.document.document import cause_ids
from irtwin.effects.effect import Quantity
from irtwin.gap.data.noise_floor import Floor
from irtwin.gap.isolation.closing import Closing, closing
from irtwin.gap.isolation.finding import ChannelFinding
from irtwin.gap.regression.hypotheses import MISSING
from irtwin.gap.repeats.disturbances import Disturbance
from irtwin.gap.repeats.removal import Removed
from irtwin.gap.thresholds import Matters
from irtwin.gap.writing import fraction_closed, numbers, parameter

_LEAST_P = 1e-6  # of what a p tells
_MOST = 0.5  # of what is closed in a channel
_One = TypeVar("_One")


def with_removed(finding: ChannelFinding, taken: Sequence[Removed]) -> ChannelFinding:
    """Return a finding whose residual before anything is added holds what was taken out, on groups left out."""
    judged, own = finding.held_out, [removal for removal in taken if removal.disturbance.channel == finding.name]
    if not own:
        return finding
    squares = sum(_squares(finding, removal) for removal in own)
    closed = float(np.sum((judged.before - judged.after) / _level(finding)))
    more = float(np.sum(squares / _level(finding)))
    part = max(closed, 0.0) / max(max(closed, 0.0) + more, 1e-300)
    held_out, counted = (replace(groups, before=groups.before + squares) for groups in (judged, finding.counted))
    return replace(finding, held_out=held_out, counted=counted, part=part)


def _level(finding: ChannelFinding) -> np.ndarray:
    """Return (g,) by which squares of equations are compared: the floor's."""
    return np.ones(len(finding.places)) if finding.floor is None else finding.floor**2


def _squares(finding: ChannelFinding, removal: Removed) -> np.ndarray:
    """Return (G, g) the squares of what was taken out in each group left out and equation of its channel."""
    rows, place = finding.held_out.rows, finding.places.index(removal.disturbance.joint)
    squares = np.zeros(rows.shape)
    squares[:, place] = rows[:, place] * np.array([removal.mean_square(runs) for runs in finding.groups])
    return squares


@dataclass(frozen=True)
class DifferingRepeats:
    """What was `taken` out of all that was `found` to differ between repeats.

    `channels`: the findings with what was taken out in them; `joints`: all of the robot.
    """

    taken: tuple[Removed, ...]
    found: tuple[Disturbance, ...]
    floor: Floor
    channels: tuple[ChannelFinding, ...]
    joints: tuple[str, ...]

    @property
    def _named(self) -> list[tuple[Removed, str]]:
        """What was taken out, each with the id of its cause."""
        ids = cause_ids([(removal.effect.id, removal.joints) for removal in self.taken], self.joints)
        return list(zip(self.taken, ids, strict=True))

    def listed(self) -> tuple[document.NotRepeating, ...] | None:
        """Return all that differs, the largest share first."""
        explained = {id(removal.disturbance): (removal, name) for removal, name in self._named}
        places = [f"{disturbance.kind}@{disturbance.joint or disturbance.channel}" for disturbance in self.found]
        listed = []
        for k, disturbance in enumerate(self.found):
            by, name = explained.get(id(disturbance), (None, None))
            before = places[:k].count(places[k])
            listed.append(
                document.NotRepeating(
                    id=places[k] + (f"#{before + 1}" if before else ""),
                    channel=disturbance.channel,
                    joint=disturbance.joint,
                    kind=disturbance.kind,
                    rms=float(np.sqrt(disturbance.size)),
                    share=disturbance.share,
                    quantities=tuple(map(_quantity, disturbance.quantities if by is None else by.quantities)),
                    explained_by=name,
                )
            )
        return tuple(listed) or None

    def gap(self, gap: document.Gap) -> document.Gap:
        """Return the gap with the sensors' part of the floors."""
        torque, power = self.floor.sensor_torque, self.floor.sensor_power
        sizes = gap.torque and {
            joint: size if torque is None else replace(size, sensor_noise=float(torque[k]))
            for k, (joint, size) in enumerate(gap.torque.items())
        }
        return replace(gap, torque=sizes, power=gap.power and replace(gap.power, sensor_noise=power))

    def causes(self, others: Sequence[document.Cause]) -> tuple[document.Cause, ...]:
        """Return all causes: what takes most of what is closed in its channel goes before the others."""
        own = []
        for removal, name in self._named:
            evidence = document.Evidence(
                channel=removal.disturbance.channel,
                share_of_what_is_closed=self._share(removal),
                closed_where_it_acts=removal.gain,
                gain=removal.gain,
                log_odds=_log_odds(removal.disturbance.p),
                probability_of_rivals={},
            )
            own.append(
                document.Cause(
                    id=name,
                    effect=removal.effect.id,
                    joints=removal.joints,
                    scope=MISSING,
                    confidence=float(scipy.special.expit(evidence.log_odds)),
                    parameters=tuple(map(parameter, removal.quantities)),
                    indistinguishable_from=(),
                    evidence=evidence,
                )
            )
        return _around(others, own, [cause.evidence.share_of_what_is_closed or 0.0 for cause in own])

    def findings(
        self, others: Sequence[document.Finding], causes: Sequence[document.Cause], limits: Matters
    ) -> tuple[document.Finding, ...]:
        """Return all findings: of what was taken out each is one, with its cause alone; the order is that of causes.

        The largest of all that differs matters where nothing else does: it is a gap, however little it is.
        """
        alone = not any(finding.matters for finding in others)
        sure = {cause.id: cause.confidence for cause in causes}
        own = []
        for removal, name in self._named:
            won = self._closing(removal)
            own.append(
                document.Finding(
                    id=name,
                    family=removal.effect.family,
                    joints=removal.joints,
                    scope=MISSING,
                    channel=removal.disturbance.channel,
                    confidence=sure[name],
                    share=won.share,
                    share_interval95=won.interval,
                    share_of=won.share_of,
                    matters=won.matters(limits) or (alone and removal.disturbance is self.found[0]),
                    members=(
                        document.Member(
                            cause=name, effect=removal.effect.id, family=removal.effect.family, confidence=sure[name]
                        ),
                    ),
                )
            )
        return _around(others, own, [finding.share for finding in own])

    def _closing(self, removal: Removed) -> Closing:
        finding = self._finding(removal)
        squares = _squares(finding, removal)
        return closing(
            squares, squares.sum(axis=1) > 0, finding.counted, finding.floor_within, finding.attribution.noise
        )

    def shrink(self, shrink: document.Shrink, *, between: bool) -> document.Shrink:
        """Return how far the gap shrinks, with what was taken out; `between` sides, as `writing.shrink` has it."""
        if not self.taken:
            return shrink
        changed = [channel.name for channel in self.channels if channel.causes or self._of(channel.name)]
        fraction = fraction_closed(self.channels, changed, between=between)
        return replace(shrink, closed_fraction=fraction, by_cause=(*shrink.by_cause, *self._by_cause()))

    def _of(self, channel: str) -> list[Removed]:
        return [removal for removal in self.taken if removal.disturbance.channel == channel]

    def _finding(self, removal: Removed) -> ChannelFinding:
        return next(channel for channel in self.channels if channel.name == removal.disturbance.channel)

    def _mean_squares(self, removal: Removed) -> np.ndarray:
        """Return (g,) its mean square in each equation of its channel, over the groups judged."""
        finding = self._finding(removal)
        return finding.held_out.rmse(_squares(finding, removal)) ** 2

    def _share(self, removal: Removed) -> float | None:
        """Return its part of what the causes of its channel close together."""
        finding = self._finding(removal)
        level = _level(finding)
        own = {id(each): float(np.sum(self._mean_squares(each) / level)) for each in self._of(finding.name)}
        left = 1 - sum(finding.shares) if finding.shares else 1.0
        return left * own[id(removal)] / sum(own.values()) if sum(own.values()) > 0 else None

    def _by_cause(self) -> list[document.CauseChange]:
        changes = []
        for removal, name in self._named:
            finding, squares = self._finding(removal), self._mean_squares(removal)
            judged = finding.held_out
            before, after = judged.rmse(judged.before), judged.rmse(judged.after)
            changes.append(
                document.CauseChange(
                    cause=name,
                    effect=removal.effect.id,
                    joints=removal.joints,
                    scope=MISSING,
                    channel=finding.name,
                    share=self._share(removal),
                    rmse_before=numbers(before),
                    rmse_alone=numbers(np.sqrt(np.maximum(before**2 - squares, 0.0))),
                    rmse_when_left_out=numbers(np.sqrt(after**2 + squares)),
                    rmse_with_all=numbers(after),
                )
            )
        return changes


def _around(others: Sequence[_One], own: Sequence[_One], shares: Sequence[float]) -> tuple[_One, ...]:
    """Return all, those of our own that have most of what is closed before the others."""
    first = [item for item, share in zip(own, shares, strict=True) if share >= _MOST]
    return (*first, *others, *(item for item in own if item not in first))


def _quantity(quantity: Quantity) -> document.DisturbanceQuantity:
    own = parameter(quantity)
    return document.DisturbanceQuantity(
        name=own.name, joint=own.joint, value=own.value, unit=own.unit, interval95=own.interval95
    )


def _log_odds(p: float) -> float:
    """Return the least log odds against chance that a p leaves, at even odds (Sellke, Bayarri and Berger 2001)."""
    p = max(p, _LEAST_P)
    return -math.log(-math.e * p * math.log(p)) if p < 1 / math.e else 0.0
