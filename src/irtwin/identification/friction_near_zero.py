"""How dry friction turns at zero speed, in each joint: at once, or over some speed. Nobody states it, so it is fitted.

A twin whose friction turns at once leaves, of a joint whose friction does not, what looks like friction that sticks
less, thins or has changed. The turn is a nuisance: it is found before anything is asked of the data, from all of them;
of a long log a part proposes it.
"""

from __future__ import annotations

from collections.abc import Sequence, Set
from dataclasses import replace

import numpy as np

from irtwin.effects.effect import Effect, JointEffect
from irtwin.effects.friction import OVER, SLOW, CoulombFriction, StribeckFriction, shapes_over_speed, sharp_sign, turn
from irtwin.effects.stack import Stack, side_by_side
from irtwin.identification.accumulate import Block, Rows, accumulate, part_read, triangle
from irtwin.identification.progress import track
from irtwin.identification.reduced_torque import Column, ReducedTorque, column
from irtwin.identification.robust_weights import SETTLED, robust_weights
from irtwin.robot.description import Joint, Robot
from irtwin.signals.motion import Motion

Turn = tuple[float, float]  # width, rad/s or m/s, and exponent of `effects.friction.turn`
Dry = tuple[Turn | None, float | None]  # how a joint's dry friction turns, None: at once, and how much it is, N m or N

_COARSE = [(width, exponent) for width in (1.5e-3, 3e-3, 6e-3, 0.012, 0.024) for exponent in (1.25, 2.0, 4.0, 10.0)]
_FINER = [(width, exponent) for width in (0.65, 0.8, 1.0, 1.25, 1.5) for exponent in (0.75, 1.0, 1.35)]  # times these
_WIDEST, _LEAST_EXPONENT = 0.03, 1.25  # a wider turn, or longer tails, are friction that a joint is known by
_REWEIGHTINGS = 20  # at most
_NEARLY_ALL = 0.85  # of the ranks: real turns have 0.87 and more, forms of friction that differ elsewhere 0.83 at most
_NOTHING = 1e-9  # of the largest column: less is not shown


def with_friction_near_zero(
    robot: Robot, motions: Sequence[Motion], effects: Sequence[str | Effect], turning: Set[str] = frozenset()
) -> tuple[Robot, ReducedTorque | None]:
    """Return the robot with each joint's dry friction and its turn, as its torque shows them beside some effects.

    A joint whose torque shows no turn, or in which it makes no sure difference, has friction that turns at once; of
    those that are known to be `turning` the difference need not be sure.
    Beside it stand the equations of torque from which that was found, of columns as this robot has them; None where
    there was no torque.
    """
    measured = [motion for motion in motions if motion.torque is not None]
    plain = replace(robot, joints=tuple(_with(joint, (None, None)) for joint in robot.joints))
    if not measured:
        return plain, None
    named = {effect for effect in effects if isinstance(effect, str)}
    beside = [
        effect
        for effect in Stack(plain, effects).effects
        if effect.signal == "torque" and effect.id != CoulombFriction.id and not effect.needs and not effect.memory
    ]
    stack = Stack(plain, beside)
    open_shapes = [  # of which the data are yet to choose
        shape
        for effect in beside
        if effect.id in named and isinstance(effect, JointEffect)
        for shape in effect.candidates(plain)
        if isinstance(shape, JointEffect) and shape != effect
    ]
    laws = [shape for shape in shapes_over_speed(_WIDEST) if shape.id not in stack.ids]
    known_shapes = [effect for effect in beside if effect.id not in named]
    widest = [_widest(known_shapes, joint) for joint in robot.joints]
    tried: Sequence[Sequence[Turn]] = [[turn for turn in _COARSE if turn[0] <= most] for most in widest]
    every = part_read(measured)
    known = [joint.name in turning for joint in robot.joints]
    dry, blocks = _found(stack, open_shapes, laws, measured, tried, known, every)
    if any(turn for both in dry for turn, _ in both):
        tried = [_around([turn for turn, _ in both if turn], most) for both, most in zip(dry, widest, strict=True)]
        dry, blocks = _found(stack, open_shapes, laws, measured, tried, known, every)
    if every > 1:  # a part of the log chose, all of it says whether that is so
        tried = [[turn] if turn else [] for (turn, _), *_ in dry]
        dry, blocks = _found(stack, open_shapes, (), measured, tried, known)
    turned = replace(
        plain, joints=tuple(_with(joint, likelier) for joint, (likelier, *_) in zip(plain.joints, dry, strict=True))
    )
    return turned, ReducedTorque(blocks, _places(stack, open_shapes, tried, turned))


def _with(joint: Joint, dry: Dry) -> Joint:
    turn, friction = dry
    width, exponent = turn or (None, None)
    return replace(joint, friction_width=width, friction_exponent=exponent, dry_friction=friction)


