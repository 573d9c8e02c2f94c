"""The case: what a data set asks to be diagnosed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from irtwin.document.document import Cutoff
from irtwin.effects.effect import NOTHING_STATED, Effect, Stated
from irtwin.effects.friction import FrictionTurn
from irtwin.effects.prior import Prior
from irtwin.effects.sensing import LONGEST_LAG, OffsetOfRun
from irtwin.effects.stack import Stack
from irtwin.gap.data.admission import admit
from irtwin.gap.data.baseline import baseline
from irtwin.gap.data.noise_floor import sensor_noise, shaken
from irtwin.gap.regression.groups import Grouping
from irtwin.gap.regression.hypotheses import place_of
from irtwin.gap.thresholds import Thresholds
from irtwin.identification.cutoff import cutoff_for
from irtwin.identification.friction_near_zero import with_friction_near_zero
from irtwin.identification.progress import tell
from irtwin.identification.torque_constants import torque_from_current
from irtwin.robot.description import Joint, Robot
from irtwin.signals.conditioning import condition_for_fit
from irtwin.signals.log import DataSet, Run
from irtwin.signals.motion import Motion
from irtwin.signals.sampling import earlier
from irtwin.twin.shapes import shaped
from irtwin.twin.torque_scale import of_sensor
from irtwin.twin.twin import Twin

_LONG = 12_000  # samples: at 12,000 a copy of the process neither wins nor costs (a diagnosis of 9 s)


@dataclass(frozen=True)
class Case:
    """The robot, its twin's effects (ids, or effects of a shape), and each run's motion by name, all filtered alike.

    `prior`: what is known of the twin's coefficients; None: what the catalogue expects; `stated`: what bounds the
    causes. `robot` has the torque constants that a balance of power told where nobody knew them, and `motions` the
    torque that follows; `given` are the robot and the motions without. `cutoff` is that of all motions. `turning` are
    the joints of which a search found that their dry friction turns otherwise than by one width.
    """

    robot: Robot
    effects: tuple[str | Effect, ...]
    runs: tuple[Run, ...]
    motions: dict[str, Motion]
    given: tuple[Robot, dict[str, Motion]]
    thresholds: Thresholds
    prior: Prior | None = None
    stated: Stated = NOTHING_STATED
    cutoff: Cutoff | None = None
    turning: frozenset[str] = frozenset()

    @cached_property
    def stack(self) -> Stack:
        """The twin's effects."""
        return Stack(self.robot, self.effects, self.prior)

    @cached_property
    def modelled(self) -> frozenset[tuple[str, str | None]]:
        """Each effect that the twin has, with each joint at which it has it; None: of the whole robot, or known."""
        modelled = set()
        for effect in self.stack.effects:
            terms = effect.terms(self.robot)
            known = all(term.fixed for term in terms)  # as a candidate, it has one coefficient for all
            modelled |= {(effect.id, None if known else place_of(term)) for term in terms}
        return frozenset(modelled)

    @property
    def observed(self) -> frozenset[str]:
        """The names of the runs whose gap is to be diagnosed."""
        return frozenset(run.name for run in self.runs if run.role == "observed")

    @property
    def grouping(self) -> Grouping:
        """Which runs are left out together: those of one programmed motion."""
        return Grouping(_labels(self.runs), self.observed)

    @property
    def seen(self) -> list[Motion]:
        """The observed runs' motions."""
        return [motion for run, motion in self.motions.items() if run in self.observed]

    @property
    def others(self) -> list[Motion]:
        """The motions of the runs that observed ones are held against: reference or simulated."""
        return [motion for run, motion in self.motions.items() if run not in self.observed]

    @property
    def sides(self) -> list[frozenset[str]]:
        """The runs of the robot as it is, and as it was before: a simulator's do not differ as a robot's do."""
        return [self.observed, frozenset(run.name for run in self.runs if run.role == "reference")]

    @property
    def against(self) -> str | None:
        """The role of the runs that the observed ones are held against: "reference", "simulated" or none."""
        return next((run.role for run in self.runs if run.role != "observed"), None)

    @property
    def alike(self) -> bool:
        """Whether the runs that observed ones are held against are reference runs, all logged at nearly one rate."""
        steps = [float(np.median(np.diff(run.signals.time))) for run in self.runs]
        return self.against == "reference" and round(max(steps) / min(steps)) == 1

    @property
    def with_torque(self) -> list[Motion]:
        """The motions whose torque is known."""
        return [motion for motion in self.motions.values() if motion.torque is not None]

    @property
    def with_power(self) -> list[Motion]:
        """The motions whose power was measured."""
        return [motion for motion in self.motions.values() if motion.power is not None]

    @property
    def measured(self) -> list[Motion]:
        """The motions whose torque is known or whose power was measured."""
        return [motion for motion in self.motions.values() if motion.torque is not None or motion.power is not None]

    @cached_property
    def shaken(self) -> tuple[tuple[Motion, Motion], ...]:
        """Some observed motions, each with the same once more to which its noise of positions was added again."""
        return shaken(self.runs, self.motions, self.robot, self.thresholds.data)

    @cached_property
    def sensor_noise(self) -> np.ndarray | None:
        """(n,) RMS of the noise of torque's sensors in the band; None where it is unknown."""
        real = [run for run in self.runs if run.role != "simulated"]
        return sensor_noise(real, self.motions, self.thresholds.data)[0]

    @property
    def long(self) -> bool:
        """Whether there are so many samples that work on all of them is worth a copy of the process."""
        return sum(len(motion.time) for motion in self.motions.values()) >= _LONG

    def run_offsets(self, share: float | None = None) -> list[Effect]:
        """Return what the torque of each run but the first is off by, where the runs are few: as `OffsetOfRun` says.

        Two runs differ in the mean of many things; no other run tells which of these is an effect.
        """
        runs = [motion.run for motion in self.with_torque]
        return [OffsetOfRun(runs=(run,), share=share) for run in runs[1:]] if self.grouping.few(runs) else []

    def turns(self, *, known: bool) -> list[Effect]:
        """Return what dry friction of the joints that are known to turn, or of the others, does beside its turn."""
        joints = tuple(joint for joint in self.robot.joint_names if (joint in self.turning) == known)
        return [FrictionTurn(joints=joints)] if joints else []

    def with_friction_near_zero(self, beside: Sequence[Effect] = ()) -> Case:
        """Return the case with the turn of each joint's dry friction, `beside` what a search found.

        It is as the runs show it that observed ones are held against; where these show none, as the observed ones do.
        Where it turns over another speed in these, both turns are nobody's. Of joints of which a search found that it
        turns, all runs say how.
        """
        robot, effects = self.robot, [*self.effects, *beside]
        sides = [motions for motions in (self.seen, self.others) if motions]
        known = self.turning if len(sides) == 1 else frozenset()  # one side has all runs: once is enough
        for motions in sides:
            turned, _ = with_friction_near_zero(self.robot, motions, effects, known)
            both = zip(robot.joints, turned.joints, strict=True)
            robot = replace(robot, joints=tuple(_turned(own, joint) for own, joint in both))
        if self.turning:
            if not known:
                turned, _ = with_friction_near_zero(self.robot, self.with_torque, effects, self.turning)
            both = zip(robot.joints, turned.joints, strict=True)
            robot = replace(robot, joints=tuple(joint if joint.name in self.turning else own for own, joint in both))
        return replace(self, robot=robot)

    @property
    def longest_lag(self) -> float:
        """By how much filters make torque lag, and samples where they are longer, s."""
        return max(LONGEST_LAG, *(1 / motion.rate for motion in self.with_torque))

    def without_lag(self, lag: float) -> Case:
        """Return the case with torque so much earlier, s, and the cutoff's reason saying so."""
        motions = {run: _earlier(motion, lag) for run, motion in self.motions.items()}
        reason = f"torque comes {1e3 * lag:.2g} ms later than positions, as filters make it: taken out"
        cutoff = None if self.cutoff is None else replace(self.cutoff, why=f"{self.cutoff.why}; {reason}")
        return replace(self, motions=motions, cutoff=cutoff)

    def shows(self, signal: str) -> bool:
        """Return whether some observed run has the signal: "torque" or "power"."""
        return any(getattr(motion, signal) is not None for motion in self.seen)


