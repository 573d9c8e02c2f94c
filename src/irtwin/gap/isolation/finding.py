"""The finding: what one channel, torque or power, shows of the gap."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy

from irtwin.effects.catalogue import catalogue
from irtwin.effects.effect import Coefficients, Quantity, Term, quantity
from irtwin.gap.data.case import Case
from irtwin.gap.isolation.apart import Apart, closed_squares, shares
from irtwin.gap.isolation.both_channels import BothChannels, acting, observed_groups
from irtwin.gap.isolation.cause import FoundCause
from irtwin.gap.isolation.closing import Closing, closing, share_above
from irtwin.gap.isolation.detectability import can_show
from irtwin.gap.isolation.shape_interval import with_shape
from irtwin.gap.isolation.shortlist import NO_SEARCH, Shortlist
from irtwin.gap.isolation.steadied import Steadied
from irtwin.gap.isolation.structure_search import Attribution, Without, attribute
from irtwin.gap.regression.held_out import HeldOut, held_out
from irtwin.gap.regression.hypotheses import CHANGED, MISSING, Hypothesis, hypotheses, place_of
from irtwin.gap.regression.joint_equations import JointEquations
from irtwin.gap.regression.normal_equations import System, observed_rms, reference_rms
from irtwin.gap.regression.run_to_run import with_offsets_held
from irtwin.identification.estimators import Estimate, estimate
from irtwin.identification.progress import tell_step
from irtwin.robot.description import Robot

_NO_NOISE = 1e-9


@dataclass(frozen=True)
class ChannelFinding:
    """What was found in one channel, `name`: "torque" (g equations, one per joint) or "power" (g = 1).

    `places`: each equation's joint, None for the whole robot; `observed`: the runs to be diagnosed; `steadied`: the
    `system` without what differs from run to run, of which `apart` and `estimate` are; `held_out`: what is left of
    groups left out, `counted` the same as `apart` counts it; `signal_floor` (g,) N m or W, of the measured signal, None
    where unknown; `estimate`: the twin's terms and the causes' columns, fitted together; `part`: of all that is closed
    theirs, beside what does not repeat; `plain`: power's equation on the torque of the twin as it is, where `system`
    stands on torque that causes explain; `both`: what causes of torque close of both channels,
    where both were searched.
    """

    name: str
    places: tuple[str | None, ...]
    observed: frozenset[str]
    system: System
    steadied: Steadied
    attribution: Attribution
    apart: Apart
    held_out: HeldOut
    counted: HeldOut
    signal_floor: np.ndarray | None
    estimate: Estimate
    part: float = 1.0
    plain: System | None = None
    both: BothChannels | None = None

    @cached_property
    def floor(self) -> np.ndarray | None:
        """(g,) the noise floor, RMS."""
        return self.steadied.floor(self.signal_floor)

    @cached_property
    def floor_within(self) -> np.ndarray | None:
        """(g,) the same within a run, where no dry friction turns."""
        return self.steadied.within(self.signal_floor)

    @cached_property
    def closed_squares(self) -> np.ndarray:
        """(C, G, g) what each cause closes of the squares of each group left out and equation."""
        return closed_squares(self.apart)

    @property
    def causes(self) -> tuple[FoundCause, ...]:
        """The channel's causes, ranked."""
        return self.attribution.causes

    @cached_property
    def shares(self) -> tuple[float, ...]:
        """Each cause's part of what they close together, none where they close nothing."""
        level = self.attribution.noise if self.floor_within is None else self.floor_within
        own = shares(self.closed_squares, self.counted.rows, level)
        return tuple(self.part * share for share in own)

    def share(self, cause: FoundCause) -> float | None:
        """Return a cause's part of what all close together, None where they close nothing."""
        return self.shares[self.causes.index(cause)] if self.shares else None

    def closing(self, causes: Sequence[FoundCause]) -> Closing:
        """Return what some causes close of the channel's gap, beside the others.

        What the twin's own terms imitate in torque closes nothing there; where both channels show it, both count.
        """
        places = [self.causes.index(cause) for cause in causes]
        closed, where = self.closed_squares[places].sum(axis=0), acting(causes, self.groups)
        own = closing(closed, where, self.counted, self.floor_within, self.attribution.noise)
        if self.both is None or own.interval[0] > 0:
            return own
        of_both = self.both.closing(places, causes)
        return of_both if of_both.interval[0] > 0 else own

    def closed_between(self, causes: Sequence[FoundCause]) -> tuple[float, tuple[float, float]] | None:
        """Return which share some causes close of what sets the other runs apart, with its 95 % interval.

        That is the gap above what the twin, fitted to the other runs alone, leaves of these, too. None where none is.
        """
        if self.floor_within is None:
            return None
        closed = self.closed_squares[[self.causes.index(cause) for cause in causes]].sum(axis=0)
        return share_above(closed, self.counted, self.apart.level(self.floor_within))

    @cached_property
    def floor_between(self) -> np.ndarray | None:
        """(g,) RMS that sets no runs apart: the floor, or what the twin leaves of the other runs alone, if more."""
        before = self.before
        if self.floor is None or not before.both:
            return self.floor
        return np.asarray(np.maximum(self.floor, reference_rms(before, before.noise_before)))

    @property
    def chosen(self) -> list[int]:
        """The indices of the causes' columns."""
        return [k for cause in self.causes for k in cause.columns]

    @property
    def used(self) -> list[int]:
        """The indices of the columns in the estimate."""
        return [*range(self.system.base), *self.chosen]

    @property
    def rmse(self) -> np.ndarray:
        """(g,) before anything is added, on groups left out."""
        return self.held_out.rmse(self.held_out.before)

    @property
    def excess(self) -> np.ndarray | None:
        """(g,) mean square over the floor's, less one."""
        return None if self.floor is None else np.asarray(self.rmse**2 / self.floor**2 - 1)

    @property
    def before(self) -> System:
        """The equations of the twin as it is."""
        return self.plain or self.system

    @cached_property
    def fitted(self) -> tuple[np.ndarray, np.ndarray]:
        """(g,) RMS left in observed runs by fits to all runs: of the twin as it is, and with the causes."""
        before = self.before
        return (
            observed_rms(before, (), before.noise_before),
            observed_rms(self.system, self.chosen, self.attribution.noise),
        )

    def closed(self, cause: FoundCause) -> float:
        """Return the part of the mean square above the floor, where a cause acts, that all causes together close."""
        mine = [place in cause.joints or not cause.joints for place in self.places]
        before, after = (level[mine] ** 2 for level in self.fitted)
        floor = self.fitted[1][mine] ** 2 * _NO_NOISE if self.floor is None else self.floor[mine] ** 2
        above = float(np.sum(before / floor - 1))
        return float(np.clip(np.sum((before - after) / floor) / above, 0.0, 1.0)) if above > 0 else 0.0

    @property
    def groups(self) -> list[tuple[str, ...]]:
        """The runs of each observed group."""
        return observed_groups(self.system)


