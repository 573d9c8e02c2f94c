"""Where the gap lies, over all channels: each channel's residual, held against its floor or the reference runs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import compress

import numpy as np

from irtwin.document.curves import Curves, Followed, FrictionCurve, PlannedMotion, RunError
from irtwin.document.document import GapLocation
from irtwin.gap.data.case import Case
from irtwin.gap.isolation.explained import Explained
from irtwin.gap.isolation.finding import ChannelFinding
from irtwin.gap.localisation.excess_map import Map, heat_map, joint_maps, level_of, robot_maps
from irtwin.gap.localisation.locations import locate
from irtwin.gap.localisation.operating_variable import curve, followed
from irtwin.gap.regression.channel_equations import Torque
from irtwin.gap.regression.hypotheses import CHANGED
from irtwin.gap.regression.moments import Summed
from irtwin.gap.regression.normal_equations import twin_values
from irtwin.gap.regression.residuals import Trace, Values, as_filtered, power_traces, torque_traces
from irtwin.identification.progress import track
from irtwin.signals.motion import Motion

_HARDLY = 0.1  # of a row: a joint that rests in all other runs would be foretold by numbers that nothing there holds
_UNNAMED = 3  # places that no cause explains, drawn


@dataclass(frozen=True)
class ChannelResidual:
    """What the twin left of one channel in the observed runs, and what it leaves with the causes.

    `before`, `after`: traces without and with the causes, and `seen` the map of the first; `touched`: the joints that
    each cause acts on, none for the whole robot; `added`: what it adds to each trace, (N, g), and `acts` the map of all
    of it. `reference`: the map of the other runs, where the twin is the one that fits these. `level` (g, R): the mean
    square beyond which a gap lies; `least`: the share of it beyond which a run, or a gap, is worth a word.
    """

    finding: ChannelFinding
    before: list[Trace]
    after: list[Trace]
    touched: list[tuple[str, ...]]
    added: list[list[np.ndarray]]
    seen: Map
    acts: Map | None
    reference: Map | None
    level: np.ndarray
    least: float

    @property
    def acting(self) -> np.ndarray:
        """(g,) whether a cause acts there."""
        places = self.finding.places
        return np.array([any(_among(place, joints) for joints in self.touched) for place in places])


def channel_residual(case: Case, explained: Explained, torque: Torque) -> ChannelResidual:
    """Return what the twin left of a channel, given the joint torque that it predicts (for power: that it takes)."""
    finding = explained.finding
    power = finding.name == "power"
    reference = against_reference(finding)

    def traces(runs: Sequence[Motion], values: Values) -> list[Trace]:
        of_runs = []
        for run in track(runs, lambda motion: f"{finding.name} that is left of {motion.run}"):
            of_runs += (power_traces if power else torque_traces)(explained.stack, [run], values, torque)
        return of_runs

    before = traces(case.seen, fitted_values(finding, reference=reference))
    others = traces(case.others, fitted_values(finding, reference=True)) if reference else []
    added = [_added(explained, k, before) for k in range(len(finding.causes))]
    after, acting = [], []
    if added:
        acting = [_of(trace, sum(parts)) for trace, *parts in zip(before, *added, strict=True)]
        plain = traces(case.seen, lambda run: explained.values)
        after = [replace(t, residual=t.residual - sum(parts)) for t, *parts in zip(plain, *added, strict=True)]
    slow = case.thresholds.data.little
    seen, acts, known = (robot_maps if power else joint_maps)((before, acting, others), case.grouping, slow)
    assert seen is not None
    return ChannelResidual(
        finding,
        before,
        after,
        [cause.touched(case.robot) for cause in finding.causes],
        added,
        seen,
        acts,
        known,
        level_of(finding.floor, seen, known),
        case.thresholds.matters.floors**2,
    )


def _among(place: str | None, joints: tuple[str, ...]) -> bool:
    """Return whether what acts on some joints, none for the whole robot, acts at a place, None for all of it."""
    return place in (None, *joints) or not joints


def against_reference(finding: ChannelFinding) -> bool:
    """Return whether to hold the observed runs against the others: there are some, and the gap is not in both."""
    return finding.system.both and (not finding.causes or any(cause.scope == CHANGED for cause in finding.causes))


def places(left: Sequence[ChannelResidual], seed: int, leaving: tuple[str, int] | None = None) -> list[GapLocation]:
    """Return the ranked places of the gap: of the channel with the largest cause first, else the largest excess.

    `leaving`: the channel, and the place in it, whose excess leaves the gap open; it is named, sure or not.
    """
    channel, place = leaving or (None, None)
    located = [
        (residual, _places(residual, seed, place if residual.finding.name == channel else None)) for residual in left
    ]

    def order(pair: tuple[ChannelResidual, list[GapLocation]]) -> tuple[float, float]:
        gain = max((cause.gain for cause in pair[0].finding.causes), default=0.0)
        return -gain, -max((place.excess for place in pair[1]), default=0.0)

    return [place for _, own in sorted(located, key=order) for place in own]


def cause_curves(left: Sequence[ChannelResidual]) -> list[Followed]:
    """Return each cause's curve, on the residual that all the others leave."""
    lines = []
    for residual in left:
        for cause, joints, added in zip(residual.finding.causes, residual.touched, residual.added, strict=True):
            alone = [_of(trace, part) for trace, part in zip(residual.after, added, strict=True)]
            partial = [
                replace(trace, residual=trace.residual + part)
                for trace, part in zip(residual.after, added, strict=True)
            ]
            for k, joint in enumerate(residual.finding.places):
                best = followed(alone, k, joint) if _among(joint, joints) else None
                if best:
                    lines.append(curve(residual.finding.name, partial, k, joint, best[0], cause.effect, added))
    return lines


