"""Torque and power in one fit: what is real acts in both, what a sensor shows acts in torque alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.synthetic import arm, measure, swing, truth, with_constants, with_torque

from irtwin.effects.catalogue import BASELINE, catalogue
from irtwin.effects.effect import Effect
from irtwin.effects.stack import Stack
from irtwin.gap.data.case import Case
from irtwin.gap.data.noise_floor import Floor
from irtwin.gap.isolation.beside_power import SearchBesidePower
from irtwin.gap.isolation.finding import estimate_of, find
from irtwin.gap.isolation.posterior import HypothesisPrior, Posterior
from irtwin.gap.regression.channel_equations import Pairs, torque_system
from irtwin.gap.regression.cross_fitted import LeftOut, TwinPower
from irtwin.gap.regression.hypotheses import MISSING, hypotheses
from irtwin.gap.regression.joint_equations import JointEquations, joint_equations
from irtwin.gap.regression.projection import Projection
from irtwin.gap.search import Search
from irtwin.gap.thresholds import DEFAULT
from irtwin.signals.channels import Signals
from irtwin.signals.log import Run

ROBOT = with_constants(arm(2))
NOISE = 0.3
TRIED = ("asymmetric_friction", "torque_offset", "cable_drag", "torque_constant_error")
DRAWN = ("meter_gain", "iron_loss")
FLOOR = Floor(np.full(2, NOISE), NOISE, None)


def case(
    *, real: float = 0.0, shown: float = 0.0, changed: bool = False, gain: float = 1.0, cable: float = 0.0
) -> Case:
    """Runs in which a constant torque, N m, acts on joint 2 or is only shown there; `changed`: not in half of them.

    A cable pulls at joint 1, N m/rad.
    """
    motions, runs = {}, []
    for k in range(12 if changed else 6):
        observed = k < 6
        motion = replace(swing(ROBOT, k, seconds=5.0), run=f"run_{k}")
        plain = measure(ROBOT, motion, noise=NOISE, seed=k)
        more = np.zeros_like(motion.dq)
        more[:, 1] = real * observed
        more[:, 0] = cable * motion.q[:, 0]
        loaded = with_torque(ROBOT, plain, more)
        torque = loaded.torque + np.array([0.0, shown * observed])
        motions[motion.run] = replace(loaded, torque=torque, power=gain * loaded.power)
        signals = Signals(motion.time, motion.q)
        role = "observed" if observed else "reference"
        runs.append(Run(motion.run, motion.run, "", role, 0.0, (0.0, 0.0, 0.0), None, None, {}, signals))
    return Case(ROBOT, (*BASELINE, "copper_loss"), tuple(runs), motions, (ROBOT, motions), DEFAULT)


def searching(one: Case) -> SearchBesidePower:
    stack = Stack(ROBOT, one.effects)
    plain = LeftOut(stack, torque_system(stack, one.with_torque, one.grouping, (), None))
    tried, drawn = (
        [shape for name in some for shape in catalogue()[name].candidates(ROBOT)] for some in (TRIED, DRAWN)
    )
    before = TwinPower(stack, one.with_power, one.grouping, plain.torque)
    return SearchBesidePower(one, stack, (tried, drawn), plain.below, plain.torque, before, FLOOR)


def found(one: Case, *, power: bool = True):
    search = searching(one)
    if power:
        return search.find()[0]
    system = torque_system(search.stack, one.with_torque, one.grouping, search.effects[0], search.below)
    return find("torque", one, system, FLOOR.torque)


def names(finding) -> list[str]:
    return [f"{cause.effect} {cause.scope} {' '.join(cause.joints)}" for cause in finding.causes]


def pausing(held: float) -> Case:
    """Runs that stop for 1 s in 5: there joint 2 bears `held` N m of either sign more, as friction left it."""
    plain = case()
    motions = {}
    for k, (run, motion) in enumerate(plain.motions.items()):
        rests = (motion.time > 2.0) & (motion.time < 3.0)
        still = {name: np.where(rests[:, None], 0.0, getattr(motion, name)) for name in ("dq", "ddq")}
        stands = replace(swing(ROBOT, k, seconds=5.0), run=run, **still)
        stands = replace(stands, q=np.where(rests[:, None], motion.q[rests][0], motion.q))
        shown = with_torque(ROBOT, measure(ROBOT, stands, seed=k), np.outer(rests, [0.0, held * (-1) ** k]))
        noise = NOISE * np.random.default_rng(k).standard_normal((len(rests), 3))
        standing = np.repeat(rests[:, None], 2, axis=1)
        torque, power = shown.torque + noise[:, :2], shown.power + noise[:, 2]
        motions[run] = replace(shown, torque=torque, power=power, standing=standing)
    return replace(plain, motions=motions, given=(ROBOT, motions))


def test_power_at_rest_is_that_of_the_torque_which_friction_left_there():
    one = pausing(held=4.0)
    stack = Stack(ROBOT, one.effects)
    plain = LeftOut(stack, torque_system(stack, one.with_torque, one.grouping, (), None))
    before = TwinPower(stack, one.with_power, one.grouping, plain.torque)
    for motion in one.with_power:
        rests = motion.standing.all(axis=1)
        said = before(motion, plain.torque(motion))[0]
        assert np.sqrt(np.mean((motion.power - said)[rests] ** 2)) < 2 * NOISE
    assert names(found(one)) == []


def test_friction_that_an_offset_of_the_twin_imitates_costs_power():
    finding = found(case(real=3.0))
    assert names(finding) == ["asymmetric_friction missing joint_2"]
    terms = [(effect.id, term.joint) for effect, term in finding.system.terms]
    offset = finding.estimate.values[terms.index(("torque_offset", "joint_2"))]
    assert offset == pytest.approx(truth(ROBOT)["c"][1], abs=0.3)  # of the sensor alone


def test_a_search_without_what_was_refused_works_no_equation_out_anew(monkeypatch: pytest.MonkeyPatch):
    made = []

    def counted(*about):
        made.append(about)
        return joint_equations(*about)

    monkeypatch.setattr("irtwin.gap.isolation.beside_power.joint_equations", counted)
    search = searching(case(shown=3.0, changed=True))
    assert names(search.find()[0]) == ["torque_offset changed joint_2"]
    assert names(search.find({"torque_offset"})[0]) != ["torque_offset changed joint_2"]
    assert len(made) == 1


def test_the_estimate_stands_on_power_too():
    finding = found(case(real=3.0, cable=6.0))
    assert sorted(names(finding)) == ["asymmetric_friction missing joint_2", "cable_drag missing joint_1"]
    terms = [(effect.id, term.joint) for effect, term in finding.system.terms]
    place, true = terms.index(("torque_offset", "joint_2")), truth(ROBOT)["c"][1]
    alone = estimate_of(finding.system, finding.chosen).values[place]  # by torque alone
    assert abs(finding.estimate.values[place] - true) < abs(alone - true) / 2


@pytest.mark.parametrize(
    ("made", "of"),
    [({"real": 3.0}, "the gap of torque and power above the floor"), ({"cable": 6.0}, "the gap above the floor")],
)
def test_what_the_twin_imitates_in_torque_is_counted_in_torque_and_power(made, of):
    finding = found(case(**made))
    closing = finding.closing(finding.causes)
    assert closing.share_of == of
    assert closing.interval[0] > 0.5


def test_an_offset_of_a_sensor_costs_none():
    assert names(found(case(shown=3.0))) == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("made", "effect"), [({"real": 3.0}, "asymmetric_friction"), ({"shown": 3.0}, "torque_offset")]
)
def test_power_tells_what_torque_alone_cannot(made, effect):
    changed = case(**made, changed=True)
    beside = found(changed)
    assert names(beside) == [f"{effect} changed joint_2"]
    assert not beside.causes[0].not_told_from(0.1)
    alone = found(changed, power=False)
    assert {"asymmetric_friction", "torque_offset"} <= {alone.causes[0].effect, *alone.causes[0].rivals}


def test_a_meter_out_of_scale_is_no_torque():
    assert names(found(case(gain=1.1))) == []


def test_what_power_alone_tells_of_a_sensor_is_no_surer_than_power_is_explained():
    one, misfit = case(gain=1.1, cable=6.0), {"torque": 0.0025, "power": 0.04}
    stack = Stack(ROBOT, one.effects)
    plain = LeftOut(stack, torque_system(stack, one.with_torque, one.grouping, (), None))
    tried = [catalogue()[name] for name in ("cable_drag", "torque_constant_error")]
    before = TwinPower(stack, one.with_power, one.grouping, plain.torque)
    both = joint_equations(stack, one.measured, one.grouping, (tried, ()), plain.below, plain.torque, before)
    system = both.whole.by_speed
    named = hypotheses(system.columns, system.base, MISSING)
    noise = system.residual_rms((), np.ones(len(system.pattern)))
    projection = Projection(system, noise, [shape for each in named for shape in each.variants])
    by_equation = np.tile([misfit["torque"], misfit["torque"], misfit["power"]], 2)
    prior = HypothesisPrior.of(named)
    beside = Posterior.beside(projection, ((), ()), named, prior, DEFAULT.criterion, (by_equation, by_equation))
    many = replace(beside, evidence=replace(beside.evidence, rows=1e6 * beside.evidence.rows))  # all is misfit
    told = {(each.effect, each.joint): variance for each, variance in zip(named, many.variance, strict=True)}
    assert told["cable_drag", "joint_1"] < 2 * misfit["torque"]  # both tell that
    assert told["torque_constant_error", "joint_2"] > 5 * misfit["torque"]


def test_what_noise_of_positions_does_is_picked_of_more_columns() -> None:
    one, random = case(gain=1.1, cable=6.0), np.random.default_rng(0)
    stack = Stack(ROBOT, one.effects)
    plain = LeftOut(stack, torque_system(stack, one.with_torque, one.grouping, (), None))
    before = TwinPower(stack, one.with_power, one.grouping, plain.torque)
    shaken = [(m, replace(m, dq=m.dq + 1e-3 * random.standard_normal(m.dq.shape))) for m in one.measured[:2]]
    of_torque = [catalogue()[name] for name in ("torque_offset", "cable_drag", "viscous_friction", "joint_elasticity")]
    of_power = [catalogue()[name] for name in ("meter_gain", "iron_loss")]

    def both(*effects: list[Effect], pairs: Pairs = ()) -> JointEquations:
        about = plain.below, plain.torque, before, pairs
        return joint_equations(stack, one.measured, one.grouping, effects, *about)  # type: ignore[arg-type]

    of_all = both(of_torque, of_power, pairs=shaken)
    few = of_torque[1::2], of_power[1:]
    picked, worked_out = both(*few).with_noise_of(of_all), both(*few, pairs=shaken)
    for own, other in zip(picked.whole.shaken or (), worked_out.whole.shaken or (), strict=True):
        np.testing.assert_allclose(own, other, rtol=1e-6, atol=1e-9 * np.abs(other).max(initial=0.0))
    assert len(picked.whole.shaken or ()) == 2 * (len(ROBOT.joints) + 1)


@pytest.mark.parametrize("power", [True, False])
def test_a_part_of_a_long_log_proposes_what_all_of_it_decides(power: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    one = case(cable=6.0)
    if not power:
        alone = {run: replace(motion, power=None) for run, motion in one.motions.items()}
        one = replace(one, motions=alone, given=(ROBOT, alone))
    names_of = (*TRIED, "torque_ripple", "stribeck_friction")
    tried = [shape for name in names_of for shape in catalogue()[name].candidates(ROBOT)], []
    whole = Search(one).torque_causes(tried)[0].finding
    monkeypatch.setattr("irtwin.identification.accumulate._ENOUGH", 1000)
    by_part = Search(one).torque_causes(tried)[0].finding
    assert names(by_part) == names(whole) == ["cable_drag missing joint_1"]
    assert by_part.system.rows.sum() == whole.system.rows.sum()  # of all of the log
    assert len(by_part.system.columns) < len(whole.system.columns) / 2
    assert by_part.causes[0].log_odds == pytest.approx(whole.causes[0].log_odds, rel=0.15)
