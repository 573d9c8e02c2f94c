"""The diagnosis of a gap: where it lies, which effect causes it, how far it shrinks once that is added."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from irtwin.effects.effect import BASELINE, Effect, Predicted, Quantity, Term, catalogue
from irtwin.effects.stack import Stack
from irtwin.errors import InputError
from irtwin.gap.attribute import Attribution, Cause, attribute
from irtwin.gap.channels import Grouping, Torque, power_system, torque_system
from irtwin.gap.confidence import confidence
from irtwin.gap.experiment import next_experiment
from irtwin.gap.floor import Floor, noise_floor
from irtwin.gap.hypotheses import CHANGED, MISSING, Hypothesis, hypotheses
from irtwin.gap.locate import Location, curves, heat_map, locate, locate_power
from irtwin.gap.shrink import HeldOut, closed_fraction, held_out, pooled_interval
from irtwin.gap.system import System
from irtwin.gap.visibility import Untestable, untestable
from irtwin.identification.estimators import Estimate, estimate
from irtwin.identification.torque_constants import torque_constants
from irtwin.robot.description import Robot
from irtwin.signals.conditioning import choose_cutoff, condition
from irtwin.signals.log import DataSet, Run
from irtwin.signals.motion import Motion
from irtwin.twin.identify import identify
from irtwin.twin.twin import Twin

Progress = Callable[[str], None]
PowerOf = Callable[[Motion, np.ndarray], tuple[np.ndarray, np.ndarray]]

NO_GAP, ATTRIBUTED, AMBIGUOUS, UNEXPLAINED = "no_gap", "attributed", "ambiguous", "unexplained"
_LEAST = 0.03  # gain that matters
_EXCESS = 3.0  # over a floor from repeats: a gap, though nothing explains it; below lies what differs between runs
_STEADY = 0.75  # of the groups have to show it


@dataclass(frozen=True)
class Channel:
    """What was found in one channel: "torque" (per joint) or "power"."""

    name: str
    system: System
    attribution: Attribution
    held_out: HeldOut
    floor: np.ndarray | None
    estimate: Estimate

    @property
    def rmse(self) -> np.ndarray:
        """(g,) before anything is added, on groups left out."""
        return self.held_out.rmse(self.held_out.before)

    @property
    def excess(self) -> np.ndarray | None:
        """(g,) mean square over the floor's, less one."""
        return None if self.floor is None else self.rmse**2 / self.floor**2 - 1


@dataclass(frozen=True)
class EnergyErrors:
    """Energy error of each observed group when it was left out of the fit, %: (G,) before and after."""

    before: np.ndarray
    after: np.ndarray

    @property
    def mean(self) -> tuple[float, float]:
        """Over groups, before and after."""
        return float(self.before.mean()), float(self.after.mean())

    def to_json(self, seed: int) -> dict[str, Any]:
        """Return the change in the form of the schema."""
        generator = np.random.default_rng(seed)
        drawn = [generator.choice(self.after, len(self.after)).mean() for _ in range(1000)]
        low, high = np.quantile(drawn, [0.025, 0.975])
        before, after = self.mean
        return {
            "before": before,
            "after": after,
            "noise_floor": None,
            "interval95_after": [float(low), float(high)],
        }


