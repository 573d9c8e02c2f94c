"""The provider of better twins: fits a robot's twin again beside new logs, and keeps it where it is better.

It judges both twins on what neither was fitted to: what was held out of the earlier one, and the last third of each new
log.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime

from sqlalchemy import func, select

from irtwin.announce import Announce
from irtwin.effects.effect import Effect
from irtwin.errors import InputError
from irtwin.gap.choice import identified
from irtwin.gap.diagnosis import diagnose
from irtwin.identification.validation import FIT_SHARE, Split
from irtwin.providers.identification import fitted_data_set, twin_made
from irtwin.providers.motions import RobotMotions, robot_motions
from irtwin.providers.names import twin_iri
from irtwin.providers.provider import Made, keep
from irtwin.providers.records import inputs, load_twin
from irtwin.signals.motion import Motion
from irtwin.storage.database import Workspace
from irtwin.storage.schema import ImprovementRound, TwinRow, TwinRun
from irtwin.twin.identify import identify
from irtwin.twin.twin import Twin
from irtwin.twin.validate import validate

_SAME, _CHOSEN, _DIAGNOSED = "same effects", "effects that the data show", "effects of a diagnosis"
_ROUNDS = "improvement_round/"


@dataclass
class _Twin:
    """A twin, and which data it was fitted to and is judged on."""

    twin_id: str
    twin: Twin
    parts: Split


def improve(
    workspace: Workspace, robot_id: str, names: Sequence[str], limit: float, announce: Announce = lambda line: None
) -> tuple[tuple[ImprovementRound, ...], bool]:
    """Better a robot's twin by new logs that the workspace holds already, `names`; limit: energy error, %.

    Returns the rounds, and whether the twin is within the limit on every run.

    A round fits the effects of the twin again. Where that leaves it beyond the limit, another chooses them anew, if
    nobody named them, and one adds the effects that a diagnosis of the fitted data finds. A twin that is no better than
    the one before is not kept. Each round is stored.
    Raises InputError where nothing that is held out has measured power.
    """
    known = robot_motions(workspace, robot_id)
    twin_id, twin = load_twin(workspace, robot_id)
    before = _parts_before(workspace, known, twin_id, names)
    loop = _Loop(workspace, robot_id, known, limit, announce, _Twin(twin_id, twin, before))
    parts = _parts_with(known, before, names)
    fitted = fitted_data_set(workspace, robot_id, known, parts)

    def fit(effects: Sequence[str | Effect]) -> Twin:
        return identify(known.robot, parts.fit, effects)

    loop.try_out(_SAME, lambda: replace(fit(twin.effects), choices=twin.choices), parts)
    if not loop.within and fitted.effects is None:
        loop.try_out(_CHOSEN, lambda: identified(fitted, parts.fit), parts)
    if not loop.within:
        announce("  looking for effects that the twin lacks")
        try:
            diagnosis = diagnose(replace(fitted, effects=loop.best.twin.effect_ids))
        except InputError as error:
            announce(f"  these runs do not say: {error}")
        else:
            effects = None if diagnosis.twin is None else diagnosis.twin.effects
            if effects is not None and effects != loop.best.twin.effects:
                loop.try_out(_DIAGNOSED, lambda: fit(effects), parts)
    _, made = twin_made(workspace, robot_id, loop.best.twin, known, loop.best.parts)  # the parts that runs now take
    keep(workspace, "identification", made, datetime.now(UTC), instead_of="adoption")
    return tuple(loop.rounds), loop.within


@dataclass
class _Loop:
    """Rounds one after the other; `best` is the twin that is to be the robot's."""

    workspace: Workspace
    robot_id: str
    known: RobotMotions
    limit: float
    announce: Announce
    best: _Twin
    rounds: list[ImprovementRound] = field(default_factory=list)

    @property
    def within(self) -> bool:
        """Whether the best twin is within the limit on every run that it is judged on."""
        return _worst(self.best.twin, _judged(self.best.parts)) <= self.limit

    def try_out(self, tried: str, fit: Callable[[], Twin], parts: Split) -> None:
        """Fit a twin, judge it beside the best so far, and store the round."""
        started = datetime.now(UTC)
        self.announce(f"  fitting the {tried}")
        twin = fit()
        fitted = _Twin(twin_made(self.workspace, self.robot_id, twin, self.known, parts)[0], twin, parts)
        before, after = _worst(self.best.twin, parts.held_out), _worst(twin, parts.held_out)
        earlier = self.best.twin_id
        if after < before:
            self.best = fitted
        outcome = "no better" if after >= before else "within the limit" if self.within else "better"
        self.announce(
            f"  worst energy error on what neither was fitted to: {before:.3g} %, then {after:.3g} %: {outcome}"
        )
        rounds = select(func.max(ImprovementRound.number)).where(ImprovementRound.robot_id == self.robot_id)
        number = 1 + (self.workspace.first(rounds) or 0)
        row = ImprovementRound(
            round_id=f"{self.robot_id}.{number}",
            robot_id=self.robot_id,
            number=number,
            tried=tried,
            effects=",".join(twin.effect_ids),
            earlier_twin_id=earlier,
            tried_twin_id=fitted.twin_id,
            error_before_percent=before,
            error_after_percent=after,
            limit_percent=self.limit,
            outcome=outcome,
        )
        self.rounds.append(row)
        read = {motion.run for motion in (*parts.fit, *parts.held_out)}
        run_ids = [run_id for name, run_id in self.known.keys.items() if name in read]
        used = [twin_iri(earlier), *inputs(self.workspace, self.robot_id, run_ids)]
        keep(self.workspace, "improvement", Made(self.robot_id, used, [row]), started, f"{_ROUNDS}{row.round_id}")


