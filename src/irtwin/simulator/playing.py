"""A simulator held against logs of commands and positions: which numbers of its servos differ, and what that closes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.special import expit

from irtwin.document import document as said
from irtwin.document.cause_ids import cause_ids
from irtwin.document.played import Added, Horizon, Number, Played, PlayedRun, Tracking
from irtwin.effects.catalogue import catalogue
from irtwin.errors import InputError
from irtwin.gap.thresholds import Criterion
from irtwin.identification.progress import Tell, paced
from irtwin.robot.description import Robot
from irtwin.robot.kinematics import placements
from irtwin.signals.log import DataSet, Run
from irtwin.simulator.alone import alone
from irtwin.simulator.choice import Choice, choose
from irtwin.simulator.fit import Fit
from irtwin.simulator.model import Model
from irtwin.simulator.play import Stretch, each, play, whole
from irtwin.simulator.servos import NAMES, Servos, servos

_STRETCHES, _LASTS = 16, 15.0  # of all runs that numbers are fitted to; s, of each
_STEP = 0.005  # s, of a joint played by itself
_FOLDS = 3
_BEGUN_ANEW = 0.5  # s
_HORIZONS = (0.1, 0.2, 0.3, 0.4, 0.5)  # s
_ATTRIBUTED = 0.5  # of the mean square that closes on motions held out, from which the numbers explain the gap
_AGREES = 2e-3  # rad (m), a tracking error that is no gap where no number differs
_POSES = 500  # of a run, of which the flange's place is told
_DEGREES = (50.0, 65.0)  # commands over positions, as slope: 180/pi is between


@cache
def _effects() -> dict[str, tuple[str, str, str, str]]:
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
    }


@dataclass(frozen=True)
class Playing:
    """A diagnosis by playing: its document, and the numbers (7, n) that the robot has, which of them differ."""

    document: said.Document
    servos: Servos
    numbers: np.ndarray
    differs: np.ndarray

    def written(self) -> bytes:
        """Return the model's file with the robot's numbers."""
        return self.servos.written(self.numbers, self.differs)


def to_be_played(data_set: DataSet) -> bool:
    """Return whether no run has torque or power, so that its commands are all there is."""
    return all(run.signals.torque is None and run.signals.power is None for run in data_set.runs)


def diagnose(data_set: DataSet, model: Model, tell: Tell) -> Playing:
    """Hold a model against the observed runs by playing their commands.

    Raises InputError where a run has no commands or they are in degrees, or the model has no position servos.
    """
    runs = [run for run in data_set.runs if run.role == "observed"]
    if not runs:
        raise InputError(f"{data_set.folder}: no run is observed; there is nothing to hold the model against")
    for run in runs:
        _check_commands(run, data_set.robot)
    own = servos(model)
    for line in _clipped(own, runs):
        tell(line)
    tell("Fitting numbers of servos")
    most = max(1, round(_STRETCHES / len(runs)))
    stretches = [one for run in runs for one in each(run, _LASTS, most)]
    step = max(_STEP, model.compiled.opt.timestep)
    begun = Fit(alone(own, stretches, step), np.full(len(model.joints), 1e-2), np.full(len(model.joints), 3.0))
    chosen = choose(begun, paced(tell))
    tell("Playing all runs")
    document = _document(data_set.robot, model, own, chosen, runs, paced(tell))
    return Playing(document, own, chosen.numbers, chosen.differs)


def _check_commands(run: Run, robot: Robot) -> None:
    if run.signals.command is None:
        raise InputError(f"{run.file}: has no commands to play; log cmd_JOINT, or leave the run out")
    for joint, told, q in zip(robot.joints, run.signals.command.T, run.signals.q.T, strict=True):
        slope = np.polyfit(q - q.mean(), told - told.mean(), 1)[0] if np.ptp(q) > 0 else 1.0
        if joint.unit == "rad" and _DEGREES[0] < slope < _DEGREES[1]:
            raise InputError(
                f"{run.file}: column cmd_{joint.name} is in degrees beside positions in rad; give it in rad"
            )


def _clipped(own: Servos, runs: Sequence[Run]) -> list[str]:
    shares = own.clipped(np.concatenate([run.signals.command for run in runs if run.signals.command is not None]))
    return [
        f"  {joint}: {100 * share:.2g} % of its commands are beyond the model's ctrlrange, which clips them"
        for joint, share in shares.items()
    ]


def _document(
    robot: Robot, model: Model, own: Servos, chosen: Choice, runs: Sequence[Run], tell: Tell
) -> said.Document:
    numbers = _numbers(robot, own, chosen)
    ranked = _ranked(chosen)
    before, after = _tracked(robot, own, runs, own.numbers, tell), _tracked(robot, own, runs, chosen.numbers, tell)
    held = _held_out(robot, own, chosen, runs, tell)
    total = {name: _pooled(some) for name, some in (("before", before), ("after", after), ("held", held))}
    played = Played(
        simulator=model.name,
        runs={
            run.name: PlayedRun(before=before[place], after=after[place], held_out=held[place] if held else None)
            for place, run in enumerate(runs)
        },
        before=total["before"],
        after=total["after"],
        held_out=total["held"] if held else None,
        added=_added(chosen, ranked),
        restarted=_restarted(own, runs, chosen.numbers),
        numbers=numbers,
    )
    causes = _causes(robot, numbers, ranked, played)
    return said.Document(
        verdict=_verdict(played),
        robot=robot.name,
        gap=said.Gap(energy_error_percent=None),
        locations=(),
        findings=tuple(_finding(one, played) for one in causes),
        causes=causes,
        not_testable=(),
        shrink=said.Shrink(
            held_out_runs=tuple(run.name for run in runs) if held else (),
            noise_floor_from=None,
            torque_rmse=None,
            power_rmse=None,
            energy_error_percent=None,
            closed_fraction=None,
            by_cause=(),
            yardstick={},
        ),
        next_experiment=None,
        unexplained_because=_because(played),
        played=played,
    )


def closed(played: Played) -> float:
    """Return the share of the mean square of the tracking error that closes, on motions held out where there are."""
    left = played.after if played.held_out is None else played.held_out
    return 1 - (left / played.before) ** 2


def _verdict(played: Played) -> str:
    if not played.numbers:
        return "no_gap" if played.before < _AGREES else "unexplained"
    return "attributed" if closed(played) >= _ATTRIBUTED else "unexplained"


def _because(played: Played) -> str | None:
    return "much_is_left" if _verdict(played) == "unexplained" else None


def _numbers(robot: Robot, own: Servos, chosen: Choice) -> tuple[Number, ...]:
    found = []
    for row, name in enumerate(NAMES):
        effect, _, turning, sliding = _effects()[name]
        for place in np.flatnonzero(chosen.differs[row]):
            lower, upper = chosen.interval[:, row, place]
            simulator, number = own.numbers[row, place], chosen.numbers[row, place]
            found.append(
                Number(
                    effect=effect,
                    joint=robot.joints[place].name,
                    name=name,
                    unit=turning if robot.joints[place].unit == "rad" else sliding,
                    simulator=float(simulator),
                    robot=float(number),
                    change=float(number - simulator),
                    interval95=(float(lower), float(upper)) if upper > lower else None,
                    log_odds=float(chosen.odds[row, place]),
                )
            )
    return tuple(found)


def _ranked(chosen: Choice) -> list[str]:
    """Return the names of numbers that differ, first what is missed most where the simulator's takes its place."""
    own = chosen.fit.servos.chart(chosen.fit.servos.numbers)
    names = [name for row, name in enumerate(NAMES) if chosen.differs[row].any()]
    back = []
    for name in names:
        at = chosen.played.at.copy()
        at[NAMES.index(name)] = own[NAMES.index(name)]
        back.append(at)
    left = [one.squares.mean() for one in chosen.fit.all_played(back)] if back else []
    return [names[place] for place in np.argsort(left)[::-1]]