def case_of(data_set: DataSet, withhold: Sequence[str], thresholds: Thresholds, twin: Twin | None = None) -> Case:
    """Prepare a data set; `withhold` takes effects out of the twin, which is `twin` or what the data set says.

    Raises InputError where `baseline` and `admit` do.
    """
    data_set = replace(data_set, runs=_held_against_one(data_set.runs))
    begun = baseline(data_set, withhold, thresholds.data.moved, twin)
    cutoff = cutoff_for(begun.robot, data_set.runs, data_set.cutoff)
    given = {run.name: condition_for_fit(run, begun.robot, cutoff.hz) for run in data_set.runs}
    robot, known, _ = torque_from_current(begun.robot, list(given.values()))
    motions = dict(zip(given, known, strict=True))
    admit(data_set, motions, thresholds.data.shortest)
    known_of = begun.prior, _stated(data_set)
    case = Case(robot, begun.effects, data_set.runs, motions, (begun.robot, given), thresholds, *known_of, cutoff)
    case = case.with_friction_near_zero()
    sides = [case.others, case.seen] if case.against == "reference" else [case.seen]
    return replace(case, effects=shaped(case.robot, sides, case.effects))


def _held_against_one(runs: tuple[Run, ...]) -> tuple[Run, ...]:
    """Return the runs without reference runs where there are simulated ones: no fit is of a simulator and a robot."""
    if not any(run.role == "simulated" for run in runs):
        return runs
    kept = tuple(run for run in runs if run.role != "reference")
    if len(kept) < len(runs):
        tell(f"  beside a simulator reference runs are left out: {len(runs) - len(kept)}")
    return kept


