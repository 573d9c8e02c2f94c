"""What to measure next: the programme, of those that the robot's limits allow, that tells rivals apart."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import log, sqrt

import numpy as np

from irtwin.document.curves import PlannedMotion
from irtwin.document.experiment import Considered, Experiment, Question
from irtwin.effects.catalogue import catalogue
from irtwin.gap.isolation.cause import FoundCause
from irtwin.gap.isolation.finding import ChannelFinding, branches
from irtwin.gap.isolation.posterior import overlap
from irtwin.gap.regression.hypotheses import Hypothesis
from irtwin.gap.rehearsal import Equations, Rehearsal
from irtwin.gap.thresholds import Criterion, Thresholds
from irtwin.identification.programmes import LONGEST, ExperimentProgramme, programmes
from irtwin.identification.progress import track
from irtwin.robot.description import Robot
from irtwin.signals.motion import Motion

_DRAWN = 400  # points of a curve on a page
_LEAST = 1.0  # standard deviations: what adds less is not worth making
_FAR = -700.0  # log of a chance that is none


Weighed = tuple[ExperimentProgramme, list[Question]]


@dataclass(frozen=True)
class ProposedExperiment:
    """The experiment that is proposed, its programme (None where none helps), and the curve that a page draws."""

    experiment: Experiment
    programme: ExperimentProgramme | None
    curve: PlannedMotion | None


@dataclass(frozen=True)
class _Asked:
    """One question: is it the effect at these joints (of the whole robot: all), and none of its rivals?

    `now`: how far each rival is behind, in standard deviations; of an effect that does not show, `None` alone: nothing.
    """

    effect: str
    scope: str
    joints: tuple[str, ...]
    now: Mapping[str | None, float]
    rehearsal: Rehearsal

    @property
    def rivals(self) -> list[str]:
        """The rivals' names."""
        return [rival for rival in self.now if rival is not None]

    def answered(self, programme: ExperimentProgramme) -> list[Question]:
        """Return what a programme would tell: of each rival by itself."""
        shown = _of(self.rehearsal.causes(programme), self.effect, self.scope)
        return [
            Question(
                effects=(self.effect, *filter(None, [rival])),
                separation_now=_rounded(now),
                expected_separation=_rounded(max(now, separation(shown, rival))),
            )
            for rival, now in self.now.items()
        ]


def _of(causes: Sequence[FoundCause], effect: str, scope: str) -> FoundCause:
    return next(cause for cause in causes if (cause.effect, cause.scope) == (effect, scope))


def separation(cause: FoundCause, rival: str | None) -> float:
    """Return by how many standard deviations a rival is behind: a normal's that is as unlikely beside its middle.

    None: nothing is in the cause's place.
    """
    if rival is None:
        return sqrt(2 * max(cause.log_odds, 0.0))
    chances = cause.probability, cause.rivals.get(rival, 0.0)
    likely, unlikely = (log(chance) if chance > 0 else _FAR for chance in chances)
    return sqrt(2 * max(likely - unlikely, 0.0))


def next_experiment(
    robot: Robot,
    channels: Sequence[tuple[ChannelFinding, Equations]],
    lacking: Sequence[str],
    seen: Sequence[Motion],
    limits: Thresholds,
) -> ProposedExperiment | None:
    """Design what tells the rivals of causes that matter apart; where there are none, what shows the effects `lacking`.

    `channels`: each finding with its channel's equations; `seen`: the motions that were judged. Of the programmes after
    which no rival would be named any more the one that takes the least time is chosen, else the one that answers the
    most. None where there is nothing to ask.
    """
    enough = sqrt(-2 * log(limits.criterion.unknown))
    asked = [question for channel in channels for question in _rivals(robot, *channel, limits)] or [
        question
        for channel in channels
        for question in _unseen(robot, *channel, lacking, limits.criterion)
        if question.now[None] < enough
    ]
    if not asked:
        return None
    names = tuple(dict.fromkeys(name for question in asked for name in (question.effect, *question.rivals)))
    joints = tuple(joint for joint in robot.joint_names if any(joint in question.joints for question in asked))
    effects = [catalogue()[name] for name in names]
    every = track(
        programmes(robot, joints, seen, effects), lambda programme: f"weighing {programme.kind.replace('_', ' ')}"
    )
    weighed = [
        (programme, [question for each in asked for question in each.answered(programme)]) for programme in every
    ]
    note = _note([told for _, told in weighed], enough)
    weighed = _answerable(weighed, enough)
    chosen, questions = _best(weighed, enough)
    by_hand = tuple(effect.manual_test for effect in effects if effect.manual_test)
    motions = (chosen.text,) if chosen else by_hand
    if not motions and not any(question.rivals for question in asked):
        return None  # what nothing would show is among what is not testable; that rivals cannot be told apart is news
    experiment = Experiment(
        purpose="; ".join(
            f"tell {question.effect} from {', '.join(question.rivals)}" for question in asked if question.rivals
        )
        or f"show {', '.join(names)}",
        effects=names,
        joints=joints,
        motions=motions,
        expected_separation=min(question.expected_separation for question in questions) if chosen else None,
        separation_now=_rounded(min(now for question in asked for now in question.now.values())),
        separation_that_is_enough=_rounded(enough),
        questions=tuple(questions),
        programme=chosen.said if chosen else None,
        considered=tuple(
            Considered(
                kind=programme.kind,
                minutes=round(programme.cost / 60, 1),
                expected_separation=min(question.expected_separation for question in told),
            )
            for programme, told in weighed
        ),
        note=note,
    )
    return ProposedExperiment(experiment, chosen, None if chosen is None else curve(robot, chosen))