@dataclass(frozen=True)
class Diagnosis:
    """The diagnosis; `to_json` has the form of `diagnosis.schema.json`; `evidence` holds what a page draws."""

    description: Robot
    verdict: str
    channels: tuple[Channel, ...]
    floor: Floor
    locations: tuple[Location, ...]
    untestable: tuple[Untestable, ...]
    runs: tuple[str, ...]
    seed: int = 0
    experiment: dict[str, Any] | None = None
    evidence: dict[str, Any] = field(default_factory=dict)
    twin: Twin | None = None  # with the causes added, fitted to all runs in which it holds
    energies: EnergyErrors | None = None

    @property
    def causes(self) -> tuple[tuple[Channel, Cause], ...]:
        """Every cause with its channel, the largest first."""
        pairs = [(channel, cause) for channel in self.channels for cause in channel.attribution.causes]
        return tuple(sorted(pairs, key=lambda pair: -pair[1].gain))

    def to_json(self) -> dict[str, Any]:
        """Return the diagnosis in the form of its schema."""
        return {
            "verdict": self.verdict,
            "robot": self.description.name,
            "gap": self._gap(),
            "locations": [location.to_json() for location in self.locations],
            "causes": [self._cause(channel, cause) for channel, cause in self.causes],
            "not_testable": [{"effect": one.effect, "why": one.why} for one in self.untestable],
            "shrink": self._shrink(),
            "next_experiment": self.experiment,
        }

    def _gap(self) -> dict[str, Any]:
        gap: dict[str, Any] = {"energy_error_percent": self.energies.mean[0] if self.energies else None}
        for channel in self.channels:
            numbers = [
                {
                    "rmse": float(rmse),
                    "noise_floor": None if channel.floor is None else float(channel.floor[k]),
                    "excess": None if channel.excess is None else float(channel.excess[k]),
                }
                for k, rmse in enumerate(channel.rmse)
            ]
            gap[channel.name] = (
                dict(zip(self.description.joint_names, numbers, strict=True))
                if channel.name == "torque"
                else numbers[0]
            )
        return gap

    def _cause(self, channel: Channel, cause: Cause) -> dict[str, Any]:
        return {
            "effect": cause.effect,
            "joints": list(cause.joints),
            "scope": cause.scope,
            "confidence": confidence(cause.gain, _LEAST, cause.t, len(cause.rivals)),
            "parameters": _parameters(self.description, channel, cause),
            "indistinguishable_from": list(cause.rivals),
            "evidence": {
                "channel": channel.name,
                "gain_on_groups_left_out": cause.gain,
                "t_between_groups": cause.t,
                "p_adjusted_for_the_catalogue": cause.p,
                "gain_of_rivals": cause.rival_gains,
            },
        }

    def _shrink(self) -> dict[str, Any]:
        shrink: dict[str, Any] = {
            "held_out_runs": list(self.runs),
            "noise_floor_from": self.floor.source,
            "torque_rmse": None,
            "power_rmse": None,
            "energy_error_percent": None,
            "closed_fraction": None,
            "by_cause": [],
        }
        parts = []
        for channel in self.channels:
            judged, floor = channel.held_out, channel.floor
            rows = judged.rows.sum()
            shrink[f"{channel.name}_rmse"] = {
                "before": float(np.sqrt(judged.before.sum() / rows)),
                "after": float(np.sqrt(judged.after.sum() / rows)),
                "noise_floor": None if floor is None else float(np.sqrt(np.mean(floor**2))),
                "interval95_after": pooled_interval(judged.after, judged.rows, self.seed),
            }
            if floor is not None and channel.attribution.causes:
                parts.append((judged, floor))
            shrink["by_cause"] += [_by_cause(channel, cause) for cause in channel.attribution.causes]
        if self.energies:
            shrink["energy_error_percent"] = self.energies.to_json(self.seed)
        closed = closed_fraction(parts, self.seed) if parts else None
        if closed:
            shrink["closed_fraction"] = {"value": closed[0], "interval95": closed[1]}
        return shrink