def find(
    name: str,
    case: Case,
    system: System,
    floor: np.ndarray | None,
    without: Set[Without] = frozenset(),
    plain: System | None = None,
    telling: System | None = None,
    before: Shortlist = NO_SEARCH,
) -> ChannelFinding:
    """Find the causes in the equations of a channel, "torque" or "power", `without` some effects; floor: (g,) RMS.

    `plain` as a finding's. `telling`: the same equations on what was logged, by which the causes are found. `before`:
    what was tried by a search before.
    """
    places = (None,) if name == "power" else case.robot.joint_names
    steadied = Steadied.of(case, system)
    if telling is None:
        attribution = attributed(case, system, steadied, floor, without, before)
    else:
        attribution = attributed(case, telling, Steadied.of(case, telling), floor, without, before)
        attribution = replace(attribution, noise=_left(system, attribution))
    return finding_of(name, places, case.observed, system, steadied, attribution, floor, plain)


def finding_of(
    name: str,
    places: tuple[str | None, ...],
    observed: frozenset[str],
    system: System,
    steadied: Steadied,
    attribution: Attribution,
    floor: np.ndarray | None,
    plain: System | None = None,
    beside: BesidePower | None = None,
) -> ChannelFinding:
    """Return the finding of an attribution: judged on groups left out, its coefficients estimated, `beside` power."""
    causes = attribution.causes
    chosen = [k for cause in causes for k in cause.columns]
    fitted = estimate_of(steadied.system, chosen) if beside is None else beside.estimate(chosen)
    system = with_offsets_held(system, chosen)
    steadied = replace(steadied, system=with_offsets_held(steadied.system, chosen))
    alone, inside = system.with_columns(chosen)
    judged = held_out(alone, (plain or alone).noise_before, attribution.noise, inside, plain)
    likely = [cause.likely for cause in causes]
    apart = Apart.of(plain or steadied.system, steadied.system, [cause.columns for cause in causes], likely)
    return ChannelFinding(
        name,
        places,
        observed,
        system,
        steadied,
        attribution,
        apart,
        judged,
        apart.held_out(),
        floor,
        fitted,
        plain=plain,
        both=None if beside is None else beside.closing(causes),
    )


