"""The document of a diagnosis by playing, and what a page draws of it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import scipy

from irtwin.document import document as said
from irtwin.document.curves import Curves, FarthestApart, RunError
from irtwin.document.document import cause_ids
from irtwin.effects.catalogue import catalogue
from irtwin.effects.compliance import JointElasticity
from irtwin.effects.load import CableDrag, ExternalContact
from irtwin.gap.energy_errors import EnergyErrors
from irtwin.gap.isolation.closing import share
from irtwin.gap.thresholds import DEFAULT
from irtwin.gap.writing import folded
from irtwin.robot.description import Robot
from irtwin.simulator.choice import DifferingNumbers
from irtwin.simulator.push import FoundPush
from irtwin.simulator.servos import NAMES, OF_JOINTS, PARTS, SOFT, row_of
from irtwin.simulator.tracking import Parts, Tracked

AGREES = 2e-3  # rad (m), a tracking error that is no gap where no number differs
_NONE = 1e-9  # as good as none of what the model leaves
_ATTRIBUTED = 0.5  # of the mean square that closes on motions held out, from which the numbers explain the gap
_NOT_HELD = "dead_band"  # no number of MuJoCo's servos
_COMPLIANCES = tuple(NAMES[row] for row in SOFT)
_CALLED = {"spring": "k"}  # by its effect
PUSH = "push"  # of a robot for a while; with its place
_SYMBOLS = {
    "payload": ("m", "kg"),
    **{f"payload_{axis}": (f"c_{axis}", "m") for axis in "xyz"},
    **{f"tilt_{axis}": (f"angle_{axis}", "rad") for axis in "xy"},
}
_SHARE_OF = ("the mean square of the tracking error", "the mean squares of the tracking error and of the torque's")

Horizons = Sequence[tuple[float, float, float]]
Pushes = Mapping[str, FoundPush]


@cache
def effects() -> Mapping[str, tuple[str, str, str, str]]:
    """Return effect, family, unit of a joint that turns, and of one that slides, of each number."""
    known = {number: effect.id for effect in catalogue().values() for number in effect.in_mjcf.values()}
    return {
        "stiffness": ("servo_stiffness", "drive", "N m/rad", "N/m"),
        "damping": (known["damping"], "friction", "N m s/rad", "N s/m"),
        "friction": (known["frictionloss"], "friction", "N m", "N"),
        "holding": ("friction_creep", "friction", "1", "1"),
        "armature": (known["armature"], "bodies", "kg m^2", "kg"),
        "offset": ("command_offset", "sensing", "rad", "m"),
        "delay": ("command_delay", "sensing", "s", "s"),
        "torque_limit": ("servo_torque_limit", "drive", "N m", "N"),
        "dead_band": ("servo_dead_band", "drive", "rad", "m"),
        "spring": (CableDrag.id, CableDrag.family, "N m/rad", "N/m"),
        **dict.fromkeys(_COMPLIANCES, (JointElasticity.id, JointElasticity.family, "N m/rad", "N/m")),
        PUSH: (ExternalContact.id, ExternalContact.family, "", ""),
        **{part: (part, catalogue()[part].family, "", "") for part in PARTS},
    }


def _told(name: str) -> tuple[str, str, str, str]:
    return effects()[PUSH if name.startswith(PUSH) else name]


def families(names: Sequence[str]) -> list[tuple[str, ...]]:
    """Return names by their families, in their order."""
    of: dict[str, list[str]] = {}
    for name in names:
        of.setdefault(_told(name)[1], []).append(name)
    return [tuple(some) for some in of.values()]


def document(
    robot: Robot,
    simulator: str,
    runs: Sequence[str],
    chosen: DifferingNumbers,
    pushes: Pushes,
    parts: Parts,
    before: Sequence[Tracked],
    after: Sequence[Tracked],
    horizons: Horizons,
) -> said.Document:
    """Return the document; `before`, `after`: each run played as a whole, by the model and by numbers of other runs."""
    squares = [np.array([run.squares for run in some]) for some in (before, after)]
    names = sorted(parts.names, key=lambda name: -parts.relative(parts.without(name)).sum())
    causes = _causes(robot, chosen, pushes, parts, names)
    findings = _findings(robot, dict(zip(names, causes, strict=True)), parts, chosen.fit.floor)
    named = any(finding.matters for finding in findings)
    places, torques = [side[:, 0] for side in squares], [side[:, 1:] for side in squares]
    closed, interval = share((places[0] - places[1]).sum(axis=1), places[0].sum(axis=1))
    verdict = _verdict(named, closed, *map(_rms, places))
    energies = _energies(before, after)
    return said.Document(
        verdict=verdict,
        robot=robot.name,
        gap=said.Gap(
            energy_error_percent=energies.mean[0] if energies else None,
            torque=_sizes(robot, torques[0][:, 0]) if torques[0].size else None,
            position=_sizes(robot, places[0]),
        ),
        locations=(),
        findings=findings,
        causes=folded(causes, findings),
        not_testable=(),
        shrink=said.Shrink(
            held_out_runs=tuple(runs) if len(runs) > 1 else (),
            noise_floor_from=None,
            torque_rmse=together(*(torque[:, 0] for torque in torques)) if torques[0].size else None,
            power_rmse=None,
            energy_error_percent=energies.change if energies else None,
            closed_fraction=said.ClosedFraction(value=closed, interval95=interval) if named else None,
            by_cause=tuple(_change(cause, name, parts) for cause, name in zip(causes, names, strict=True)),
            position_rmse=together(*places),
        ),
        next_experiment=None,
        unexplained_because="much_is_left" if verdict == "unexplained" else None,
        simulator=simulator,
        horizons=tuple(
            said.Horizon(seconds=at, before=error_before, after=error_after)
            for at, error_before, error_after in horizons
        ),
    )


def _energies(before: Sequence[Tracked], after: Sequence[Tracked]) -> EnergyErrors | None:
    errors = [np.array([run.energy_error for run in side if run.energy_error is not None]) for side in (before, after)]
    return EnergyErrors(*errors) if errors[0].size else None


def _sizes(robot: Robot, squares: np.ndarray) -> Mapping[str, said.Size]:
    return {
        joint: said.Size(rmse=float(np.sqrt(mean)), noise_floor=None, excess=None)
        for joint, mean in zip(robot.joint_names, squares.mean(axis=0), strict=True)
    }


def curves(robot: Robot, runs: Sequence[str], before: Sequence[Tracked], after: Sequence[Tracked]) -> Curves:
    """Return what a page draws: the tracking error of each run, and robot and model where they are farthest apart."""
    every = tuple(_errors(robot, runs, before, after))
    return Curves(follows=(), runs=every, experiment=None, apart=_apart(runs, before, after))


def _apart(runs: Sequence[str], before: Sequence[Tracked], after: Sequence[Tracked]) -> FarthestApart:
    run = int(np.argmax([played.off.max() for played in before]))
    by_model, by_numbers = before[run], after[run]
    at = int(by_model.off.argmax())
    return FarthestApart(
        run=runs[run],
        time=float(by_model.time[at]),
        robot=tuple(by_model.robot[at].tolist()),
        before=tuple(by_model.model[at].tolist()),
        after=tuple(by_numbers.model[at].tolist()),
        off_before=float(by_model.off[at]),
        off_after=float(by_numbers.off[at]),
    )


def _errors(
    robot: Robot, runs: Sequence[str], before: Sequence[Tracked], after: Sequence[Tracked]
) -> Iterator[RunError]:
    for run, by_model, by_numbers in zip(runs, before, after, strict=True):
        errors: dict[tuple[str | None, str | None], tuple[float, float]] = {}
        errors["position", None] = _rms(by_model.squares[0]), _rms(by_numbers.squares[0])
        errors["flange", None] = by_model.flange, by_numbers.flange
        for channel, left, then in zip(("position", None), by_model.squares, by_numbers.squares, strict=False):
            for place, joint in enumerate(robot.joint_names):
                errors[channel, joint] = _rms(left[place]), _rms(then[place])
        for (of, at), (left, then) in errors.items():
            yield RunError(run=run, joint=at, before=left, after=then, floor=None, of=of)


def _verdict(named: bool, closed: float, before: float, after: float) -> str:
    if not named:
        return "no_gap" if before < AGREES else "unexplained"
    return "attributed" if closed >= _ATTRIBUTED or after < AGREES else "unexplained"


def together(before: np.ndarray, after: np.ndarray) -> said.Change:
    """Return how far an error falls, of mean squares (runs, n), with Student's interval over runs of what is left."""
    of_run = after.mean(axis=1)
    half = scipy.special.stdtrit(len(of_run) - 1, 0.975) * scipy.stats.sem(of_run) if len(of_run) > 1 else 0.0
    lower, upper = (float(np.sqrt(max(of_run.mean() + side * half, 0.0))) for side in (-1, 1))
    return said.Change(
        before=_rms(before),
        after=_rms(after),
        noise_floor=None,
        interval95_after=(lower, upper) if len(of_run) > 1 else None,
    )