def diagnose(
    data_set: DataSet,
    *,
    withhold: Sequence[str] = (),
    seed: int = 0,
    progress: Progress | None = None,
) -> Diagnosis:
    """Diagnose the gap between a robot's twin and its runs.

    `withhold` takes effects out of the twin and leaves them in the catalogue; `progress` is told each step. Raises
    InputError on an effect that the catalogue lacks or the twin has not, where no run is to be judged, where no joint
    moves, and where neither torque nor power was measured.
    """
    tell = progress or (lambda line: None)
    effects = _effects(data_set, withhold)
    tell(f"Filtering {len(data_set.runs)} runs")
    cutoff = choose_cutoff(data_set.runs)
    motions = {run.name: condition(run, data_set.robot, cutoff) for run in data_set.runs}
    given = dict(motions)
    data_set, motions = _torque_from_current(data_set, motions)
    _check(data_set, motions)
    robot = data_set.robot
    floor = noise_floor(data_set.runs, motions)
    observed = frozenset(run.name for run in data_set.runs if run.role == "observed")
    grouping = Grouping(_labels(data_set.runs), observed)
    stack = Stack(robot, effects)
    known = catalogue()
    channels: list[Channel] = []
    energies: EnergyErrors | None = None
    predicted: Torque | None = None
    with_torque = [motion for motion in motions.values() if motion.torque is not None]
    if with_torque:
        tell("Fitting the twin")
        plain = torque_system(stack, with_torque, grouping, (), None)
        predicted = _prediction(stack, plain)
        tried = _variants(robot, known.values(), "torque")
        tell("Trying every effect on torque")
        system = torque_system(stack, with_torque, grouping, tried, predicted)
        channels.append(_channel("torque", system, floor.torque, effects, seed))
    with_power = [motion for motion in motions.values() if motion.power is not None]
    if with_power and predicted is not None:
        tell("Trying every effect on power")
        torque = _Explained(stack, channels[0], predicted)
        power_of = _power(stack, with_power, grouping, torque)
        tried = _variants(robot, known.values(), "power")
        system = power_system(stack, with_power, grouping, tried, torque, power_of)
        power_floor = None if floor.power is None else np.array([floor.power])
        channels.append(_channel("power", system, power_floor, effects, seed))
        energies = _energies(channels[-1], with_power)
    verdict = _verdict(channels, floor)
    tell("Identifying the twin with its causes")
    twin = _twin(data_set.robot, given, observed, effects, channels)
    lacking = untestable(known.values(), effects, [(c.name, c.attribution) for c in channels], motions.values())
    seen = [motion for run, motion in motions.items() if run in observed]
    locations, evidence = _where(channels, stack, seen, predicted)
    rivals = [(cause.effect, cause.joints, cause.rivals) for c in channels for cause in c.attribution.causes]
    return Diagnosis(
        description=robot,
        verdict=verdict,
        channels=tuple(channels),
        floor=floor,
        locations=tuple(locations if verdict != NO_GAP else ()),
        untestable=tuple(lacking),
        runs=tuple(sorted(observed)),
        seed=seed,
        experiment=next_experiment(rivals, [one.effect for one in lacking]),
        evidence=evidence,
        twin=twin,
        energies=energies,
    )


def _effects(data_set: DataSet, withhold: Sequence[str]) -> tuple[str, ...]:
    effects = data_set.effects or BASELINE
    Stack(data_set.robot, effects)
    known = catalogue()
    for effect in withhold:
        if effect not in known:
            raise InputError(f"--withhold {effect}: there is no such effect; use some of {', '.join(known)}")
        if effect not in effects:
            raise InputError(f"--withhold {effect}: the twin does not have it; it has {', '.join(effects)}")
        if effect == "rigid_body":
            raise InputError("--withhold rigid_body: a twin without bodies explains nothing; withhold another effect")
    return tuple(effect for effect in effects if effect not in withhold)


def _torque_from_current(data_set: DataSet, motions: dict[str, Motion]) -> tuple[DataSet, dict[str, Motion]]:
    """Where there is no torque but current and power: let their balance tell the torque constants."""
    if any(motion.torque is not None for motion in motions.values()):
        return data_set, motions
    telling = [motion for motion in motions.values() if motion.current is not None and motion.power is not None]
    if not telling:
        return data_set, motions
    constants = torque_constants(data_set.robot, telling).constants
    joints = tuple(
        replace(joint, torque_constant=float(value))
        for joint, value in zip(data_set.robot.joints, constants, strict=True)
    )
    found = {
        name: motion if motion.current is None else replace(motion, torque=motion.current * constants)
        for name, motion in motions.items()
    }
    return replace(data_set, robot=replace(data_set.robot, joints=joints)), found


