"""The search for causes, channel by channel: what a twin stands on, and which effects are likely beside it."""

from __future__ import annotations

from collections.abc import Callable, Sequence, Set
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from irtwin.effects.catalogue import catalogue
from irtwin.effects.effect import Effect
from irtwin.effects.friction import FrictionTurn
from irtwin.effects.sensing import TorqueLag
from irtwin.effects.stack import Stack
from irtwin.errors import InputError
from irtwin.gap.closed_twin import added
from irtwin.gap.data.case import Case
from irtwin.gap.data.noise_floor import OUT_OF_BAND, Floor, noise_floor
from irtwin.gap.data.same_robot import check_same_robot
from irtwin.gap.isolation.beside_power import SearchBesidePower
from irtwin.gap.isolation.detectability import can_show
from irtwin.gap.isolation.explained import Explained, ExplainedTorque, explained_power, floor_left
from irtwin.gap.isolation.finding import ChannelFinding, attributed, estimate_of, find
from irtwin.gap.isolation.refusal import NOTHING_REFUSED, Refusals, find_possible
from irtwin.gap.isolation.shortlist import NO_SEARCH, Shortlist, Tried
from irtwin.gap.isolation.steadied import Steadied
from irtwin.gap.isolation.structure_search import Without
from irtwin.gap.regression.candidate_columns import Below
from irtwin.gap.regression.channel_equations import power_system, torque_system, with_load
from irtwin.gap.regression.cross_fitted import LeftOut, TwinPower
from irtwin.gap.regression.normal_equations import System
from irtwin.gap.regression.run_to_run import share_of_offsets
from irtwin.gap.regression.torque_from_power import ThroughPower
from irtwin.identification.accumulate import part_read
from irtwin.identification.progress import tell

_LOOKS = 3  # at torque: in the last, dry friction turns and torque lags as the others found
_NUISANCES = frozenset({FrictionTurn.id, TorqueLag.id})


def check_observed(system: System) -> None:
    """Raise InputError where no sample of an observed run is left."""
    if not system.observed.any():
        raise InputError("in no observed run does a joint move for longer than the filter; log longer runs")