def _found(
    stack: Stack,
    open_shapes: Sequence[JointEffect],
    laws: Sequence[JointEffect],
    motions: Sequence[Motion],
    tried: Sequence[Sequence[Turn]],
    known: Sequence[bool],
    every: int = 1,
) -> tuple[list[list[Dry]], list[Block]]:
    """Return in each joint the best of the turns that are tried, alone and beside a law over speed, the likelier first.

    Each has the friction by it, and is None where there is none; joints whose friction is `known` to turn have one.
    Beside them stand the equations, reduced; `every` as in `accumulate`.
    """
    blocks, pattern = _reduced(stack, open_shapes, laws, motions, tried, every)
    told = track(enumerate(tried), "friction near zero speed of each joint")
    imitating = {shape.id for shape in open_shapes}
    sure = [
        np.flatnonzero([stack.torque_terms[k][0].id not in imitating for k in np.flatnonzero(used)])
        for used in stack.pattern
    ]
    best = [_best(blocks, pattern, joint, turns, sure[joint], len(laws), known[joint]) for joint, turns in told]
    return best, blocks


def _widest(beside: Sequence[Effect], joint: Joint) -> float:
    """Return the widest turn of a joint's friction: it is over where a known friction fades as the joint speeds up."""
    fading = (effect for effect in beside if isinstance(effect, StribeckFriction))
    return min([_WIDEST, *(effect.vs / OVER for effect in fading if joint.name in (effect.joints or (joint.name,)))])


def _around(turns: Sequence[Turn], widest: float) -> list[Turn]:
    near = [
        (min(width * a, widest), max(exponent * b, _LEAST_EXPONENT)) for width, exponent in turns for a, b in _FINER
    ]
    return list(dict.fromkeys(near))


def _reduced(
    stack: Stack,
    open_shapes: Sequence[JointEffect],
    laws: Sequence[JointEffect],
    motions: Sequence[Motion],
    tried: Sequence[Sequence[Turn]],
    every: int,
) -> tuple[list[Block], np.ndarray]:
    """Reduce the equations of torque.

    Beside the stack's columns stand those of shapes that are open, then each joint's dry friction, sharp and by each
    turn, then the laws over speed of which one may be there.
    """
    robot = stack.robot
    counts = [
        sum(len(shape.joint_terms(joint)) for shape in open_shapes) + 1 + len(turns) + len(laws)
        for joint, turns in zip(robot.joints, tried, strict=True)
    ]
    of_one_joint = np.repeat(np.eye(len(counts), dtype=bool), counts, axis=1)
    pattern = np.concatenate([stack.pattern, of_one_joint], axis=1)
    sticking = CoulombFriction()

    def of_joint(samples: Sequence[np.ndarray], joint: int) -> list[np.ndarray]:
        return [sample[:, joint : joint + 1] for sample in samples]

    def equations(motion: Motion) -> Rows:
        assert motion.torque is not None
        own = stack.sparse_by_joint(motion)
        shapes, bent = (
            [sample for shape in some for sample in shape.samples(robot, motion, None)] for some in (open_shapes, laws)
        )
        columns = [  # single columns take ten times as long to filter
            [*some, side_by_side([*of_joint(shapes, k), _friction(motion.dq[:, k], tried[k]), *of_joint(bent, k)])]
            for k, some in enumerate(own)
        ]
        undecided = stack.undecided(motion) | sticking.undecided(motion)
        return Rows(columns, stack.shift_torque(motion, sparse=True), motion.torque, undecided)

    return accumulate(motions, equations, pattern, every=every), pattern


def _places(
    stack: Stack, open_shapes: Sequence[JointEffect], tried: Sequence[Sequence[Turn]], turned: Robot
) -> list[dict[Column, int]]:
    """Return where in each joint's equations columns stand that the `turned` robot has, too."""
    by_joint = []
    same = {effect: _alike(effect, stack.robot, turned) for effect in (*stack.effects, *open_shapes)}
    for joint, used, turns in zip(turned.joints, stack.pattern, tried, strict=True):
        own = [stack.torque_terms[k] for k in np.flatnonzero(used)]
        own += [(shape, term) for shape in open_shapes for term in shape.joint_terms(joint)]
        places = {column(*pair): place for place, pair in enumerate(own) if same[pair[0]]}
        width, exponent = joint.friction_width, joint.friction_exponent
        (dry,) = CoulombFriction().joint_terms(joint)
        turn = 0 if width is None or exponent is None else 1 + list(turns).index((width, exponent))
        by_joint.append({**places, column(CoulombFriction(), dry): len(own) + turn})
    return by_joint


def _alike(effect: Effect, first: Robot, second: Robot) -> bool:
    """Return whether an effect's columns are the same of two robots, whose friction turns otherwise."""
    shape = (16, len(first.joints))
    q, dq, ddq = np.random.default_rng(0).uniform(-1, 1, (3, *shape))
    slow = Motion(np.arange(16.0), q, SLOW * dq, ddq, run="slow", temperature=np.full(shape, 50.0))
    return np.array_equal(effect.columns(first, slow), effect.columns(second, slow))


