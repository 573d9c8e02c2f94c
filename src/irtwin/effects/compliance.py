"""Play and elasticity between motor and link: the link is one mass that swings behind a spring."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
import pinocchio as pin

from irtwin.effects.effect import (
    NORMAL,
    Coefficients,
    Effect,
    JointEffect,
    Possible,
    Predicted,
    Quantity,
    Stated,
    Term,
    force_unit,
    quantity,
    ratio,
)
from irtwin.effects.rigid_body import model_of, torque_slope
from irtwin.robot.description import Joint, Robot
from irtwin.robot.model import inverse_dynamics
from irtwin.signals.conditioning import differentiate
from irtwin.signals.motion import Motion

_WINDOW, _WARM_UP = 1.0, 0.8  # s: swings are over after the second; windows are computed side by side
_STEPS = 500.0  # a second, about
_AT_ONCE = 8192  # numbers: what is computed side by side stays in a processor's own memory
_INERTIA_EVERY = 0.016  # s
_LIGHTEST = 1e-6  # kg m^2: a link without inertia is no link
_CONTACT, _CONTACT_DAMPING = 30.0, 0.5  # Hz: of gears that touch again, well above what moves a robot
_DAMPING = 0.1  # of an elastic joint's swing
_GAPS = tuple(3e-4 * 2.0 ** (2 * k / 3) for k in range(10))  # rad: 0.3 to 19 mrad, those of worn gears too
_SMALL = (3e-4, 6e-4)  # rad: tried with a part of the rotor before the gap, too
_WITHIN = 2.0 ** (np.arange(-1, 2) * 2 / 3)  # of a gap: those before and after it among the gaps
_SWINGS = (5.0, 6.0, 7.2, 8.6, 10.4, 12.5, 15.0, 20.0, 40.0)  # Hz: antiresonances of elastic joints
_SLOWEST = 3.0  # Hz, of that swing: arms of industry swing at 5 and more, the lightest at 3


def load_torque(robot: Robot, motion: Motion, predicted: Predicted | None) -> np.ndarray:
    """Return (N, n) the torque that the links take beyond the gears."""
    if predicted is not None and predicted.load is not None:
        return predicted.load
    model = model_of(robot, None if predicted is None else predicted.bodies)
    return inverse_dynamics(model, motion.q, motion.dq, motion.ddq)


def load_inertia(robot: Robot, motion: Motion, predicted: Predicted | None) -> np.ndarray:
    """Return (N, n) the inertia that each joint moves beyond its gear while the others hold, kg m^2, by the URDF."""
    if predicted is not None and predicted.inertia is not None:
        return predicted.inertia
    rows, known = _mass_matrices(robot, motion)
    own = np.maximum(np.diagonal(known, axis1=1, axis2=2), _LIGHTEST)
    return np.column_stack([np.interp(np.arange(len(motion.time)), rows, of_joint) for of_joint in own.T])


def _mass_matrices(robot: Robot, motion: Motion) -> tuple[np.ndarray, np.ndarray]:
    """Return some rows of a motion, the same ones in any part of a run, and the mass matrix (R, n, n) in each."""
    model = robot.model
    data = model.createData()
    every = max(1, round(_INERTIA_EVERY * motion.rate))
    rows = np.arange(-motion.start % every, len(motion.time), every)
    known = np.empty((len(rows), model.nv, model.nv))
    for row, q in enumerate(motion.q[rows]):
        known[row] = pin.crba(model, data, q)  # whose lower half is left as it was
    return rows, np.triu(known) + np.triu(known, 1).swapaxes(1, 2)


def _dragged(robot: Robot, motion: Motion, acting: Sequence[int], predicted: Predicted | None) -> np.ndarray:
    """Return (2, N, n, m): the torque of each joint, by 1 N m on an acting one's own inertia, and by 1 rad of its link.

    The second is of the weight alone.
    """
    rows, known = _mass_matrices(robot, motion)
    own = np.maximum(np.diagonal(known, axis1=1, axis2=2), _LIGHTEST)[:, None, acting]
    still = np.zeros((len(rows), len(robot.joints)))
    held = motion.moved(motion.time[rows], motion.q[rows], still, still)
    weighs = torque_slope(robot, None if predicted is None else predicted.bodies, held)
    each = np.stack([known[:, :, acting] / own, weighs[:, :, acting]]).reshape(2, len(rows), -1)
    every = np.arange(len(motion.time))
    drawn = [[np.interp(every, rows, ratio) for ratio in ratios.T] for ratios in each]
    return np.array(drawn).transpose(0, 2, 1).reshape(2, len(every), len(robot.joints), len(acting))


def transmitted(
    load: np.ndarray,
    inertia: np.ndarray,
    rate: float,
    speed: np.ndarray | float,
    damping: float,
    plays: Sequence[float] = (0.0,),
    start: int = 0,
) -> np.ndarray:
    """Return (G, N, n) the torque that passes a spring with each of G `plays` (rad) between a motor and its link.

    load: (N, n) N m, what a link stiffly joined to the measured motor would take; inertia: (N, n) kg m^2; rate: Hz;
    speed: (N, n) rad/s, of the link's swing while the motor holds, or one for all; `start`: where the first sample
    lies in its run, so that parts of a run are computed alike. With x the motor's lead over the link,
    x'' = load/inertia - speed^2 dead_band(x) - 2 damping speed x', the last only where the gears touch: the
    two-mass model (Spong 1987), link by link.
    """
    ahead, length = round(_WARM_UP * rate), max(1, round(_WINDOW * rate))
    starts = np.arange(-(start % length), len(load), length)
    substeps = max(1, round(_STEPS / max(rate, 1 / _WINDOW)))
    step, joints = 1 / (rate * substeps), load.shape[1]
    speed = np.minimum(speed, 1 / step)  # what is stiffer swings above any band of motion, and would need finer steps
    # in units of a substep: x' and x'' count as what they add to x in one
    pushed, pulls, rubs = load / inertia * step**2, (speed * step) ** 2, 2 * damping * speed * step
    passed = np.empty((len(plays), len(starts), length, joints))
    side_by_side = max(1, _AT_ONCE // (len(plays) * joints))
    for first in range(0, len(starts), side_by_side):
        some = slice(first, first + side_by_side)
        rows = np.clip(starts[some] + np.arange(-ahead, length + 1)[:, None], 0, len(load) - 1)
        push, pull, rub = (
            values[rows].reshape(len(rows), -1) if np.ndim(values) else values for values in (pushed, pulls, rubs)
        )
        moved = _moved(push, pull, rub, np.asarray(plays)[:, None], ahead, substeps)
        passed[:, some] = moved.reshape(length, len(plays), -1, joints).transpose(1, 2, 0, 3)
    kept = passed.reshape(len(plays), -1, joints)[:, -starts[0] :][:, : len(load)]
    return np.asarray(kept * (inertia / step**2))


def _moved(
    pushes: np.ndarray, pulls: np.ndarray, rubs: np.ndarray, plays: np.ndarray, ahead: int, substeps: int
) -> np.ndarray:
    """Return (L, G, K) the springs' forces after `ahead` samples, of K links with G plays.

    pushes: (ahead + L + 1, K); pulls, rubs: of each, or one for all; plays: (G, 1).
    """
    rises = np.diff(pushes, axis=0) / substeps
    pulls, rubs = (np.broadcast_to(values, (len(pushes), *np.shape(values)[1:])) for values in (pulls, rubs))
    swing = _Swing(pushes[0] / pulls[0] + np.sign(pushes[0]) * plays / 2, plays)
    forces = np.empty((len(rises) - ahead, *swing.shape))
    for row, (push, rise, pull, rub) in enumerate(zip(pushes[:-1].copy(), rises, pulls, rubs, strict=False)):
        for substep in range(substeps):
            swing.move(push, pull, rub, forces[row - ahead] if row >= ahead and substep == 0 else None)
            push += rise
    return forces


class _Swing:
    """K links behind springs with G `plays`, (G, 1): the motor's lead `x`, and what it gains in a substep, both (G, K).

    All arrays are written over: a substep is a few operations on a few numbers.
    """

    def __init__(self, x: np.ndarray, plays: np.ndarray):
        self._x, self._gained = x, np.zeros_like(x)
        self._low, self._high, self._play = -plays / 2, plays / 2, bool(plays.any())
        self._given, self._force, self._rubbed = np.empty((3, *x.shape))
        self._touch = np.empty(x.shape, dtype=bool)

    @property
    def shape(self) -> tuple[int, ...]:
        """(G, K)."""
        return self._x.shape

    def move(self, push: np.ndarray, pull: np.ndarray, rub: np.ndarray, force: np.ndarray | None) -> None:
        """Go on by a substep; `force` is given that of the spring, before."""
        give, rubbed = self._x, np.multiply(self._gained, rub, out=self._rubbed)
        if self._play:
            give = np.maximum(self._x, self._low, out=self._given)  # np.clip is slower on a few numbers
            np.minimum(give, self._high, out=give)
            np.subtract(self._x, give, out=give)
            rubbed *= np.not_equal(give, 0, out=self._touch)
        total = np.multiply(give, pull, out=self._force)
        total += rubbed
        if force is not None:
            force[:] = total
        self._gained += push
        self._gained -= total
        self._x += self._gained


def _passed_about(
    load: np.ndarray, inertia: np.ndarray, motion: Motion, gaps: Sequence[float]
) -> dict[float, np.ndarray]:
    """Return (N, n) what passes each of some gaps: the mean of it and of those 1.6 times smaller and larger.

    A gear's gap differs over its turn, and a little more or less of it closes at another moment: what a single gap says
    of a moment is right by chance, what the mean says holds.
    """
    wanted = {gap: np.round(np.log2(gap * _WITHIN), 9) for gap in gaps}
    logs = np.unique(np.concatenate(list(wanted.values())))
    passed = _passed(load, inertia, motion, tuple(2.0**logs))
    return {gap: passed[np.isin(logs, own)].mean(axis=0) for gap, own in wanted.items()}


def _passed(load: np.ndarray, inertia: np.ndarray, motion: Motion, gaps: Sequence[float]) -> np.ndarray:
    """Return (G, N, n) what passes each of G gaps of gears that touch hard."""
    return transmitted(load, inertia, motion.rate, 2 * np.pi * _CONTACT, _CONTACT_DAMPING, gaps, motion.start)


def _passed_at(
    load: np.ndarray, inertia: np.ndarray, motion: Motion, unit: np.ndarray, swings: Sequence[float]
) -> dict[float, np.ndarray]:
    """Return (N, n) what passes a spring for each of some antiresonances, Hz; `unit` (N, n): by pose, about one."""
    count = len(swings)
    speeds = np.concatenate([2 * np.pi * swing * unit for swing in swings], axis=1)
    # side by side: a step of many takes as long as a step of one
    repeated = np.tile(load, count), np.tile(inertia, count)
    (passed,) = transmitted(*repeated, motion.rate, speeds, _DAMPING, start=motion.start)
    return dict(zip(swings, np.split(passed, count, axis=1), strict=True))


def _free(load: np.ndarray, q: np.ndarray, dq: np.ndarray, rate: float, gap: float) -> np.ndarray:
    """Return (N, n) the share of each sample in which a motor has not crossed the gap since its load changed sign."""
    rows = np.arange(len(load))[:, None]
    crossed = np.diff(np.sign(load), axis=0, prepend=np.sign(load[:1])) != 0
    last = np.maximum.accumulate(np.where(crossed, rows, -1), axis=0)
    way = np.abs(q - np.take_along_axis(q, np.maximum(last, 0), axis=0))
    step = np.maximum(np.abs(dq) / rate, 1e-9)
    inside = np.clip((gap - way) / step + 0.5, 0.0, 1.0)
    return np.where((last >= 0) & (rows - last <= _WINDOW * rate), inside, 0.0)


class _Compliance(JointEffect):
    """What both share: a swing that the predicted load drives and that has died away after two seconds."""

    needs: ClassVar[str | None] = "torque"
    stage: ClassVar[int] = 1
    memory: ClassVar[bool] = True
    reach: ClassVar[float | None] = 2.0

    def _among(
        self,
        predicted: Predicted | None,
        key: tuple[Hashable, ...],
        wanted: float,
        tried: Sequence[float],
        work: Callable[[Sequence[float]], Mapping[float, np.ndarray]],
    ) -> np.ndarray:
        """Return what `work` gives for `wanted`: for all that are `tried` at once, if others will ask."""
        kept: dict[float, np.ndarray] = {}
        if predicted is not None:
            kept = predicted.kept.setdefault((self.id, *key), kept)
        if wanted not in kept:
            alone = predicted is None or self.joints is not None or wanted not in tried
            kept.update(work((wanted,) if alone else tried))
        return kept[wanted]


def _at(acting: list[int], motion: Motion, samples: np.ndarray) -> np.ndarray:
    """Return (N, n) with the samples (N, m) of the acting joints; zero at the others, which are not worked out."""
    everywhere = np.zeros_like(motion.dq)
    everywhere[:, acting] = samples
    return everywhere


@dataclass(frozen=True)
class Backlash(_Compliance):
    """The load's torque is lost while the link is free within a gap of b, after that torque changed its sign.

    How long depends on how fast the torque grows and on the link's inertia if both move on together, or, `by_way`, on
    how soon the motor has crossed the gap where the link stays behind. The coefficient is the share of what a gap of b
    makes. `rotor_share` is how much of the inertia that the link is said to have lies before the gap: torque hardly
    tells rotor from link, and small gaps close at another time. `about`: what passes is a mean over b and
    gaps 1.6 times smaller and larger, as long as it is known no better.
    """

    id: ClassVar[str] = "backlash"
    family: ClassVar[str] = "transmission"
    about_reversals: ClassVar[bool] = True
    ranges: ClassVar[dict[str, tuple[float, float]]] = {"b": (3e-4, 3e-3)}

    b: float = 1e-3  # rad
    rotor_share: float = 0.0
    by_way: bool = False
    about: bool = False

    def candidates(self, robot: Robot | None = None) -> tuple[Effect, ...]:
        """Return gaps over the range and of worn gears beyond it."""
        about = replace(self, about=True)
        small = replace(about, rotor_share=0.25).variants(b=_SMALL)
        crossed = replace(self, by_way=True).variants(b=(3e-3, 1e-2, 3e-2))
        return (*about.variants(b=_GAPS), *small, *crossed)

    def joint_terms(self, joint: Joint) -> tuple[Term, ...]:
        """Return the share."""
        return (Term("lost", "1", joint.name, lowest=0.0),)

    def samples(self, robot: Robot, motion: Motion, predicted: Predicted | None) -> tuple[np.ndarray, ...]:
        """Return what passes the gap beyond what passes a stiff gear."""
        acting = self.places(robot)
        load = load_torque(robot, motion, predicted)[:, acting]
        if self.by_way:
            free = _free(load, motion.q[:, acting], motion.dq[:, acting], motion.rate, self.b)
            return (_at(acting, motion, -load * free),)
        inertia = load_inertia(robot, motion, predicted)[:, acting]
        load = load - self.rotor_share * inertia * motion.ddq[:, acting]
        inertia = (1 - self.rotor_share) * inertia
        if not self.about:
            passed = _passed(load, inertia, motion, (self.b,))[0]
            return (_at(acting, motion, passed - load),)
        tried = _SMALL if self.rotor_share else _GAPS
        key = (self.rotor_share, tuple(acting), motion.start)
        passed = self._among(predicted, key, self.b, tried, lambda gaps: _passed_about(load, inertia, motion, gaps))
        return (_at(acting, motion, passed - load),)

    def parameters(self, robot: Robot, given: Coefficients) -> tuple[Quantity, ...]:
        """Return b. The torque lost grows as b^(2/3), or as b^2 for the form `by_way`; the coefficient scales it."""
        power = 0.5 if self.by_way else 1.5
        return tuple(
            quantity("b", joint.name, value, joint.unit, deviation, lambda lost: self.b * max(lost, 0.0) ** power)
            for joint, value, deviation in zip(self.acting(robot), given.values, given.deviations, strict=True)
        )


@dataclass(frozen=True)
class JointElasticity(_Compliance):
    """A link that swings and sags behind its motor; or a motor that turns beyond its link, Ia d2/dt2 (tau_load/K).

    Which of the two depends on where the position is measured: on the motor, or (`antiresonance` 0) on the link. The
    antiresonance (Hz) is the frequency of the link's swing while the motor holds, with the joint's mean inertia; in
    each pose it follows that pose's. The coefficient is a share of about one, or Ia/K (s^2).
    """

    id: ClassVar[str] = "joint_elasticity"
    family: ClassVar[str] = "transmission"
    about_reversals: ClassVar[bool] = True
    across: ClassVar[bool] = True

    contribution = Effect.contribution
    carried = Effect.carried

    antiresonance: float = 0.0

    @property
    def of_link(self) -> bool:
        """Whether the position is measured on the link, so that all that swings is the motor."""
        return self.antiresonance == 0

    def candidates(self, robot: Robot | None = None) -> tuple[Effect, ...]:
        """Return the link's encoder, and swings of 5 to 40 Hz."""
        return self.variants(antiresonance=(0.0, *_SWINGS))

    def joint_terms(self, joint: Joint) -> tuple[Term, ...]:
        """Return Ia/K, or the share."""
        if self.of_link:
            return (Term("Ia/K", "s^2", joint.name, spread=5e-3, lowest=0.0),)
        return (Term("share", "1", joint.name, lowest=0.0),)

    def samples(self, robot: Robot, motion: Motion, predicted: Predicted | None) -> tuple[np.ndarray, ...]:
        """Return what a unit of the coefficient adds."""
        acting = self.places(robot)
        load = load_torque(robot, motion, predicted)[:, acting]
        if self.of_link:
            return (_at(acting, motion, differentiate(differentiate(load, motion.rate), motion.rate)),)
        inertia = load_inertia(robot, motion, predicted)[:, acting]
        unit = np.sqrt(_mean_inertia(robot)[acting] / inertia)
        passed = self._among(
            predicted,
            (tuple(acting), motion.start),
            self.antiresonance,
            _SWINGS,
            lambda swings: _passed_at(load, inertia, motion, unit, swings),
        )
        return (_at(acting, motion, passed - load),)

    def columns(self, robot: Robot, motion: Motion, predicted: Predicted | None = None) -> np.ndarray:
        """Return (N, n, k): what a link behind its motor takes of its own joint, and of those whose links it moves."""
        own, acting = super().columns(robot, motion, predicted), self.places(robot)
        if self.of_link or not acting:
            return own
        kept: dict[Any, Any] = {} if predicted is None else predicted.kept
        key = self.id, "dragged", tuple(acting), motion.start
        if key not in kept:
            kept[key] = _dragged(robot, motion, acting, predicted)
        dragged, weighs = kept[key]
        swung = own[:, acting, range(len(acting))]
        sag = (swung + load_torque(robot, motion, predicted)[:, acting]) / self._stiffness(robot)[acting]
        return np.asarray(swung[:, None] * dragged - sag[:, None] * weighs)

    def parameters(self, robot: Robot, given: Coefficients) -> tuple[Quantity, ...]:
        """Return K; nothing where the rotor's inertia is needed and not known."""
        quantities = []
        stiffness = self._stiffness(robot)
        for joint, value, deviation in zip(self.acting(robot), given.values, given.deviations, strict=True):
            rotor = given.known.get(("rotor_inertia", joint.name, "Ia"), joint.rotor_inertia)
            top = rotor if self.of_link else float(stiffness[robot.index(joint.name)])
            if top is not None and value > 0:  # where no rotor swings K is 0, which is refused
                sure = value - NORMAL * deviation > 0  # else K has no upper end
                unit = f"{force_unit(joint)}/{joint.unit}"
                convert = lambda give, top=top: ratio(top, give)  # noqa: E731
                quantities.append(quantity("K", joint.name, value, unit, deviation if sure else None, convert))
        return tuple(quantities)

    def _stiffness(self, robot: Robot) -> np.ndarray:
        """Return (n,) N m/rad, by which a link of a joint's mean inertia swings so."""
        return np.asarray((2 * np.pi * self.antiresonance) ** 2 * _mean_inertia(robot))

    def possible(self, robot: Robot, stated: Stated) -> Mapping[str, Possible]:
        """Return how soft the acting joint that moves least can be."""
        inertia = _mean_inertia(robot)[self.places(robot)]
        softest = (2 * np.pi * _SLOWEST) ** 2 * float(inertia.min())
        return {"K": Possible(softest, np.inf, f"softer, the link would swing at less than {_SLOWEST:g} Hz")}


def _mean_inertia(robot: Robot) -> np.ndarray:
    return np.asarray(np.maximum(robot.mean_inertia, _LIGHTEST))