def _check(data_set: DataSet, motions: dict[str, Motion]) -> None:
    file = data_set.folder / "dataset.toml"
    if not any(run.role == "observed" for run in data_set.runs):
        raise InputError(f'{file}: no run has role = "observed"; mark those whose gap is to be diagnosed')
    if not any(motion.torque is not None for motion in motions.values()):
        if any(motion.power is not None for motion in motions.values()):
            raise InputError(f"{file}: power alone was measured; log tau_ or i_ too, so that a gap can be placed")
        raise InputError(f"{file}: neither torque nor power was measured in any run; log tau_, i_ or power")
    if not any(np.any(np.abs(motion.dq) > 1e-3) for motion in motions.values()):
        raise InputError(f"{file}: no joint moves in any run; log runs in motion")


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


def _variants(robot: Robot, effects: Iterable[Effect], signal: str) -> list[Effect]:
    """Return every effect that shows in a signal, in every shape that is to be tried."""
    return [
        shape
        for effect in effects
        if effect.signal == signal and effect.id != "rigid_body"
        for shape in effect.candidates(robot)
    ]


def _prediction(stack: Stack, system: System) -> Torque:
    """Return the twin's joint torque for a run, fitted without that run's group."""
    noise = np.maximum(system.residual_rms((), np.ones(len(system.pattern))), 1e-9)
    moments = system.moments(noise)
    total = np.sum(moments, axis=0)
    by_run: dict[str, np.ndarray] = {}
    for run in {block.run for block in system.blocks}:
        groups = {int(g) for g, block in zip(system.group, system.blocks, strict=True) if block.run == run}
        rest = total - moments[groups.pop()] if len(groups) == 1 and system.groups > 1 else total
        by_run[run] = _values(system, system.solution((), rest))
    whole = _values(system, system.solution((), total))

    def predicted(motion: Motion) -> np.ndarray:
        return stack.real_torque(motion, by_run.get(motion.run, whole))

    return predicted