def attributed(
    case: Case,
    system: System,
    steadied: Steadied,
    floor: np.ndarray | None,
    without: Set[Without] = frozenset(),
    before: Shortlist = NO_SEARCH,
) -> Attribution:
    """Attribute the gap of a system, `without` some effects; floor: (g,) RMS, 0 or None where unknown.

    The noise that is left is that of all runs together, with what differs from run to run.
    """
    tell_step("  rows in which joints are slow")
    candidates = _hypotheses(case, system)
    apart, level = steadied.system.by_speed, steadied.within(floor)
    if level is not None:
        level = np.tile(level, len(apart.halves))
    attribution = attribute(apart, candidates, case.thresholds.criterion, level, without, before)
    return replace(attribution, noise=_left(system, attribution))


def _left(system: System, attribution: Attribution) -> np.ndarray:
    """Return (g,) RMS that the causes leave of all rows."""
    alone, chosen = system.with_columns([k for cause in attribution.causes for k in cause.columns])
    return alone.residual_rms(chosen, alone.residual_rms(chosen, alone.noise_before))


def _inside(case: Case, system: System) -> Set[tuple[str, str | None]]:
    """Return what cannot be missing from the twin: an effect and its joint; joint None: anywhere."""
    if not system.both:
        return case.modelled
    # zero in the other runs where these did not measure it: there, missing is changed
    return case.modelled | {(effect.id, None) for effect in catalogue().values() if not can_show(effect, case.others)}


def _hypotheses(case: Case, system: System) -> list[Hypothesis]:
    """Return what may be missing or have changed; effects on power may act in every joint.

    What a simulator and the robot both have, and the twin lacks, is no difference between them.
    """
    candidates = []
    if not (system.both and case.against == "simulated"):
        candidates += hypotheses(system.columns, system.base, MISSING, inside=_inside(case, system))
    if system.both:
        candidates += hypotheses(system.columns, system.changed, CHANGED)
    return candidates


def quantities(robot: Robot, finding: ChannelFinding, cause: FoundCause) -> list[Quantity]:
    """Return a cause's parameters with 95 % intervals of the fit, those of one variant after the other."""
    return [
        parameter for number in range(len(cause.variants)) for parameter in of_variant(robot, finding, cause, number)
    ]


def of_variant(robot: Robot, finding: ChannelFinding, cause: FoundCause, number: int) -> list[Quantity]:
    """Return the parameters of one of a cause's variants, by its number."""
    estimate, used, variant = finding.estimate, finding.used, cause.variants[number]
    known = {
        (effect.id, term.joint, term.name): float(estimate.values[k])
        for k, (effect, term) in enumerate(finding.system.terms)
        if term.link is None
    }
    places = [used.index(k) for k in variant.columns]
    joint = place_of(variant.terms[0])
    effect = variant.effect.on(joint) if joint is not None and len(cause.joints) > 0 else variant.effect
    if len(effect.terms(robot)) != len(places):
        return [_coefficient(term, estimate, place) for term, place in zip(variant.terms, places, strict=True)]
    given = Coefficients(estimate.values[places], estimate.covariance[np.ix_(places, places)], known)
    stated = [parameter for parameter in effect.parameters(robot, given) if np.isfinite(parameter.value)]
    likely = cause.shapes[number] if cause.shapes else ()
    return with_shape(stated, robot, effect, likely, shared=not cause.joints)