def _rivals(robot: Robot, finding: ChannelFinding, equations: Equations, limits: Thresholds) -> Iterator[_Asked]:
    """Yield a question for each cause that a person is told of and that has rivals."""
    told = [cause for branch in branches(finding) if branch.closing.matters(limits.matters) for cause in branch.causes]
    true, sizes = _known(finding)
    for cause in told:
        near = cause.not_told_from(limits.criterion.unknown)
        own = [
            hypothesis for hypothesis in true if (hypothesis.effect, hypothesis.scope) == (cause.effect, cause.scope)
        ]
        rivals = tuple(
            rival
            for rival in finding.attribution.hypotheses
            if rival.effect in near and any(overlap(rival, hypothesis) for hypothesis in own)
        )
        now: dict[str | None, float] = {
            name: separation(cause, name) for name in near if any(rival.effect == name for rival in rivals)
        }
        if now:
            rehearsal = Rehearsal(finding, equations, true, rivals, sizes, False, limits.criterion)
            yield _Asked(cause.effect, cause.scope, cause.joints or robot.joint_names, now, rehearsal)


def _unseen(
    robot: Robot, finding: ChannelFinding, equations: Equations, lacking: Sequence[str], limits: Criterion
) -> Iterator[_Asked]:
    """Yield the question whether an effect is there, of those that a channel's data cannot show.

    As large as expected, at the place where it shows most.
    """
    true, sizes = _known(finding)
    before = finding.attribution
    for effect in lacking:
        places = [k for k, hypothesis in enumerate(before.hypotheses) if hypothesis.effect == effect]
        if places:
            best = before.hypotheses[max(places, key=lambda k: before.visible[k, 0])]
            shape = best.variants[len(best.variants) // 2]
            expected = {k: term.spread for k, term in zip(shape.columns, shape.terms, strict=True)}
            own = replace(best, variants=(shape,))
            rehearsal = Rehearsal(finding, equations, (*true, own), (), sizes | expected, True, limits)
            now = separation(_of(rehearsal.causes(None), effect, own.scope), None)
            yield _Asked(effect, own.scope, robot.joint_names, {None: now}, rehearsal)


def _known(finding: ChannelFinding) -> tuple[tuple[Hypothesis, ...], dict[int, float]]:
    """Return a finding's causes joint by joint, each in the shape that was found, and their coefficients by column."""
    true = [
        Hypothesis(cause.effect, joint, cause.scope, (variant,))
        for cause in finding.causes
        for joint, variant in zip(cause.joints or (None,), cause.variants, strict=True)
    ]
    fitted = zip(finding.used, finding.estimate.values.tolist(), strict=True)
    return tuple(true), {k: value for k, value in fitted if k >= finding.system.base}


def _answerable(weighed: list[Weighed], enough: float) -> list[Weighed]:
    """Return the questions that some programme answers, alone; all where there is none."""
    kept = [
        k for k, chances in enumerate(zip(*(told for _, told in weighed), strict=True)) if _reached(chances, enough)
    ]
    return [(programme, [told[k] for k in kept]) for programme, told in weighed] if kept else weighed


def _best(weighed: Sequence[Weighed], enough: float) -> tuple[ExperimentProgramme | None, list[Question]]:
    """Return the programme that answers most, of those that answer all the shortest; None of it where none helps.

    Of those as short, to the minute, it is the one that tells most.
    """

    def order(pair: Weighed) -> tuple[int, int, float]:
        expected = [question.expected_separation for question in pair[1]]
        left = sum(value < enough for value in expected)
        return -left, 0 if left else -round(pair[0].cost / 60), min(expected)

    best, questions = max(weighed, key=order, default=(None, []))
    helps = any(question.expected_separation >= min(enough, question.separation_now + _LEAST) for question in questions)
    return best if helps else None, questions


def _note(weighed: Sequence[list[Question]], enough: float) -> str | None:
    """Say what no programme tells apart or shows."""
    if not weighed:
        return f"no programme of at most {LONGEST / 60:g} minutes keeps to the limits of this robot"
    names = [chances[0].effects for chances in zip(*weighed, strict=True) if not _reached(chances, enough)]
    notes = [f"{' and '.join(some)} cannot be {'told apart' if len(some) > 1 else 'shown'}" for some in names]
    return "; ".join(f"{note} by any motion that was weighed" for note in notes) or None


def _reached(chances: Sequence[Question], enough: float) -> bool:
    return any(question.expected_separation >= enough for question in chances)


def curve(robot: Robot, programme: ExperimentProgramme) -> PlannedMotion:
    """Return what a page draws of a programme: time (s) and the position of each joint that moves, thinned."""
    time, q, start = [], [], 0.0
    moved = [robot.index(joint) for joint in programme.joints]
    for motion in programme.motions:
        every = -(-len(motion.time) * len(programme.motions) // _DRAWN)
        time.append(motion.time[::every] + start)
        q.append(motion.q[::every])
        start = float(time[-1][-1]) + every / motion.rate
    return PlannedMotion(
        time=tuple(np.concatenate(time).round(3).tolist()),
        joints=programme.joints,
        units=tuple(robot.joints[joint].unit for joint in moved),
        q=tuple(map(tuple, np.concatenate(q).T[moved].round(5).tolist())),
    )


def _rounded(value: float) -> float:
    return float(f"{value:.3g}")