def _causes(
    robot: Robot, chosen: DifferingNumbers, pushes: Pushes, parts: Parts, names: Sequence[str]
) -> tuple[said.Cause, ...]:
    joints = [
        [robot.joint_names[at] for at in np.flatnonzero(chosen.differs[row_of(name)])] if name in OF_JOINTS else []
        for name in names
    ]
    ids = cause_ids([(_told(name)[0], on) for name, on in zip(names, joints, strict=True)], robot.joint_names)
    odds = [pushes[name].odds if name in pushes else float(chosen.odds[row_of(name)].max()) for name in names]
    return tuple(
        said.Cause(
            id=cause_id,
            effect=_told(name)[0],
            joints=tuple(on),
            scope="changed",
            confidence=float((1 - DEFAULT.criterion.unknown) * scipy.special.expit(sure)),
            parameters=tuple(_of_push(pushes[name]) if name in pushes else _parameters(robot, chosen, name)),
            indistinguishable_from=(),
            evidence=_evidence(chosen, pushes.get(name), parts, name, sure),
        )
        for cause_id, name, on, sure in zip(ids, names, joints, odds, strict=True)
    )


def _evidence(
    chosen: DifferingNumbers, push: FoundPush | None, parts: Parts, name: str, log_odds: float
) -> said.Evidence:
    at = np.ones(chosen.differs.shape[1], dtype=bool) if push else chosen.differs[row_of(name)]
    everywhere, left = (float(parts.relative(some).sum()) for some in (parts.without(name), parts.after))
    without, after = (float(parts.relative(some * at).sum()) for some in (parts.without(name), parts.after))
    return said.Evidence(
        channel="position",
        share_of_what_is_closed=None,
        closed_where_it_acts=1 - after / max(without, _NONE),
        gain=everywhere / max(left, _NONE) - 1,
        log_odds=log_odds,
        probability_of_rivals={},
        runs=(push.push.run,) if push else None,
        window=(push.push.start, push.push.stop) if push else None,
    )