def _friction(dq: np.ndarray, shapes: Sequence[Turn]) -> np.ndarray:
    """Return (N, 1 + S) dry friction that turns at once, and by each shape; those of one exponent together."""
    columns = np.empty((len(dq), 1 + len(shapes)))
    columns[:, 0] = sharp_sign(dq)
    for exponent in {exponent for _, exponent in shapes}:
        own = [k for k, (_, other) in enumerate(shapes) if other == exponent]
        columns[:, 1 + np.array(own)] = turn(dq[:, None], np.array([shapes[k][0] for k in own]), exponent)
    return columns


def _best(
    blocks: Sequence[Block],
    pattern: np.ndarray,
    joint: int,
    turns: Sequence[Turn],
    sure: np.ndarray,
    laws: int,
    known: bool,
) -> list[Dry]:
    """Return the turn that leaves least of a joint's torque, and the friction by it; none if not always, nor `known`.

    The likelier of two comes first: alone, or beside the one of the `laws` over speed, the last columns, that leaves
    least of sharp friction. What thins as a joint speeds up bends near zero, too: a turn alone would stand for it.
    Effects whose shape is open imitate friction, so how large that is, is asked beside the `sure` columns alone.
    """
    end = int(pattern[joint].sum()) - laws
    own = end - len(turns) - 1
    seen = [block for block in blocks if block.rows[joint]]
    if not seen:
        return [(None, None)]
    factors = _weighted([block.factors[joint] for block in seen], np.array([block.rows[joint] for block in seen]), own)
    whole = triangle(np.concatenate(factors))

    def beside(columns: Sequence[int], blocks: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        every = [*columns, *range(own, end), -1]
        return _left(triangle(whole[:, every]), [block[:, every] for block in blocks], len(columns))

    _, friction = beside(list(sure), [])
    alone = beside(range(own), factors)[0]
    bent = [(float(beside([*range(own), law], [whole])[0][0].sum()), law) for law in range(end, end + laws)]
    both = [alone, *(beside([*range(own), law], factors)[0] for _, law in sorted(bent)[:1])]
    best = [int(np.argmin(left.sum(axis=1))) for left in both]
    if _everywhere(alone[best[0]] - both[-1][0]):
        both.reverse()
        best.reverse()
    sure_of = [known or _everywhere(left[0] - left[place]) for place, left in zip(best, both, strict=True)]
    best = [place if so else 0 for place, so in zip(best, sure_of, strict=True)]
    return [(turns[place - 1] if place else None, max(float(friction[place]), 0.0)) for place in dict.fromkeys(best)]


def _weighted(factors: Sequence[np.ndarray], rows: np.ndarray, own: int) -> list[np.ndarray]:
    """Return blocks' factors, weighted by how little the first `own` columns and sharp friction leave of each."""
    known = [factor[:, [*range(own + 1), -1]] for factor in factors]
    weights, size = np.ones(len(rows)), np.linalg.norm([np.linalg.norm(factor[:, -1]) for factor in known])
    for _ in range(_REWEIGHTINGS):
        counting = [np.sqrt(weight) * factor for weight, factor in zip(weights, known, strict=True)]
        left = _left(triangle(np.concatenate(counting)), known, own)[0][0]
        noise = np.sqrt((weights * left).sum() / rows.sum())
        before = weights
        weights = robust_weights(left, rows, max(noise, np.finfo(float).tiny), size / np.sqrt(rows.sum()))
        if np.allclose(weights, before, atol=SETTLED):
            break
    return [np.sqrt(weight) * factor for weight, factor in zip(weights, factors, strict=True)]


def _everywhere(saved: np.ndarray) -> bool:
    """Whether squares are saved in nearly all blocks, by Wilcoxon's signed ranks: reversals are few and weigh much."""
    ranks = np.argsort(np.argsort(np.abs(saved))) + 1
    return bool(ranks[saved > 0].sum() >= _NEARLY_ALL * ranks.sum())


def _left(whole: np.ndarray, factors: Sequence[np.ndarray], own: int) -> tuple[np.ndarray, np.ndarray]:
    """Return what the first `own` columns and each of the S others leave in each block, (S, B) squares, and these (S,).

    The first are decomposed once for all others: of many joints they are many.
    """
    beside = _fitted(whole[:, :own], whole[:, own:])
    shapes, measured = np.split(whole[:, own:] - whole[:, :own] @ beside, [-1], axis=1)
    squares = (shapes**2).sum(axis=0)
    told = squares > _NOTHING**2 * (whole[:, own:-1] ** 2).sum(axis=0)
    values = np.where(told, measured[:, 0] @ shapes, 0.0) / np.where(told, squares, 1.0)
    weights = np.concatenate([beside[:, :-1] * values - beside[:, -1:], -np.diag(values), np.ones((1, len(values)))])
    return np.array([((factor @ weights) ** 2).sum(axis=0) for factor in factors]).T, values


def _fitted(columns: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Return the least coefficients (K, S) by which columns (r, K) explain others (r, S)."""
    size = np.linalg.norm(columns, axis=0)
    shown = size > _NOTHING * size.max(initial=0.0)
    solution = np.zeros((columns.shape[1], others.shape[1]))
    solution[shown] = np.linalg.lstsq(columns[:, shown] / size[shown], others, rcond=_NOTHING)[0] / size[shown, None]
    return solution