def _power(stack: Stack, motions: Sequence[Motion], grouping: Grouping, torque: Torque) -> PowerOf:
    """Return the power that the twin predicts for a run, (N,) W, and the part that its axes take."""

    def none(motion: Motion, torque: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return np.zeros(len(torque)), np.zeros(len(torque))

    system = power_system(stack, motions, grouping, (), torque, none)
    noise = np.maximum(system.residual_rms((), np.ones(1)), 1e-9)
    values = np.array([term.expected for _, term in stack.power_terms])
    values[~stack.fixed] = _values(system, system.solution((), np.sum(system.moments(noise), axis=0)))
    standing = np.array([effect.id == "standby_power" for effect, _ in stack.power_terms], dtype=bool)

    def power_of(motion: Motion, torque: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        columns = stack.power_columns(motion, torque)
        return columns @ values, columns @ np.where(standing, 0.0, values)

    return power_of


class _Explained:
    """The joint torque of the twin refitted with the causes, and what each cause adds to the torque."""

    def __init__(self, stack: Stack, channel: Channel, predicted: Torque):
        self._stack, self._channel, self._predicted = stack, channel, predicted
        causes = channel.attribution.causes
        self._places = {k: place for place, k in enumerate(_used(channel.system, causes))}
        self._held: tuple[str, np.ndarray] | None = None

    def __call__(self, motion: Motion) -> np.ndarray:
        """Return the real joint torque, (N, n) N m, of a run or a part of one."""
        whole = motion.whole or motion
        if self._held is None or self._held[0] != whole.run:
            torque = self._stack.real_torque(whole, self.values)
            for cause in self._channel.attribution.causes:
                torque = torque + self.added(cause, whole, real=True)
            self._held = whole.run, torque
        return self._held[1][motion.start : motion.start + len(motion.time)]

    @property
    def values(self) -> np.ndarray:
        """(K,) the twin's coefficients."""
        return self._channel.estimate.values[: self._channel.system.base]

    def added(self, cause: Cause, whole: Motion, *, real: bool = False) -> np.ndarray:
        """Return what a cause adds to the torque over a whole run, (N, n) N m; `real` torque alone or all of it."""
        system, robot = self._channel.system, self._stack.robot
        below = Predicted(self._predicted(whole))
        total = np.zeros(whole.dq.shape)
        for variant in cause.variants:
            if real and variant.effect.channel != "torque":
                continue
            columns = variant.effect.columns(robot, whole, below)
            for k in variant.columns:
                if k < system.changed or _observed(system, whole.run):
                    source = k - len(system.columns) if k >= system.changed else k
                    own = columns[:, :, system.columns[source - system.base].index or 0]
                    total += own * self._channel.estimate.values[self._places[k]]
        return total


def _observed(system: System, run: str) -> bool:
    return any(block.run == run and seen for block, seen in zip(system.blocks, system.observed, strict=True))


def _values(system: System, vector: np.ndarray) -> np.ndarray:
    return np.asarray(system.expected + vector[: system.base] * system.scale[: system.base])


def _channel(name: str, system: System, floor: np.ndarray | None, effects: Sequence[str], seed: int) -> Channel:
    power = name == "power"
    candidates: list[Hypothesis] = hypotheses(system.columns, system.base, MISSING, whole=power, inside=effects)
    if system.both:
        candidates += hypotheses(system.columns, system.changed, CHANGED, whole=power)
    found = attribute(system, candidates, seed)
    noise = np.maximum(system.residual_rms((), np.ones(len(system.pattern))), 1e-9)
    chosen = [k for cause in found.causes for k in cause.columns]
    judged = held_out(system, noise, found.noise, chosen)
    return Channel(name, system, found, judged, floor, _estimate(system, found.causes))


def _energies(channel: Channel, motions: Sequence[Motion]) -> EnergyErrors:
    """Return the energy errors on groups left out: the sum of the residual is its product with a column of ones."""
    system, found = channel.system, channel.attribution
    ones = next(k for k, column in enumerate(system.columns) if column.effect.id == "standby_power") + system.base
    mean = {m.run: float(np.mean(m.power)) for m in motions if m.power is not None}
    chosen = [k for cause in found.causes for k in cause.columns]
    errors = []
    for columns, noise in (((), channel.rmse), (chosen, found.noise)):
        moments = system.moments(noise)
        total = np.sum(moments, axis=0)
        part = []
        for group in np.flatnonzero(system.group_observed):
            vector = system.solution(columns, total - moments[group])
            residual, energy = 0.0, 0.0
            for block in np.flatnonzero(system.group == group):
                factor, used = system.factor(int(block), 0)
                left = factor @ np.append(-vector[used], 1.0)
                residual += float(factor[:, int(np.flatnonzero(used == ones)[0])] @ left) / system.scale[ones]
                energy += mean[system.blocks[block].run] * float(system.blocks[block].rows[0])
            part.append(100 * abs(residual) / max(abs(energy), 1e-9))
        errors.append(np.array(part))
    return EnergyErrors(*errors)


def _twin(
    robot: Robot,
    motions: Mapping[str, Motion],
    observed: frozenset[str],
    effects: Sequence[str],
    channels: Sequence[Channel],
) -> Twin:
    """Return the twin with the causes added; where some effect changed, fitted to the observed runs alone.

    A changed effect that the twin has needs no second one; a load at the flange is one with the last body.
    """
    causes = [cause for channel in channels for cause in channel.attribution.causes]
    added: list[Effect] = []
    for cause in causes:
        if cause.effect in effects or (cause.effect == "payload" and cause.scope == CHANGED):
            continue
        for variant in cause.variants:
            joint = variant.terms[0].joint if cause.joints else None
            effect = variant.effect if joint is None or cause.effect == "joint_coupling" else variant.effect.on(joint)
            if not any(one.id == effect.id and one.joints == effect.joints for one in added):
                added.append(effect)
    changed = any(cause.scope == CHANGED for cause in causes)
    used = [motion for run, motion in motions.items() if run in observed or not changed]
    return identify(robot, used, [*effects, *added])


def _used(system: System, causes: Sequence[Cause]) -> list[int]:
    return [*range(system.base), *(k for cause in causes for k in cause.columns)]


def _estimate(system: System, causes: Sequence[Cause]) -> Estimate:
    """Estimate the twin's terms and the causes' together, with bounds and intervals."""
    used = _used(system, causes)
    terms = [system.all_terms[k] for k in used]
    pattern = np.zeros((len(system.pattern), len(used)), dtype=bool)
    source = [k - len(system.columns) if k >= system.changed else k for k in used]
    pattern[:] = system.pattern[:, source]
    blocks = []
    for block, observed in zip(system.blocks, system.observed, strict=True):
        factors = []
        for equation, factor in enumerate(block.factors):
            place = {int(k): p for p, k in enumerate(np.flatnonzero(system.pattern[equation]))}
            parts = [
                factor[:, place[s]] * (observed or k < system.changed)
                for k, s in zip(used, source, strict=True)
                if s in place
            ]
            factors.append(np.column_stack([*parts, factor[:, -1]]))
        blocks.append(replace(block, factors=tuple(factors)))
    return estimate(blocks, pattern, terms)


def _parameters(robot: Robot, channel: Channel, cause: Cause) -> list[dict[str, Any]]:
    system, found = channel.system, channel.estimate
    used = _used(system, channel.attribution.causes)
    known = {
        (effect.id, term.joint, term.name): float(found.values[k])
        for k, (effect, term) in enumerate(system.terms)
        if term.link is None
    }
    parameters: list[dict[str, Any]] = []
    for variant in cause.variants:
        places = [used.index(k) for k in variant.columns]
        joint = variant.terms[0].joint if variant.terms[0].link is None and len(variant.terms) else None
        effect = variant.effect
        if joint is not None and len(cause.joints) > 0:
            effect = effect.on(joint)
        if len(effect.terms(robot)) == len(places):
            covariance = found.covariance[np.ix_(places, places)]
            quantities = effect.parameters(robot, found.values[places], covariance, known)
            parameters += [_quantity(one) for one in quantities if np.isfinite(one.value)]
        else:
            parameters += [_coefficient(variant.terms[k], found, place) for k, place in enumerate(places)]
    return parameters


def _quantity(one: Quantity) -> dict[str, Any]:
    ends = None if one.lower is None or one.upper is None else [one.lower, one.upper]
    return {"name": one.name, "joint": one.joint, "value": one.value, "unit": one.unit, "interval95": ends}


def _coefficient(term: Term, found: Estimate, place: int) -> dict[str, Any]:
    value, half = float(found.values[place]), 1.96 * float(np.sqrt(max(found.covariance[place, place], 0.0)))
    ends = [value - half, value + half]
    return {"name": term.name, "joint": term.joint, "value": value, "unit": term.unit, "interval95": ends}


def _by_cause(channel: Channel, cause: Cause) -> dict[str, Any]:
    system, found = channel.system, channel.attribution
    noise = np.maximum(system.residual_rms((), np.ones(len(system.pattern))), 1e-9)
    alone = held_out(system, noise, noise, cause.columns)
    others = [k for other in found.causes if other is not cause for k in other.columns]
    without = held_out(system, noise, found.noise, others)
    return {
        "effect": cause.effect,
        "scope": cause.scope,
        "channel": channel.name,
        "rmse_before": [float(value) for value in alone.rmse(alone.before)],
        "rmse_alone": [float(value) for value in alone.rmse(alone.after)],
        "rmse_when_left_out": [float(value) for value in without.rmse(without.after)],
        "rmse_with_all": [float(value) for value in channel.held_out.rmse(channel.held_out.after)],
    }


def _verdict(channels: Sequence[Channel], floor: Floor) -> str:
    causes = [cause for channel in channels for cause in channel.attribution.causes]
    if causes:
        return AMBIGUOUS if causes and any(cause.rivals for cause in causes) else ATTRIBUTED
    return UNEXPLAINED if any(_above(channel, floor) for channel in channels) else NO_GAP


def _above(channel: Channel, floor: Floor) -> bool:
    """Return whether a gap is there: above a floor from repeats, and above what the reference runs show, if any."""
    if channel.floor is None or floor.source != "repeats":
        return False
    system, judged = channel.system, channel.held_out
    level = channel.floor
    if system.both:
        groups = np.flatnonzero(~system.group_observed)
        vector = system.solution((), np.sum(system.moments(channel.rmse), axis=0))
        squares = np.sum([system.squares(vector, int(group)) for group in groups], axis=0)
        level = np.maximum(level, np.sqrt(squares / np.maximum(system.rows[groups].sum(axis=0), 1)))
    above = judged.before / np.maximum(judged.rows, 1) / level**2 - 1 > _EXCESS
    return bool(np.any(above.mean(axis=0) >= _STEADY))


def _where(
    channels: Sequence[Channel], stack: Stack, motions: Sequence[Motion], predicted: Torque | None
) -> tuple[list[Location], dict[str, Any]]:
    """Return the ranked locations of the gap, and the arrays that a page draws; motions are the observed ones."""
    joints = stack.robot.joint_names
    locations: list[Location] = []
    evidence: dict[str, Any] = {"follows": [], "runs": [line for c in channels for line in _per_run(c, joints)]}
    for channel in channels:
        if channel.name == "power":
            shares = locate_power(channel.held_out.before, channel.held_out.rows, channel.floor, _names(channel))
            locations.extend(shares)
            continue
        assert predicted is not None
        noise = channel.rmse if channel.floor is None else channel.floor
        total = np.sum(channel.system.moments(channel.rmse), axis=0)
        plain = _values(channel.system, channel.system.solution((), total))
        judged = [motion for motion in motions if motion.torque is not None]
        residuals = [(motion, _residual(stack, motion, plain)) for motion in judged]
        locations.extend(locate(joints, residuals, noise))
        evidence["heat_map"] = heat_map(joints, residuals, noise)
        explained = _Explained(stack, channel, predicted)
        for cause in channel.attribution.causes:
            added = [explained.added(cause, motion) for motion in judged]
            partial = []
            for motion, own in zip(judged, added, strict=True):
                others = [c for c in channel.attribution.causes if c is not cause]
                rest = np.sum([explained.added(c, motion) for c in others], axis=0) if others else 0.0
                partial.append((motion, _residual(stack, motion, explained.values) - rest))
                del own
            evidence["follows"] += curves(cause.effect, cause.joints or joints, joints, partial, added)
    return sorted(locations, key=lambda location: -location.share), evidence


def _names(channel: Channel) -> list[tuple[str, ...]]:
    """Return the runs of each observed group."""
    system = channel.system
    return [
        tuple(dict.fromkeys(system.blocks[k].run for k in np.flatnonzero(system.group == group)))
        for group in np.flatnonzero(system.group_observed)
    ]


def _per_run(channel: Channel, joints: Sequence[str]) -> list[dict[str, Any]]:
    judged = channel.held_out
    lines = []
    for group, runs in enumerate(_names(channel)):
        for k in range(judged.rows.shape[1]):
            rows = max(float(judged.rows[group, k]), 1.0)
            lines += [
                {
                    "run": run,
                    "joint": joints[k] if channel.name == "torque" else None,
                    "before": float(np.sqrt(judged.before[group, k] / rows)),
                    "after": float(np.sqrt(judged.after[group, k] / rows)),
                    "floor": None if channel.floor is None else float(channel.floor[k]),
                }
                for run in runs
            ]
    return lines


def _residual(stack: Stack, motion: Motion, values: np.ndarray) -> np.ndarray:
    assert motion.torque is not None
    shift = stack.shift(motion)
    parts = [stack.torque_columns(piece) @ (values + shift) for piece in motion.pieces(8192)]
    residual = motion.torque - np.concatenate(parts)
    return np.where(stack.undecided(motion), np.nan, residual)