def _of_push(push: FoundPush) -> Iterator[said.CauseParameter]:
    for name, unit, value, half in push.numbers:
        ends = (value - half, value + half)
        yield said.CauseParameter(
            name=name, joint=None, value=value, unit=unit, interval95=ends, simulator=None, robot=None
        )


def _parameters(robot: Robot, chosen: DifferingNumbers, name: str) -> Iterator[said.CauseParameter]:
    if name in PARTS:
        for number in PARTS[name]:
            symbol, unit = _SYMBOLS[number]
            yield replace(_parameter(chosen, number, 0, None, unit), name=symbol)
        return
    _, _, turning, sliding = _told(name)
    for place in np.flatnonzero(chosen.differs[row_of(name)]):
        unit = turning if robot.joints[place].unit == "rad" else sliding
        own = _parameter(chosen, name, int(place), robot.joint_names[place], unit)
        yield _as_stiffness(own) if name in _COMPLIANCES else replace(own, name=_CALLED.get(name, name))


def _parameter(chosen: DifferingNumbers, name: str, place: int, joint: str | None, unit: str) -> said.CauseParameter:
    row = row_of(name)
    simulator, robots = float(chosen.fit.servos.numbers[row, place]), float(chosen.numbers[row, place])
    held = name != _NOT_HELD
    lower, upper = chosen.interval[:, row, place] - simulator
    return said.CauseParameter(
        name=name,
        joint=joint,
        value=robots - simulator,
        unit=unit,
        interval95=(float(lower), float(upper)) if upper > lower else None,
        simulator=simulator if held else None,
        robot=robots if held else None,
    )


