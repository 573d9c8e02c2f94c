"""What to measure next: the programme, of those that the robot's limits allow, that tells rivals apart."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from irtwin.document.curves import PlannedMotion
from irtwin.document.experiment import Considered, Experiment, Question
from irtwin.effects.catalogue import catalogue
from irtwin.effects.effect import Effect
from irtwin.gap.experiment.planned_equations import PlannedEquations, Products, fitted, unimitated
from irtwin.gap.experiment.programmes import LONGEST, Programme, programmes
from irtwin.gap.isolation.cause import Cause
from irtwin.gap.isolation.finding import branches
from irtwin.gap.regression.hypotheses import Column, candidate_columns
from irtwin.identification.excitation import Excitation
from irtwin.identification.progress import tell_step
from irtwin.robot.description import Robot
from irtwin.signals.motion import Motion

_DRAWN = 400  # points of a curve on a page


Shape = tuple[int | Column, ...]
Left = tuple[np.ndarray, np.ndarray]
Four = tuple[float, float, float, float]


@dataclass(frozen=True)
class Weight:
    """What one question gains by a programme: `now` and `expected` separations, in standard deviations.

    `share_now`, `share`: of two rivals, the part of one that the other cannot imitate, in the data and in the
    programme; of an effect that cannot be tested, its mean square in units of the noise's, in the data and with both.
    `enough`, `least`: the separation and the share that answer the question.
    """

    effects: tuple[str, ...]
    now: float
    expected: float
    share_now: float
    share: float
    enough: float
    least: float

    @property
    def added(self) -> float:
        """The separation that the programme brings by itself, in standard deviations."""
        return float(np.sqrt(max(self.expected**2 - self.now**2, 0.0)))

    @property
    def known(self) -> bool:
        """Whether the data show an effect already."""
        return len(self.effects) == 1 and self.now >= self.enough and self.share_now >= self.least

    @property
    def reached(self) -> bool:
        """Whether the programme would answer the question; of rivals by itself, as the data there are do not."""
        told = self.expected if len(self.effects) == 1 else self.added
        return told >= self.enough and self.share >= self.least

    @property
    def question(self) -> Question:
        """The question with its numbers, as a diagnosis says it."""
        kind = "not_imitated" if len(self.effects) > 1 else "visibility"
        shares = {f"{kind}_now": _rounded(self.share_now), f"expected_{kind}": _rounded(self.share)}
        now, expected = _rounded(self.now), _rounded(self.expected)
        return Question(effects=self.effects, separation_now=now, expected_separation=expected, **shares)


@dataclass(frozen=True)
class Proposal:
    """The experiment that is proposed, its programme (None where none helps), and what that would tell."""

    experiment: Experiment
    programme: Programme | None
    weights: tuple[Weight, ...]
    curve: PlannedMotion | None


def curve(robot: Robot, programme: Programme) -> PlannedMotion:
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


@dataclass(frozen=True)
class _Question:
    """Rivals in one channel, or one effect that its data cannot show: for each its places, for these the shapes.

    A shape is a tuple of columns: their indices in the system, or those that the system lacks; `fitted`: columns of the
    other causes.
    """

    channel: PlannedEquations
    effects: tuple[str, ...]
    joints: tuple[str, ...]
    places: tuple[tuple[tuple[Shape, ...], ...], ...]
    fitted: tuple[int, ...]

    @property
    def tried(self) -> set[int | Column]:
        """The columns that it takes."""
        own = {k for each in self.places for shapes in each for shape in shapes for k in shape}
        return own | set(self.fitted)

    def weigh(self, products: Products, seconds: float) -> list[Weight]:
        """Return what a programme of this length would tell."""
        left, at = products.left(self.fitted), products.at
        placed = [[[[at[k] for k in shape] for shape in shapes] for shapes in each] for each in self.places]
        if len(self.effects) == 1:
            return [self._visible(left, placed[0], seconds)]
        return [self._apart(left, placed, j, i) for i in range(len(placed)) for j in range(i)]

    def _apart(self, left: Left, placed: Sequence[Sequence[Sequence[list[int]]]], one: int, other: int) -> Weight:
        """Return how far two rivals lie apart, the worse of both ways round."""
        ways = [self._distance(left, placed[a], placed[b]) for a, b in ((one, other), (other, one))]
        now, expected, share_now, share = (float(min(values)) for values in zip(*ways, strict=True))
        limits = self.channel.thresholds
        both = self.effects[one], self.effects[other]
        return Weight(both, now, expected, share_now, share, limits.matters.apart, limits.criterion.misfit)

    def _distance(self, left: Left, true: Sequence[Sequence[list[int]]], taken: Sequence[Sequence[list[int]]]) -> Four:
        """Return separation and share, now and then, where the first is true and the second taken for it."""
        own = [k for shapes in true for k in max(shapes, key=lambda shape: _gain(left[0], shape))]
        values = fitted(left[0], own)
        squares = [unimitated(each, own, values, _imitating(each, own, values, taken)) for each in left]
        sizes = [max(unimitated(each, own, values, ()), 1e-30) for each in left]
        now, then = (float(np.sqrt(square / self.channel.dispersion)) for square in squares)
        share = max(squares[1] - squares[0], 0.0) / max(sizes[1] - sizes[0], 1e-30)
        return now, max(now, then), squares[0] / sizes[0], min(share, 1.0)

    def _visible(self, left: Left, places: Sequence[Sequence[list[int]]], seconds: float) -> Weight:
        """Return how far an effect of the size that is expected would stand out, at the place where it does best."""
        squares = [max(float(np.diag(each)[shapes[0]].sum()) for shapes in places) for each in left]
        now, then = (float(np.sqrt(max(square, 0.0) / self.channel.dispersion)) for square in squares)
        rows = self.channel.rows, self.channel.rows + seconds * self.channel.per_second
        share_now, share = (max(square, 0.0) / count for square, count in zip(squares, rows, strict=True))
        limits = self.channel.thresholds
        least = limits.criterion.visible(len(self.channel.finding.attribution.hypotheses))
        return Weight(self.effects, now, max(now, then), share_now, share, limits.matters.apart, least)


def _imitating(
    left: np.ndarray, own: Sequence[int], values: np.ndarray, taken: Sequence[Sequence[list[int]]]
) -> list[int]:
    """Return the columns by which an effect imitates others best, its shape chosen place by place."""
    by: list[int] = []
    for shapes in taken:
        by = min(([*by, *shape] for shape in shapes), key=lambda columns: unimitated(left, own, values, columns))
    return by


def _gain(left: np.ndarray, own: list[int]) -> float:
    return float(left[own, -1] @ fitted(left, own))


def next_experiment(
    robot: Robot,
    channels: Sequence[PlannedEquations],
    lacking: Sequence[Effect],
    seen: Sequence[Motion],
    enough: float,
    excitation: Callable[[], Excitation | None] | None = None,
) -> Proposal | None:
    """Design what tells the rivals of causes that matter apart; where there are none, what shows the effects `lacking`.

    `channels`: planned equations of each; `seen`: the motions that were judged; `excitation` as for `programmes`.
    Of the programmes that reach a separation of
    `enough` in every question the one that takes the least time is chosen, else the one that answers the most.
    None where there is nothing to ask.
    """
    questions = [q for channel in channels for cause in _mattering(channel) if (q := _rivals(channel, cause))]
    if questions:
        purpose = "; ".join(f"tell {q.effects[0]} from {', '.join(q.effects[1:])}" for q in questions)
        names = tuple(dict.fromkeys(name for q in questions for name in q.effects))
    elif lacking:
        questions = [q for effect in lacking if (q := _unseen(robot, channels, effect))]
        names = tuple(effect.id for effect in lacking)
        purpose = f"show {', '.join(names)}"
    else:
        return None
    joints = tuple(joint for joint in robot.joint_names if any(joint in q.joints for q in questions))
    effects = [catalogue()[name] for name in names]
    warm = any("temperature" in effect.requires for effect in effects)
    off = [effect for effect in effects if effect.taken_off]
    tried = programmes(robot, joints, seen, warm=warm, take_off=off, excitation=excitation) if questions else ()
    weighed = [(one, _weigh(one, questions)) for one in tried]
    note = _note([weights for _, weights in weighed])
    if questions and not weighed:
        note = f"no programme of at most {LONGEST / 60:g} minutes keeps to the limits of this robot"
    weighed = [(one, open_) for one, weights in weighed if (open_ := [w for w in weights if not w.known])]
    asked = {name for q in questions for name in q.effects}
    by_hand = _manual_tests([effect for effect in effects if effect.id not in asked])
    chosen, weights = _choose(weighed) if weighed else (None, [])
    if not any(weight.reached or weight.added >= 1 for weight in weights):
        chosen, by_hand = None, by_hand or _manual_tests(effects)
    said = Experiment(
        purpose=purpose,
        effects=names,
        joints=joints,
        motions=(*([chosen.text] if chosen else []), *by_hand),
        expected_separation=_least(weight.expected for weight in weights) if chosen else None,
        separation_now=_least(weight.now for weight in weights),
        separation_that_is_enough=enough,
        questions=tuple(weight.question for weight in weights),
        programme=chosen.said if chosen else None,
        considered=tuple(
            Considered(
                kind=one.kind,
                minutes=round(one.cost / 60, 1),
                expected_separation=_rounded(min(weight.expected for weight in of_one)),
            )
            for one, of_one in weighed
        ),
        note=note,
    )
    return Proposal(said, chosen, tuple(weights), None if chosen is None else curve(robot, chosen))


def _weigh(programme: Programme, questions: Sequence[_Question]) -> list[Weight]:
    tell_step(f"  weighing {programme.kind.replace('_', ' ')}")
    products: dict[str, Products] = {}
    for channel in {q.channel.finding.name: q.channel for q in questions}.values():
        name = channel.finding.name
        tried = set().union(*(q.tried for q in questions if q.channel.finding.name == name))
        products[name] = channel.products(programme, sorted(tried, key=lambda k: (not isinstance(k, int), str(k))))
    return [w for q in questions for w in q.weigh(products[q.channel.finding.name], programme.seconds)]


def _choose(weighed: Sequence[tuple[Programme, list[Weight]]]) -> tuple[Programme, list[Weight]]:
    most = max(sum(weight.reached for weight in weights) for _, weights in weighed)
    best = [pair for pair in weighed if sum(weight.reached for weight in pair[1]) == most]
    if most == len(best[0][1]):
        return min(best, key=lambda pair: pair[0].cost)
    return max(best, key=lambda pair: min(weight.expected for weight in pair[1] if not weight.reached))


def _note(weighed: Sequence[Sequence[Weight]]) -> str | None:
    """Say what no programme tells apart or shows."""
    said = []
    for chances in zip(*weighed, strict=True):
        best = max(chances, key=lambda weight: weight.share)
        if best.known:
            said.append(f"{best.effects[0]} shows in these data once the causes are in the twin: adopt it, ask again")
        elif len(best.effects) > 1 and best.share < best.least:
            said.append(f"{' and '.join(best.effects)} cannot be told apart: in every motion one imitates the other")
        elif len(best.effects) == 1 and best.share < best.least:
            said.append(f"{best.effects[0]} cannot be shown: in every motion the rest of the twin imitates it")
        elif not any(weight.reached for weight in chances):
            said.append(f"no programme that was weighed is enough for {' and '.join(best.effects)}")
    return "; ".join(said) or None


def _mattering(channel: PlannedEquations) -> list[Cause]:
    """Return the causes that close enough to be told of, in their order."""
    told = [one for one in branches(channel.finding) if one.closing.matters(channel.thresholds.matters)]
    return [cause for cause in channel.finding.causes if any(cause is each for one in told for each in one.causes)]


def _rivals(channel: PlannedEquations, cause: Cause) -> _Question | None:
    """Return the question which of a cause and its foremost rivals it is."""
    known: dict[tuple[str, str], dict[str | None, tuple[Shape, ...]]] = {}
    for one in channel.finding.attribution.hypotheses:
        known.setdefault((one.effect, one.scope), {})[one.joint] = tuple(v.columns for v in one.variants)
    effects = [cause.effect]
    places: list[tuple[tuple[Shape, ...], ...]] = [tuple((variant.columns,) for variant in cause.variants)]
    others = tuple(k for k in channel.finding.chosen if k not in cause.columns)
    rivals = cause.not_told_from(channel.thresholds.criterion.unknown)
    for rival in rivals:
        of_rival = known.get((rival, cause.scope)) or known.get((rival, _other(cause.scope))) or {}
        found = tuple(of_rival[joint] for joint in cause.joints if joint in of_rival)
        if not found or len(found) < len(cause.joints):
            found = (of_rival[None],) if None in of_rival else ()
        if found and not any(set(shape) & set(others) for shapes in found for shape in shapes):
            effects.append(rival)
            places.append(found)
    joints = cause.joints or channel.robot.joint_names
    return _Question(channel, tuple(effects), joints, tuple(places), others) if len(effects) > 1 else None


def _unseen(robot: Robot, channels: Sequence[PlannedEquations], effect: Effect) -> _Question | None:
    """Return the question whether an effect is there; None where nothing measures it."""
    for channel in channels:
        if channel.finding.name == effect.signal:
            found = [h for h in channel.finding.attribution.hypotheses if h.effect == effect.id]
            scope = "missing" if any(h.scope == "missing" for h in found) else "changed"
            places = [(h.variants[len(h.variants) // 2].columns,) for h in found if h.scope == scope]
            joints: dict[str | None, list[Column]] = {}
            for column in () if places else candidate_columns(robot, [effect]):
                joints.setdefault(column.term.joint, []).append(column)
            shapes: tuple[tuple[Shape, ...], ...] = (*places, *((tuple(columns),) for columns in joints.values()))
            chosen = tuple(channel.finding.chosen)
            return _Question(channel, (effect.id,), robot.joint_names, (shapes,), chosen) if shapes else None
    return None


def _other(scope: str) -> str:
    return "changed" if scope == "missing" else "missing"


def _least(values: Iterable[float]) -> float | None:
    return min(map(_rounded, values), default=None)


def _rounded(value: float) -> float:
    return float(f"{value:.3g}")


def _manual_tests(effects: Sequence[Effect]) -> tuple[str, ...]:
    return tuple(effect.manual_test for effect in effects if effect.manual_test)