def _earlier(motion: Motion, lag: float) -> Motion:
    """Return a motion with its torque so much earlier, s."""
    if motion.torque is None:
        return motion
    fast = None if motion.fast_torque is None else earlier(motion.time, motion.fast_torque, lag)
    return replace(motion, torque=earlier(motion.time, motion.torque, lag), fast_torque=fast)


def _turned(before: Joint, joint: Joint) -> Joint:
    """Return a joint as one side's runs show its friction, where they do, and the wider turn of this and `before`."""
    if joint.friction_width is None:
        return replace(before, dry_friction=joint.dry_friction or before.dry_friction)
    return replace(joint, friction_widest=max(before.friction_width or 0.0, joint.friction_width))


def _stated(data_set: DataSet) -> Stated:
    rated = data_set.notes.get("rated_payload")
    alone = all(run.role == "observed" for run in data_set.runs)  # else the others show what the sensor is off by
    return Stated(
        payload=max((run.payload_mass for run in data_set.runs if run.role == "observed"), default=0.0),
        rated_payload=float(rated) if isinstance(rated, int | float) and rated > 0 else None,
        torque_scale=data_set.torque_scale_uncertainty,
        torque_sensor=of_sensor(data_set) if alone else None,
    )


def _labels(runs: Sequence[Run]) -> dict[str, str]:
    """Return each run's programmed motion: the run that it repeats, directly or not."""
    repeats = {run.name: run.repeat_of for run in runs}
    labels = {}
    for run in runs:
        first, seen = run.name, {run.name}
        while (before := repeats.get(first)) and before not in seen:
            first = before
            seen.add(first)
        labels[run.name] = first
    return labels
