"""Which causes are found, in systems whose columns and coefficients are known."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from irtwin.effects.catalogue import catalogue
from irtwin.effects.effect import Term
from irtwin.effects.friction import FrictionTurn
from irtwin.effects.transmission import TorqueRipple
from irtwin.gap.isolation.posterior import HypothesisPrior, Posterior
from irtwin.gap.isolation.structure_search import _Search, attribute, judged
from irtwin.gap.regression.evidence import Coefficients, HypothesisEvidence, evidence
from irtwin.gap.regression.hypotheses import CHANGED, MISSING, CandidateColumn, Hypothesis, Variant, hypotheses
from irtwin.gap.regression.normal_equations import System
from irtwin.gap.regression.projection import Projection
from irtwin.gap.thresholds import DEFAULT
from irtwin.identification.accumulate import Block, triangle

ROWS, RUNS = 300, 12
NOISE = 0.6
EFFECT = catalogue()["torque_drift"]
CONSTANT = (catalogue()["torque_offset"], Term("constant", "1"))


def block(run, *columns):
    """The rows of a run, (N,) or (N, k): the twin's terms, candidate columns, what was measured."""
    return Block(f"run_{run}", 0.0, 1.0, np.array([len(columns[-1])]), (triangle(np.column_stack(columns)),))


def equation(blocks, terms, columns, observed=slice(None)):
    """One equation of terms and columns; all runs are observed unless said which."""
    seen = np.zeros(len(blocks), dtype=bool)
    seen[observed] = True
    pattern = np.ones((1, len(terms) + len(columns)), dtype=bool)
    return System(tuple(terms), tuple(columns), pattern, tuple(blocks), np.arange(len(blocks)), seen)


def alone(effect, place, column, scope=MISSING, joint=None):
    """The hypothesis that an effect of one column, at a place, is there."""
    return Hypothesis(effect, joint, scope, (Variant(column.effect, (place,), (column.term,)),))


def system_of(mix, coefficients, size=10.0, silent=(), sparse=1):
    """Columns that are mixtures (rows of `mix`) of independent ones, and what `coefficients` of these add up to.

    In `silent` runs the first `sparse` of the independent ones are zero.
    """
    generator = np.random.default_rng(1)
    blocks = []
    for run in range(RUNS):
        independent = np.linalg.qr(generator.standard_normal((ROWS, len(coefficients))))[0] * np.sqrt(ROWS)
        independent[:, :sparse] *= run not in silent
        columns = size * independent @ np.array(mix).T
        measured = size * independent @ coefficients + generator.standard_normal(ROWS)
        blocks.append(block(run, np.ones(ROWS), columns, measured))
    columns = [CandidateColumn(EFFECT, k, Term(f"k{k}", "1")) for k in range(len(mix))]
    candidates = [alone(f"effect_{k}", 1 + k, column) for k, column in enumerate(columns)]
    return equation(blocks, [(EFFECT, Term("constant", "1"))], columns), candidates


def causes(system, candidates):
    return attribute(system, candidates, DEFAULT.criterion).causes


def found(mix, coefficients):
    return [cause.effect for cause in causes(*system_of(mix, coefficients))]