def _causes(robot: Robot, numbers: Sequence[Number], ranked: Sequence[str], played: Played) -> tuple[said.Cause, ...]:
    by_name = [[one for one in numbers if one.name == name] for name in ranked]
    joints = [tuple(one.joint for one in some) for some in by_name]
    ids = cause_ids([(some[0].effect, on) for some, on in zip(by_name, joints, strict=True)], robot.joint_names)
    shares = _shares(played)
    return tuple(
        said.Cause(
            id=name,
            effect=some[0].effect,
            joints=on,
            scope="changed",
            confidence=float((1 - Criterion().unknown) * max(expit(one.log_odds) for one in some)),
            parameters=tuple(_parameter(one) for one in some),
            indistinguishable_from=(),
            evidence=said.Evidence(
                channel="position",
                share_of_what_is_closed=None,
                closed_where_it_acts=shares[some[0].effect],
                gain=shares[some[0].effect],
                log_odds=max(one.log_odds for one in some),
                probability_of_rivals={},
            ),
        )
        for name, some, on in zip(ids, by_name, joints, strict=True)
    )


def _added(chosen: Choice, ranked: Sequence[str]) -> tuple[Added, ...]:
    """Return what each effect's numbers close when they join those before them."""
    at = [chosen.fit.servos.chart(chosen.fit.servos.numbers)]
    for name in ranked:
        at.append(np.where(np.array(NAMES)[:, None] == name, chosen.played.at, at[-1]))
    left = [float(np.sqrt(chosen.fit.rolled(one).squares.mean())) for one in at]
    return tuple(
        Added(effect=_effects()[name][0], before=before, after=after)
        for name, before, after in zip(ranked, left, left[1:], strict=False)
    )