def _parts_before(workspace: Workspace, known: RobotMotions, twin_id: str, new: Sequence[str]) -> Split:
    """Return the parts that runs took in a twin; new logs are held out of it."""
    fit, held_out = [], []
    for row in workspace.all(select(TwinRun).where(TwinRun.twin_id == twin_id)):
        motion = known.motions[row.run_id]
        cut = None if row.held_out_from_s is None else int((motion.time < row.held_out_from_s).sum())
        if row.part in ("fit", "both"):
            fit.append(motion if cut is None else motion.part(0, cut))
        if row.part in ("held_out", "both"):
            held_out.append(motion if cut is None else motion.part(cut, len(motion.time)))
    held_out += [motion for motion in known.motions.values() if motion.run in new]
    return Split(tuple(fit), tuple(held_out), workspace.row(TwinRow, twin_id).split)


def _parts_with(known: RobotMotions, before: Split, new: Sequence[str]) -> Split:
    """Return the parts with the first two thirds of each new log fitted."""
    fit = list(before.fit)
    held_out = [motion for motion in before.held_out if motion.run not in new]
    for motion in known.motions.values():
        if motion.run in new:
            cut = round(FIT_SHARE * len(motion.time))
            fit.append(motion.part(0, cut))
            held_out.append(motion.part(cut, len(motion.time)))
    rule = before.rule.partition("; logged since")[0]
    return Split(tuple(fit), tuple(held_out), f"{rule}; logged since and cut in time: {', '.join(new)}")


def _judged(parts: Split) -> list[Motion]:
    """Return what the rules judge a twin on: what was held out, and runs that were fitted whole."""
    cut = {motion.run for motion in parts.held_out}
    return [*parts.held_out, *(motion for motion in parts.fit if motion.run not in cut)]


def _worst(twin: Twin, motions: Sequence[Motion]) -> float:
    errors = [fit.energy_error for fit in validate(twin, motions) if fit.energy_error is not None]
    if not errors:
        raise InputError(f"{twin.robot.name}: no run outside the fit has measured power to judge by; log power")
    return max(errors)