def changing(before, now, twin=()):
    """What is said of a drift of so many noises in the reference runs, and in the observed ones."""
    generator = np.random.default_rng(0)
    blocks = []
    for run in range(RUNS):
        column = generator.standard_normal((ROWS, 1))
        size = before if run < RUNS // 2 else now
        measured = size * column[:, 0] + generator.standard_normal(ROWS)
        blocks.append(block(run, column if twin else np.ones(ROWS), column, measured))
    column = CandidateColumn(EFFECT, 0, Term("k", "1"))
    system = equation(blocks, [twin or CONSTANT], [column], slice(RUNS // 2, None))
    scopes = [(CHANGED, system.changed)] if twin else [(MISSING, system.base), (CHANGED, system.changed)]
    candidates = [alone("torque_drift", place, column, scope) for scope, place in scopes]
    return [cause.scope for cause in causes(system, candidates)]


def test_what_is_there_is_found_and_nothing_else():
    assert found(np.eye(4), [0.0, 0.3, 0.0, 0.1]) == ["effect_1", "effect_3"]
    assert found(np.eye(4), np.zeros(4)) == []


def frictions(joint):
    """A joint with Coulomb and viscous friction, and two other forms of friction that together come near them."""
    generator, blocks = np.random.default_rng(3), []
    for run in range(RUNS):
        phase, fastest = 2 * np.pi * generator.random(), generator.uniform(0.3, 1.0)
        speed = fastest * np.sin(np.linspace(0, 20, ROWS) + phase)
        sign, size = np.sign(speed), np.abs(speed)
        columns = np.column_stack([sign, speed, sign * size**0.5, sign * np.exp(-size / 0.1)])
        measured = columns @ [3.0, 4.5, 0.0, 0.0] + NOISE * generator.standard_normal(ROWS)
        blocks.append(block(run, np.ones(ROWS), columns, measured))
    names = ("coulomb", "viscous", "nonlinear", "stribeck")
    columns = [CandidateColumn(EFFECT, k, Term(name, "N m", spread=5.0)) for k, name in enumerate(names)]
    candidates = [alone(column.term.name, 1 + k, column, joint=joint) for k, column in enumerate(columns)]
    return equation(blocks, [CONSTANT], columns), candidates


def test_two_effects_of_a_joint_are_found_though_another_explains_most_by_itself():
    found = attribute(*frictions("joint_1"), DEFAULT.criterion, np.array([NOISE]))
    assert {cause.effect for cause in found.causes} == {"coulomb", "viscous"}


def changed_frictions(joint):
    """A joint whose viscous friction changed, and whose dry friction turns more softly than its twin's in all runs."""
    generator, blocks = np.random.default_rng(3), []
    for run in range(RUNS):
        phase, fastest = 2 * np.pi * generator.random(), generator.uniform(0.3, 1.0)
        speed = fastest * np.sin(np.linspace(0, 20, ROWS) + phase)
        sign, softly = np.sign(speed), np.arctan(speed / 0.05) * 2 / np.pi
        columns = np.column_stack([sign, speed, sign * np.abs(speed) ** 0.5, softly - sign])
        measured = columns @ [10.0, 2.0 + 3.0 * (run >= RUNS // 2), 0.0, 2.0] + NOISE * generator.standard_normal(ROWS)
        blocks.append(block(run, np.ones(ROWS), sign, speed, columns, measured))
    effects = {"coulomb": EFFECT, "viscous": EFFECT, "nonlinear": EFFECT, "turn": FrictionTurn()}
    columns = [CandidateColumn(one, k, Term(name, "N m", spread=5.0)) for k, (name, one) in enumerate(effects.items())]
    known = [(EFFECT, Term(name, "N m", spread=5.0)) for name in ("constant", "dry", "viscous")]
    system = equation(blocks, known, columns, slice(RUNS // 2, None))
    *changes, turn = columns
    candidates = [alone(one.term.name, system.changed + k, one, CHANGED, joint) for k, one in enumerate(changes)]
    return system, [*candidates, alone("turn", system.base + 3, turn, joint=joint)]


def test_a_change_and_a_nuisance_are_looked_for_together():
    system, candidates = changed_frictions("joint_1")
    search = _Search(system, candidates, HypothesisPrior.of(candidates), DEFAULT.criterion, np.array([NOISE]))
    wrong = [(one, one.variants[0]) for one in candidates if one.effect in ("coulomb", "nonlinear")]
    right, _ = search.paired(wrong, search.left(wrong, system.noise_before))
    assert {one.effect for one, _ in right} == {"viscous", "turn"}


def falling_with_speed(joint):
    """A joint whose dry friction falls with speed and turns softly: by a negative share the turn is like the fall."""
    generator, blocks = np.random.default_rng(4), []
    for run in range(RUNS):
        phase, fastest = 2 * np.pi * generator.random(), generator.uniform(0.3, 1.0)
        speed = fastest * np.sin(np.linspace(0, 20, ROWS) + phase)
        sign = np.sign(speed)
        columns = np.column_stack([sign * np.exp(-np.abs(speed) / 0.05), np.tanh(speed / 0.06) - sign])
        measured = sign * 10.0 + columns @ [8.0, 0.0] + NOISE * generator.standard_normal(ROWS)
        blocks.append(block(run, np.ones(ROWS), sign, columns, measured))
    columns = [
        CandidateColumn(EFFECT, 0, Term("stribeck", "N m", spread=5.0)),
        CandidateColumn(FrictionTurn(), 0, Term("turn", "N m", spread=5.0, lowest=0.0)),
    ]
    known = [(EFFECT, Term(name, "N m", spread=5.0)) for name in ("constant", "dry")]
    candidates = [alone(column.term.name, 2 + k, column, joint=joint) for k, column in enumerate(columns)]
    return equation(blocks, known, columns), candidates


def test_a_nuisance_below_its_bound_hides_nothing_that_it_imitates():
    system, (fall, turn) = falling_with_speed("joint_1")
    noise = np.array([NOISE])
    assert system.within_bounds([3], noise) == [] and system.within_bounds([2], noise) == [2]
    search = _Search(system, [fall, turn], HypothesisPrior.of([fall, turn]), DEFAULT.criterion, noise)
    both = [(each, each.variants[0]) for each in (fall, turn)]
    found, _ = search.pruned(both, search.left(both, noise))
    assert [each.effect for each, _ in found] == ["stribeck"]


def test_of_two_shapes_that_one_is_taken_which_leaves_less():
    mix = [[0.98, 0.2], [1.0, 0.0]]
    system, (near, true) = system_of(mix, [2.0, 0.0])
    one = Hypothesis("effect", None, MISSING, (*near.variants, *true.variants))
    (cause,) = causes(system, [one])
    assert cause.variants == true.variants
    assert [len(shapes) for shapes in cause.shapes] == [1]


def test_shapes_that_leave_as_much_may_be_the_one_as_well():
    mix = [[0.98, 0.2], [1.0, 0.0], [1.0, 1e-3]]
    system, (far, true, near) = system_of(mix, [2.0, 0.0])
    one = Hypothesis("effect", None, MISSING, (*far.variants, *true.variants, *near.variants))
    (cause,) = causes(system, [one])
    assert [len(shapes) for shapes in cause.shapes] == [2]


def test_a_crumb_within_the_misfit_that_no_effect_names_is_no_cause():
    assert found(np.eye(2), [0.3, 0.01]) == ["effect_0"]  # seven standard errors, a tenth of the noise


@pytest.mark.nightly
@given(st.floats(0.1, 1.0))
def test_a_crumb_does_not_unsay_what_explains_nearly_everything(crumb):
    (first, *_) = causes(*system_of(np.eye(2), [3.0, crumb]))
    assert first.effect == "effect_0" and first.probability > 0.9


def test_what_any_healthy_robot_may_have_of_an_effect_is_no_cause():
    system, candidates = system_of(np.eye(2), [0.1, 0.0])  # as large as ten noises
    term = Term("k0", "1", unnamed=0.05)
    law = replace(candidates[0], variants=(replace(candidates[0].variants[0], terms=(term,)),))
    assert [cause.effect for cause in causes(system, candidates)] == ["effect_0"]
    assert not causes(system, [law, candidates[1]])
    system, candidates = system_of(np.eye(2), [1.0, 0.0])
    assert [cause.effect for cause in causes(system, [law, candidates[1]])] == ["effect_0"]


def test_what_any_healthy_robot_may_have_of_an_effect_is_no_change_either():
    column = CandidateColumn(EFFECT, 0, Term("k", "1", unnamed=0.05))
    for scope in (MISSING, CHANGED):
        ((variant,),) = [one.variants for one in hypotheses([column], 0, scope)]
        assert variant.terms == (column.term,)


def test_groups_that_disagree_speak_against_an_effect():
    generator = np.random.default_rng(2)

    def odds(sizes):
        blocks = []
        for run, size in enumerate(sizes):
            column = generator.standard_normal((ROWS, 1))
            measured = size * column[:, 0] + generator.standard_normal(ROWS)
            blocks.append(block(run, np.ones(ROWS), column, measured))
        column = CandidateColumn(EFFECT, 0, Term("k", "1"))
        system = equation(blocks, [CONSTANT], [column])
        return [cause.log_odds for cause in causes(system, [alone("torque_drift", 1, column)])]

    (agreed,), mixed = odds([3.0] * 8), odds([4.0, -1.0] * 4)
    assert agreed > 5
    assert not mixed or mixed[0] < agreed / 2


def coefficients(values):
    """One of each variant, (V, 1), known to one."""
    return Coefficients(np.arange(len(values)), values, values[:, None])


def test_what_groups_disagree_on_brings_no_number_nearer_to_what_is_known_of_it():
    """Five effects that explain the prior alone; on the last of them four groups disagree."""
    one = np.ones((5, 1))
    missed = np.where(np.arange(5)[:, None] == 4, [50.0, -50.0, 50.0, -50.0], 0.0)
    term, every = Term("k", "1"), 60.0 * one[:, 0]
    variants = tuple(Variant(EFFECT, (k,), (term,)) for k in range(5))
    squares = every, 25.0 * np.ones((5, 4)), missed
    alike = np.ones(5, dtype=int)
    seen = HypothesisEvidence(variants, *squares, (coefficients(one),), np.full(4, 1e3), one, np.zeros(5), every, alike)
    named = tuple(Hypothesis(f"effect_{k}", None, MISSING, (variant,)) for k, variant in enumerate(variants))
    posterior = Posterior(named, np.arange(5), np.zeros(5), seen, 0.05 * one, np.ones(5), DEFAULT.criterion)
    assert posterior.log_odds[0] > 5 > posterior.log_odds[4] + 4


def where_friction_turns(effect):
    """The log odds of an effect that shows in slow rows alone, as large as three noises."""
    generator, blocks = np.random.default_rng(5), []
    for run in range(RUNS):
        constant, column, fast, slow = np.ones(ROWS), *generator.standard_normal((3, ROWS))
        halves = [constant, 0.0 * column, fast], [constant, column, 3.0 * column + slow]
        factors = tuple(triangle(np.column_stack(half)) for half in halves)
        blocks.append(Block(f"run_{run}", 0.0, 1.0, np.full(2, ROWS), factors))
    column = CandidateColumn(catalogue()[effect], 0, Term("k", "1"))
    system = replace(equation(blocks, [CONSTANT], [column]), pattern=np.ones((2, 2), dtype=bool), apart=True)
    (cause,) = causes(system, [alone(effect, 1, column)])
    return cause.log_odds


def test_what_is_left_where_friction_turns_tells_of_reversals_alone():
    assert where_friction_turns("backlash") > where_friction_turns("load_dependent_friction") + 10


def test_what_power_shows_beside_torque_is_no_rival_of_what_torque_shows():
    """A loss of the whole robot explains more than a joint's friction, and other squares."""
    one, term = np.ones((2, 1)), Term("k", "1")
    variants = tuple(Variant(EFFECT, (k,), (term,)) for k in range(2))
    explained, of_power = np.array([900.0, 60.0]), np.array([890.0, 3.0])
    squares = explained, 25.0 * np.ones((2, 4)), np.zeros((2, 4))
    rows, alike = np.full(4, 1e3), np.ones(2, dtype=int)
    seen = HypothesisEvidence(variants, *squares, (coefficients(one),), rows, one, of_power, np.zeros(2), alike)
    loss, friction = (
        Hypothesis("loss", None, MISSING, variants[:1]),
        Hypothesis("friction", "j1", MISSING, variants[1:]),
    )
    posterior = Posterior((loss, friction), np.arange(2), np.zeros(2), seen, 0.05 * one, np.ones(2), DEFAULT.criterion)
    assert (posterior.near(loss), posterior.near(friction)) == ([0], [1])
    assert posterior.likeliest_at(friction) == 1


def test_what_the_reference_runs_show_as_well_is_missing_and_has_not_changed():
    assert changing(before=3.0, now=3.0) == [MISSING]
    assert changing(before=0.0, now=3.0) == [CHANGED]


def test_a_change_takes_nothing_from_what_was_not_there():
    friction = catalogue()["coulomb_friction"]
    assert changing(before=0.0, now=-3.0, twin=(friction, Term("Fc", "1"))) == [CHANGED]
    system, _ = system_of(np.eye(2), [-0.5, 0.0])
    only_adds = replace(system.columns[0], term=replace(system.columns[0].term, lowest=0.0))
    assert not causes(system, [alone("effect_0", 1, only_adds)])


def test_what_few_runs_show_is_found_where_it_is_much():
    def few(coefficient, speaking):
        system, candidates = system_of(np.eye(4), [coefficient, 0.0, 0.0, 0.0], silent=range(RUNS - speaking))
        return [cause.effect for cause in causes(system, candidates)]

    assert few(1.0, speaking=2) == ["effect_0"]
    assert few(0.005, speaking=2) == []


def test_an_effect_that_joints_have_shown_may_be_smaller_at_another():
    def joints(sizes):
        system, candidates = system_of(np.eye(8), [*sizes, *np.zeros(8 - len(sizes))])
        assert 0.07 in sizes and len(causes(system, candidates)) == len(sizes) - 1
        (cause,) = causes(system, [replace(one, effect="e", joint=f"j{k}") for k, one in enumerate(candidates)])
        return sorted(cause.joints)

    assert joints([0.3, 0.3, 0.3, 0.07]) == ["j0", "j1", "j2", "j3"]
    assert joints([0.3, 0.07]) == ["j0"]  # that one joint shows it leaves open at which of seven it is, too


def test_a_mixture_that_comes_first_gives_way_to_the_two_that_it_stands_for():
    mix = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.7, 0.7, 0.08]]
    assert sorted(found(mix, [0.3, 0.2, 0.0])) == ["effect_0", "effect_1"]


def test_what_explains_most_does_not_hide_what_is_likely():
    judged = SimpleNamespace(hypotheses=("most", "likely"), variant=str, log_odds=[-9.0, 2.0], log_prior=[-5.0, -5.0])
    search = SimpleNamespace(beside=lambda found, noise: judged, left=lambda found, noise: noise)
    judged.likeliest_at = judged.hypotheses.index
    posterior = SimpleNamespace(promising=lambda least: [("most", "0"), ("likely", "1")])
    assert _Search.likely(search, posterior, [], None) == ("likely", "1")
    posterior.promising = lambda least: [("most", "0")]
    assert _Search.likely(search, posterior, [], None) is None


def test_what_is_nearly_all_that_is_left_is_found_however_rare_its_shape():
    """By noise that holds it nothing is likely: much is left, and a rare shape pays for all that were tried."""
    system, candidates = system_of(np.eye(60), [*np.zeros(59), 1.0])
    orders, term = [*range(1, 25), 42], system.columns[0].term
    shapes = tuple(Variant(TorqueRipple(N=order), (36 + k,), (term,)) for k, order in enumerate(orders))
    ripple = Hypothesis("torque_ripple", None, MISSING, shapes)
    (cause,) = attribute(system, [*candidates[:35], ripple], DEFAULT.criterion, np.array([1.0])).causes
    assert cause.variants[0].effect.N == 42
    assert cause.probability > 0.9


def test_what_is_likelier_in_the_end_takes_the_place_of_what_came_first():
    system, (true, mixture) = system_of([[1.0, 0.0], [0.9, 0.3]], [1.0, 0.0])
    search = _Search(system, [true, mixture], HypothesisPrior.of([true, mixture]), DEFAULT.criterion, None)
    first = [(mixture, mixture.variants[0])]
    ((named, _),), noise = search.likeliest(first, search.left(first, np.ones(1)))
    assert named is true
    assert noise == pytest.approx(1.0, rel=0.05)


def test_what_is_expected_in_each_joint_shows_in_all_together():
    """None of six joints shows it by itself; where some size is expected and not there, that speaks against it."""
    size = 0.1
    columns = tuple(CandidateColumn(EFFECT, k, Term("k", "1", f"j{k}", expected=size, spread=size)) for k in range(6))
    each = hypotheses(columns, 1, MISSING)
    prior = HypothesisPrior(effects=20, joints={(each[0].effect, MISSING): 6})

    def odds(there):
        system = replace(system_of(np.eye(6), np.full(6, there), size=1.0)[0], columns=columns)
        search = _Search(system, each, prior, DEFAULT.criterion, np.ones(1))
        found = search.beside((), system.residual_rms((), np.ones(1)))
        return {one.joint: float(odds) for one, odds in zip(found.hypotheses, found.log_odds, strict=True)}

    shown, nothing = odds(size), odds(0.0)
    assert shown.pop(None) > 0 > max(shown.values())
    assert nothing.pop(None) < min(nothing.values()) < -np.log(20 * 6)


def test_effects_that_cannot_be_told_apart_share_the_probability():
    (cause,) = causes(*system_of([[1.0, 0.0], [1.0, 1e-3]], [0.3, 0.0]))
    rival = "effect_1" if cause.effect == "effect_0" else "effect_0"
    assert cause.not_told_from(0.1) == (rival,)
    assert cause.probability == pytest.approx(0.5, abs=0.1)
    assert cause.probability + cause.rivals[rival] == pytest.approx(1 - DEFAULT.criterion.unknown, abs=1e-3)


def test_of_equals_that_is_not_taken_whose_place_screening_chose():
    system, candidates = system_of([[1.0, 0.0], [1.0, 0.001]], [0.3, 0.0])
    placed = replace(candidates[0].variants[0], effect=catalogue()["local_wear"])
    (cause,) = causes(system, [replace(candidates[0], variants=(placed,)), candidates[1]])
    assert cause.effect == "effect_1" and cause.probability > 0.5


def test_a_nuisance_shares_the_probability_and_is_named_nowhere():
    system, (one, other) = system_of([[1, 0], [1, 0.05]], [0.3, 0.0])
    nameless = replace(other, variants=(replace(other.variants[0], effect=FrictionTurn()),))
    found = attribute(system, [one, nameless], DEFAULT.criterion)
    (alone,) = attribute(system, [one], DEFAULT.criterion).causes
    assert [cause.nuisance for cause in found.causes] == [True]
    assert [each.effect for each in found.hypotheses] == ["effect_0"] and len(found.visible) == len(found.log_odds) == 1
    prior = HypothesisPrior.of([one, nameless])
    assert (prior.log_odds(nameless, []), prior.log_odds(one, []) < 0) == (0.0, True)
    beside = judged(system, [one], [one, nameless], DEFAULT.criterion, None, found.noise)
    assert beside[0].probability < alone.probability and beside[0].rivals == {}


def test_effects_that_share_nothing_are_no_rivals():
    (cause,) = causes(*system_of(np.eye(2), [0.3, 0.0]))
    assert cause.rivals["effect_1"] < 1e-3


@pytest.mark.slow
@given(st.floats(0.1, 10))
def test_the_unit_of_noise_does_not_matter(unit):
    system, candidates = system_of(np.eye(2), [0.3, 0.1])
    variants = [one.variants[0] for one in candidates]
    plain = evidence(Projection(system, np.array([1.0]), variants), (), variants)
    other = evidence(Projection(system, np.array([unit]), variants), (), variants)
    np.testing.assert_allclose(other.explained, plain.explained / unit**2, rtol=1e-3)
    np.testing.assert_allclose(other.rows_that_speak, plain.rows_that_speak, rtol=1e-3)


def test_products_are_those_of_the_factors():
    system, _ = system_of(np.eye(3), np.array([1.0, -2.0, 0.5]))
    term = Term("constant", "1", expected=2.0, spread=3.0)
    columns = tuple(replace(one, term=replace(one.term, spread=2.0)) for one in system.columns)
    system = replace(system, terms=((EFFECT, term),), columns=columns, observed=np.arange(RUNS) >= RUNS // 2)
    for run, moments in enumerate(system.moments(np.array([0.5]))):
        rows = system.blocks[run].factors[0]
        changes = rows[:, 1:-1] * system.observed[run]
        every = np.column_stack([rows[:, :-1], changes]) * system.scale
        factor = np.column_stack([every, rows[:, -1] - 2.0 * rows[:, 0]])
        expected = factor.T @ factor / 0.25
        np.testing.assert_allclose(moments.of(np.arange(moments.size)), expected, rtol=1e-9, atol=1e-6)