def _coefficient(term: Term, estimate: Estimate, place: int) -> Quantity:
    deviation = float(np.sqrt(max(estimate.covariance[place, place], 0.0)))
    return quantity(term.name, term.joint, float(estimate.values[place]), term.unit, deviation)


def numbers_without(finding: ChannelFinding, told: Mapping[int, Term], others: Set[int]) -> list[Quantity]:
    """Return the coefficients of columns that are `told`, by index, fitted beside all causes' but `others`."""
    system, chosen = finding.system, [k for k in finding.chosen if k not in others]
    fitted, used = estimate_of(system, chosen), [*range(system.base), *chosen]
    return [_coefficient(term, fitted, used.index(k)) for k, term in told.items()]


@dataclass(frozen=True)
class Branch:
    """Causes of one family and scope in one channel, whose joints overlap, and what they close together."""

    family: str
    scope: str
    causes: tuple[FoundCause, ...]
    closing: Closing


def branches(finding: ChannelFinding) -> tuple[Branch, ...]:
    """Return the branches of a channel, that which closes most first; its causes are in that order too."""
    of_channel = [
        Branch(_family(causes[0]), causes[0].scope, _by_size(finding, causes), finding.closing(causes))
        for causes in joined(finding.causes)
    ]
    return tuple(sorted(of_channel, key=lambda branch: -branch.closing.size))


def joined(causes: Sequence[FoundCause]) -> list[list[FoundCause]]:
    """Return causes by family and scope, those with a joint in common together; of the whole robot, all."""
    together: list[list[FoundCause]] = []
    for cause in causes:
        near = [group for group in together if any(_near(cause, other) for other in group)]
        together = [group for group in together if group not in near]
        together.append([*(member for group in near for member in group), cause])
    return together


def _near(first: FoundCause, second: FoundCause) -> bool:
    if (_family(first), first.scope) != (_family(second), second.scope):
        return False
    return bool(set(first.joints) & set(second.joints)) or not (first.joints or second.joints)


def _family(cause: FoundCause) -> str:
    return cause.variants[0].effect.family


def _by_size(finding: ChannelFinding, causes: Sequence[FoundCause]) -> tuple[FoundCause, ...]:
    return tuple(sorted(causes, key=lambda cause: -finding.closing([cause]).size))


@dataclass(frozen=True)
class BesidePower:
    """Power beside torque: the `equations` of both, and what their search found of power.

    columns: those of the causes of power, of `equations.whole`; floor: (n + 1,) RMS, or None.
    """

    equations: JointEquations
    columns: tuple[int, ...]
    floor: np.ndarray | None

    def estimate(self, chosen: Sequence[int]) -> Estimate:
        """Estimate the twin's terms of torque and `chosen` columns, as torque's equations count them, by both."""
        whole, torque = self.equations.whole, self.equations.torque
        fitted = estimate_of(whole, self._columns(chosen))
        used = [*range(torque.base), *range(whole.base, whole.base + len(chosen))]
        return fitted.of(used, fitted.noise[: len(torque.pattern)])

    def closing(self, causes: Sequence[FoundCause]) -> BothChannels:
        """Return what causes of torque, in columns as torque's equations count them, close of both channels."""
        of_torque = [list(map(self.equations.in_whole, cause.columns)) for cause in causes]
        whole = with_offsets_held(self.equations.whole, [k for columns in of_torque for k in columns])
        likely = [*(cause.likely for cause in causes), True]
        return BothChannels(Apart.of(whole, whole, [*of_torque, self.columns], likely), self.floor)

    def _columns(self, chosen: Sequence[int]) -> list[int]:
        return [*map(self.equations.in_whole, chosen), *self.columns]


def estimate_of(system: System, chosen: Sequence[int]) -> Estimate:
    """Estimate the twin's terms and the causes' together, with bounds and intervals."""
    used = [*range(system.base), *chosen]
    terms = [system.all_terms[k] for k in used]
    source = [k - len(system.columns) if k >= system.changed else k for k in used]
    pattern = system.pattern[:, source]
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
    rows = None if system.prior_rows is None else scipy.linalg.block_diag(system.prior_rows, np.eye(len(chosen)))
    signals = [*[0] * (len(pattern) - 1), 1] if system.beside_power else None
    return estimate(blocks, pattern, terms, rows, signals)