def unnamed_curves(left: Sequence[ChannelResidual], located: Sequence[GapLocation], most: int) -> list[Followed]:
    """Return the residual against what it follows, at the foremost places on which no cause acts."""
    lines: list[Followed] = []
    for residual in left:
        named = set(compress(residual.finding.places, residual.acting))
        own = [place.joint for place in located if place.channel == residual.finding.name and place.joint not in named]
        for joint in list(dict.fromkeys(own))[:most]:
            k = residual.finding.places.index(joint)
            if best := followed(residual.before, k, joint):
                lines.append(curve(residual.finding.name, residual.before, k, joint, best[0]))
    return lines


def _of(trace: Trace, added: np.ndarray) -> Trace:
    return replace(trace, residual=np.where(np.isfinite(trace.residual), added, np.nan))


def _added(explained: Explained, k: int, traces: Sequence[Trace]) -> list[np.ndarray]:
    """Return what a cause adds to each trace, (N, g), as a measurement would show it."""
    cause, parts = explained.finding.causes[k], []
    for trace in traces:
        part = as_filtered(trace.motion, explained.added(cause, trace.motion))
        parts.append(part.reshape(trace.residual.shape))
    return parts


def _places(left: ChannelResidual, seed: int, leaving: int | None) -> list[GapLocation]:
    names = left.finding.places
    best = []
    about = f"what {left.finding.name} follows"
    for k, joint in track(enumerate(names), lambda numbered: f"{about} at {numbered[1]}" if numbered[1] else about):
        best.append(followed(left.before, k, joint))
    located = locate(
        left.finding.name,
        names,
        [variable[0] if variable else None for variable in best],
        left.seen,
        left.level,
        reference=left.reference,
        acting=left.acting,
        acts=left.acts,
        leaving=leaving,
        seed=seed,
    )
    return [replace(place, runs=_standing_out(left, names.index(place.joint))) for place in located]


def _standing_out(left: ChannelResidual, place: int) -> tuple[str, ...]:
    """Return the runs whose mean square stands out over the level, the worst first."""
    squares = {trace.motion.run: trace.residual[:, place] ** 2 for trace in left.before}
    means = {run: float(np.nanmean(own)) for run, own in squares.items() if np.isfinite(own).any()}
    above = [run for run, mean in means.items() if mean > (1 + left.least) * left.level[place].min()]
    return tuple(sorted(above, key=lambda run: -means[run]))


def fitted_values(finding: ChannelFinding, *, reference: bool) -> Values:
    """Return the coefficients of the twin alone, without causes, for each run.

    They are fitted to all runs; with `reference` to the runs beside the observed ones, without the run's own group.
    Rows of observed runs count little then: they tell what the others hardly say anything of.
    """
    system = finding.system
    moments = system.moments(finding.rmse)
    if not reference:
        whole = twin_values(system, system.solution((), Summed(moments)))
        return lambda run: whole
    groups = np.flatnonzero(~system.group_observed)
    total = Summed(
        [own.times(_HARDLY) if seen else own for own, seen in zip(moments, system.group_observed, strict=True)]
    )
    whole = twin_values(system, system.solution((), total))
    own: dict[str, np.ndarray] = {}
    for group in groups if len(groups) > 1 else ():
        without = twin_values(system, system.solution((), total, moments[group]))
        own |= dict.fromkeys((system.blocks[k].run for k in np.flatnonzero(system.group == group)), without)
    return lambda run: own.get(run, whole)


def drawn(
    left: Sequence[ChannelResidual],
    located: Sequence[GapLocation],
    planned: PlannedMotion | None,
    friction: tuple[FrictionCurve, ...],
) -> Curves:
    """Return what a page draws: of what the twin left of each channel, where that lies, what is planned, friction."""
    maps = [
        heat_map([joint for joint in residual.finding.places if joint is not None], residual.seen, residual.level)
        for residual in left
        if residual.finding.name == "torque"
    ]
    return Curves(
        follows=(*cause_curves(left), *unnamed_curves(left, located, _UNNAMED)),
        runs=tuple(line for residual in left for line in _per_run(residual.finding)),
        heat_map=next(iter(maps), None),
        experiment=planned,
        friction=friction or None,
    )


def _per_run(finding: ChannelFinding) -> Iterator[RunError]:
    judged = finding.held_out
    for group, runs in enumerate(finding.groups):
        for k, joint in enumerate(finding.places):
            rows = max(float(judged.rows[group, k]), 1.0)
            for run in runs:
                yield RunError(
                    run=run,
                    joint=joint,
                    before=float(np.sqrt(judged.before[group, k] / rows)),
                    after=float(np.sqrt(judged.after[group, k] / rows)),
                    floor=None if finding.floor is None else float(finding.floor[k]),
                )