def _as_stiffness(own: said.CauseParameter) -> said.CauseParameter:
    """Return a compliance as the stiffness of a joint that the model has rigid."""
    ends = own.interval95
    held = (1 / ends[1], 1 / ends[0]) if ends and ends[0] > 0 else None
    return replace(own, name="K", value=1 / own.value, interval95=held, simulator=None, robot=None)


def _change(cause: said.Cause, name: str, parts: Parts) -> said.CauseChange:
    before, alone, without, after = (
        tuple(map(float, np.sqrt(some[:, 0].mean(axis=0))))
        for some in (parts.before, parts.alone(name), parts.without(name), parts.after)
    )
    return said.CauseChange(
        cause=cause.id,
        effect=cause.effect,
        joints=cause.joints,
        scope=cause.scope,
        channel="position",
        share=None,
        rmse_before=before,
        rmse_alone=alone,
        rmse_when_left_out=without,
        rmse_with_all=after,
    )


def _findings(
    robot: Robot, causes: Mapping[str, said.Cause], parts: Parts, floor: np.ndarray
) -> tuple[said.Finding, ...]:
    """Return the causes by family, the one that closes most first; `floor` (c, n) as of the fit."""
    of, whole = families(parts.names), parts.relative(parts.before)
    findings = []
    for some in of:
        own = [cause for name, cause in causes.items() if name in some]
        closed = parts.closed(some, of)
        value, interval = share(parts.relative(closed), whole)
        family = _told(some[0])[1]
        on = tuple(joint for joint in robot.joint_names if any(joint in cause.joints for cause in own))
        findings.append(
            said.Finding(
                id=cause_ids([(family, on)], robot.joint_names)[0],
                family=family,
                joints=on,
                scope="changed",
                channel="position",
                confidence=max(cause.confidence for cause in own),
                share=value,
                share_interval95=interval,
                share_of=_SHARE_OF[parts.before.shape[1] - 1],
                matters=_matters(closed.mean(axis=0), parts.before.mean(axis=0), floor),
                members=tuple(
                    said.Member(cause=cause.id, effect=cause.effect, family=family, confidence=cause.confidence)
                    for cause in own
                ),
            )
        )
    return tuple(sorted(findings, key=lambda finding: -finding.share))


def _matters(closed: np.ndarray, before: np.ndarray, floor: np.ndarray) -> bool:
    """Return whether mean squares `closed` (c, n) are at any joint enough of its gap, and more than noise.

    A wrist is off by less than a shoulder: of all joints' error together its own can be a hundredth.
    """
    enough = closed >= DEFAULT.matters.share * before
    return bool((enough & (closed >= (DEFAULT.matters.floors * floor) ** 2)).any())


def _rms(squares: np.ndarray) -> float:
    return float(np.sqrt(np.mean(squares)))