def _shares(played: Played) -> Mapping[str, float]:
    """Return the share of the mean square that each effect closes when it joins those before it."""
    return {one.effect: (one.before**2 - one.after**2) / played.added[0].before ** 2 for one in played.added}


def _parameter(one: Number) -> said.Parameter:
    ends = None if one.interval95 is None else (one.interval95[0] - one.simulator, one.interval95[1] - one.simulator)
    return said.Parameter(name=one.name, joint=one.joint, value=one.change, unit=one.unit, interval95=ends)


def _finding(cause: said.Cause, played: Played) -> said.Finding:
    family = next(family for effect, family, *_ in _effects().values() if effect == cause.effect)
    share = _shares(played)[cause.effect]
    return said.Finding(
        id=cause.id,
        family=family,
        joints=cause.joints,
        scope=cause.scope,
        channel="position",
        confidence=cause.confidence,
        share=share,
        share_interval95=(share, share),
        share_of="tracking error",
        matters=True,
        members=(said.Member(cause=cause.id, effect=cause.effect, family=family, confidence=cause.confidence),),
    )


def _held_out(robot: Robot, own: Servos, chosen: Choice, runs: Sequence[Run], tell: Tell) -> list[Tracking]:
    """Return the tracking error of each run by the numbers of other runs; of none where there is one run alone."""
    found: dict[int, Tracking] = {}
    folds = min(_FOLDS, len(runs))
    for fold in range(folds if len(runs) > 1 else 0):
        some = [place for place in range(len(runs)) if place % folds == fold]
        names = {runs[place].name for place in some}
        numbers = chosen.without(np.array([one.run.name in names for one in chosen.fit.stretches]))
        found |= dict(zip(some, _tracked(robot, own, [runs[place] for place in some], numbers, tell), strict=True))
    return [found[place] for place in sorted(found)]


def _left(own: Servos, runs: Sequence[Run], numbers: np.ndarray) -> list[np.ndarray]:
    """Return what each run's positions (N, n) have beyond the model's, the run played as a whole."""
    return [one.q - play(own, [numbers], [one])[0][0] for one in map(whole, runs)]


def _tracked(robot: Robot, own: Servos, runs: Sequence[Run], numbers: np.ndarray, tell: Tell) -> list[Tracking]:
    found = []
    for run in runs:
        tell(f"  run {run.name}")
        left = _left(own, [run], numbers)[0]
        some = slice(None, None, max(1, len(left) // _POSES))
        places = [placements(robot, q[some])[:, :3, 3] for q in (run.signals.q, run.signals.q - left)]
        joints = np.sqrt((left**2).mean(axis=0))
        found.append(
            Tracking(
                rms=_rms([left]),
                joints=dict(zip(robot.joint_names, map(float, joints), strict=True)),
                flange=float(np.sqrt(((places[0] - places[1]) ** 2).sum(axis=1).mean())),
            )
        )
    return found


def _restarted(own: Servos, runs: Sequence[Run], numbers: np.ndarray) -> tuple[Horizon, ...]:
    stretches: list[Stretch] = [one for run in runs for one in each(run, _BEGUN_ANEW)]
    before, after = play(own, [own.numbers, numbers], stretches)
    horizons = []
    for low, high in zip((0.0, *_HORIZONS), _HORIZONS, strict=False):
        rms = []
        for played in (before, after):
            rms.append(
                _rms([
                    (one.q - q)[(one.time >= low) & (one.time < high)] for one, q in zip(stretches, played, strict=True)
                ])
            )  # fmt: skip
        horizons.append(Horizon(seconds=high, before=rms[0], after=rms[1]))
    return tuple(horizons)


def _rms(left: Sequence[np.ndarray]) -> float:
    return float(np.sqrt(np.mean(np.concatenate([one.ravel() for one in left]) ** 2)))


def _pooled(some: Sequence[Tracking]) -> float:
    """Return the root of the mean square over runs, each alike."""
    return float(np.sqrt(np.mean([one.rms**2 for one in some]))) if some else float("nan")