@dataclass(frozen=True)
class Search:
    """The search for the causes in a case: `unknown` are not known to it; what one before it `found` and `refused`.

    `shortlist`: what that one tried, and what of it is worth trying again.
    """

    case: Case
    unknown: Set[Without] = frozenset()
    found: tuple[Effect, ...] = ()
    refused: Refusals = NOTHING_REFUSED
    shortlist: Shortlist = NO_SEARCH

    @cached_property
    def stack(self) -> Stack:
        """The twin's effects, with what nobody states of how dry friction turns.

        Where runs are few, they are beside the offset of each, as far as runs of one side differ by it.
        """
        case = self.case
        known = [*case.effects, *self._mixtures()]
        if not (case.with_torque and case.run_offsets()):
            return case.stack.with_effects(known)
        free = case.stack.with_effects([*known, *case.run_offsets()])
        share = share_of_offsets(torque_system(free, case.with_torque, case.grouping, (), None), case.robot, case.sides)
        return case.stack.with_effects([*known, *case.run_offsets(share)])

    def _mixtures(self) -> list[Effect]:
        """Return how dry friction of the turning joints turns beside its one width, each a mixture of its own."""
        case = self.case
        if not (open_turns := case.turns(known=True)):
            return []
        stack = case.stack.with_effects([*case.effects, *self.found, *open_turns])
        values = estimate_of(torque_system(stack, case.with_torque, case.grouping, (), None), ()).values
        shares: dict[str, list[float]] = {}
        for (effect, term), value in zip(stack.torque_terms, values, strict=True):
            if effect in open_turns and term.joint:
                shares.setdefault(term.joint, []).append(float(value))
        return [FrictionTurn(tuple(own), joints=(joint,)) for joint, own in shares.items() if sum(own) > 0]

    @cached_property
    def plain(self) -> System | None:
        """The equations of torque of the twin alone; None where no torque is known."""
        case = self.case
        return torque_system(self.stack, case.with_torque, case.grouping, (), None) if case.with_torque else None

    @cached_property
    def floor(self) -> Floor:
        """The noise floor; from above the band, with friction that differs from run to run, which repeats show."""
        floor = noise_floor(self.case.runs, self.case.motions, self.case.thresholds.data)
        if floor.source != OUT_OF_BAND or floor.torque is None or self.plain is None:
            return floor
        return replace(floor, torque=np.hypot(floor.torque, np.sqrt(Steadied.of(self.case, self.plain).made)))

    @cached_property
    def twin(self) -> LeftOut | ThroughPower:
        """What the twin says of torque: fitted to torque without the run's group, or through power.

        Raises InputError where runs are of different robots.
        """
        if self.plain is None:
            return ThroughPower(self.stack, self.case.with_power)
        if self.case.shows("torque"):
            check_same_robot(self.case.runs, self.stack, self.plain, self.case.thresholds.data)
        return LeftOut(self.stack, self.plain)

    @property
    def power_stack(self) -> Stack:
        """The effects that explain power."""
        return self.twin if isinstance(self.twin, ThroughPower) else self.stack

    @cached_property
    def below(self) -> Below:
        """What candidates of torque stand on."""
        return with_load(self.case.robot, self.twin.below)

    @cached_property
    def before(self) -> TwinPower:
        """The power that the twin takes by its own torque."""
        return TwinPower(self.power_stack, self.case.with_power, self.case.grouping, self.twin.torque)

    def torque_causes(self, tried: Tried) -> tuple[ExplainedTorque, Floor, Refusals]:
        """Find the causes of torque, and the floor that they leave; where power was measured too, they explain both."""
        case, known = self.case, (self.unknown, self.refused)
        some = self.shortlist.among_both(tried)
        if case.shows("power"):
            about = self.below, self.twin.torque, self.before
            beside = SearchBesidePower(case, self.stack, some, *about, self.floor, self.shortlist)
            possible = find_possible(case, beside.proposed(self.unknown).find, *known)
        else:
            system, shortlist = self._torque_equations(some[0])
            possible = find_possible(case, lambda without: self._of_torque(system, without, shortlist), *known)
        finding, floor, refusals = possible
        return ExplainedTorque(self.stack, finding, self.below), floor, refusals

    def causes_of_torque(self, tried: Callable[[Search], Tried]) -> tuple[Search, ExplainedTorque, Floor, Refusals]:
        """Find the causes of torque, and with them the search that knows what is nobody's fault.

        Joints in which dry friction turns otherwise than the twin's have that in the twin, a lag of all torque is taken
        out, and every effect is tried anew, in the shapes that the data spoke for.
        """
        search = self
        for look in range(_LOOKS):
            torque, floor, refusals = search.torque_causes(tried(search))
            if not (known := search.knowing(torque.finding)):
                break
            last = _NUISANCES if look == _LOOKS - 2 else frozenset()
            search = replace(known, unknown=known.unknown | last, refused=refusals)
        return search, torque, floor, refusals

    def knowing(self, finding: ChannelFinding) -> Search | None:
        """Return the search that knows the nuisances of a finding, None where there are none."""
        causes = [cause for cause in finding.causes if not cause.nuisance]
        turning = {joint for cause in finding.causes if cause.nuisance for joint in cause.joints}
        lags = [cause for cause in finding.causes if cause.nuisance and not cause.joints]
        if not (turning or lags):
            return None
        case, unknown, reasons = self.case, self.unknown, []
        if turning:
            reasons.append(f"dry friction near zero speed of {', '.join(sorted(turning))} has a form of its own")
            case = replace(case, turning=case.turning | turning)
        for cause in lags:
            lag = float(finding.estimate.values[finding.used.index(cause.columns[0])])
            if lag <= case.longest_lag:
                reasons.append(f"it lags by {1e3 * lag:.2g} ms")
                case = case.without_lag(lag)
            else:
                reasons.append(f"it lags by {1e3 * lag:.2g} ms, more than filters make")
                unknown = unknown | {cause.effect}
        tell(f"Trying every effect on torque again, as {' and '.join(reasons)}")
        found = tuple(added(self.case, causes))
        case, shortlist = case.with_friction_near_zero(found), finding.attribution.shortlist
        return replace(self, case=case, unknown=unknown, found=found, shortlist=shortlist)

    def _torque_equations(self, tried: Sequence[Effect]) -> tuple[System, Shortlist]:
        """Return torque's equations with what is tried; of a long log a part proposes what is tried on all of it."""
        case, about = self.case, (self.stack, self.case.with_torque, self.case.grouping)
        every = part_read(case.with_torque)
        if every == 1 or self.shortlist.tried:
            return torque_system(*about, tried, self.below, case.shaken), self.shortlist
        part = torque_system(*about, tried, self.below, case.shaken, every)
        shortlist = attributed(case, part, Steadied.of(case, part), self.floor.torque, self.unknown).shortlist
        return torque_system(*about, shortlist.among(tried), self.below).with_noise_of(part), shortlist

    def _of_torque(self, system: System, without: Set[Without], before: Shortlist) -> tuple[ChannelFinding, Floor]:
        first = find("torque", self.case, system, self.floor.torque, without, before=before)
        explained = ExplainedTorque(self.stack, first, self.below)
        left = floor_left(self.case, self.floor, explained) if first.causes else self.floor
        return replace(first, signal_floor=left.torque), left

    def power_causes(
        self, tried: Sequence[Effect], floor: Floor, explained: ExplainedTorque | None, *, by_log: bool = True
    ) -> tuple[Explained, Refusals]:
        """Find the causes of power on the joint torque that is explained, None: on that of the twin.

        They are told `by_log`, on the logged torque: what the explained one misses is no cause of power. `floor`: what
        causes of torque leave.
        """
        case, torque = self.case, explained or self.twin.torque
        power_of = TwinPower(self.power_stack, case.with_power, case.grouping, torque) if explained else self.before
        system = power_system(self.power_stack, case.with_power, case.grouping, tried, torque, power_of)
        check_observed(system)
        level = None if floor.power is None else np.array([floor.power])
        plain = self.before.system if explained else None
        telling: System | None = None
        if explained is not None and by_log:
            about = self.power_stack, case.with_power, case.grouping
            telling = power_system(*about, tried, explained.logged, TwinPower(*about, explained.logged))

        def search(without: Set[Without]) -> tuple[ChannelFinding, Floor]:
            finding = find("power", case, system, level, without, plain, telling)
            of_power = explained_power(self.power_stack, finding, torque, power_of)
            left = floor_left(case, floor, of_power) if finding.causes else floor
            return replace(finding, signal_floor=None if left.power is None else np.array([left.power])), left

        finding, _, refusals = find_possible(case, search, self.unknown)
        return explained_power(self.power_stack, finding, torque, power_of), refusals


def variants(case: Case, signal: str) -> list[Effect]:
    """Return every effect that shows in a signal, in every shape that is to be tried.

    A robot keeps its bodies; those of a simulator are as drawn, and may be off.
    """
    bodies = any(run.role == "simulated" for run in case.runs)
    return [
        shape
        for effect in (*catalogue().values(), *case.turns(known=False), TorqueLag())
        if effect.signal == signal
        and not effect.disturbance
        and (bodies or not effect.bodies)
        and effect.has_what_it_alters(case.stack.ids)
        and can_show(effect, case.seen)
        for shape in (*effect.candidates(case.robot), *(effect.changes() if case.others else ()))
    ]
