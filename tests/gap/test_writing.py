"""What a diagnosis writes of a cause and of what the data cannot tell from it."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import pytest
from tests.gap_cases import document
from tests.synthetic import arm

from irtwin.document.document import CauseParameter
from irtwin.effects.effect import Term, quantity
from irtwin.gap import writing
from irtwin.gap.isolation.cause import FoundCause
from irtwin.gap.regression.hypotheses import Variant
from irtwin.gap.thresholds import DEFAULT
from irtwin.gap.writing import (
    _joints,
    _members,
    alone_in_file,
    beside,
    closing_nothing,
    doubted,
    folded,
    number_is_off,
)
from irtwin.simulator.differences import not_held


def test_members_are_the_cause_and_its_rivals_each_with_its_probability():
    cause = next(one for one in document("ambiguous").causes if one.indistinguishable_from)
    likely = dict.fromkeys(cause.indistinguishable_from, 0.3)
    one = replace(cause, evidence=replace(cause.evidence, probability_of_rivals=likely | {"backlash": 0.02}))
    told = {member.effect: member.confidence for member in _members(one)}
    assert told == {cause.effect: cause.confidence} | likely


def test_damping_that_differs_beside_what_warmth_does_is_a_number_of_the_model():
    thinning = CauseParameter(name="k", joint="joint_a3", value=0.02, unit="1/K", interval95=None)
    damping = CauseParameter(name="Fv", joint="joint_a3", value=-9.5, unit="N m s/rad", interval95=None)
    cause = document("attributed").causes[0]
    warm = replace(
        cause, effect="temperature_dependent_friction", scope="changed", confidence=0.9, parameters=(thinning, damping)
    )
    model = SimpleNamespace(name="m", numbers=lambda joint: {"damping": 19.0})
    told = beside(model, warm, {})
    assert [(one.simulator, one.robot) for one in told.parameters] == [(None, None), (19.0, 9.5)]
    assert not_held(SimpleNamespace(causes=(told,))) == (told,)
    coupled = replace(warm, effect="joint_coupling", parameters=(damping,))
    assert beside(model, coupled, {}) == coupled  # a friction of its own


def parameter(value: float, interval: tuple[float, float] | None, simulator: float | None = None) -> CauseParameter:
    return CauseParameter(
        name="Fc", joint="joint_a2", value=value, unit="N m", interval95=interval, simulator=simulator,
        robot=None if simulator is None else simulator + value,
    )  # fmt: skip


def test_friction_that_goes_with_what_no_file_holds_is_written_as_it_is_best_there():
    model = SimpleNamespace(name="m", numbers=lambda joint: {"frictionloss": 8.0})
    cause = document("attributed").causes[0]
    dry = replace(cause, effect="coulomb_friction", scope="changed", parameters=(parameter(-1.0, (-1.1, -0.9)),))
    key = ("joint_a2", "Fc")
    (sure,) = beside(model, dry, {key: parameter(-0.2, (-0.3, -0.1))}).parameters
    assert (sure.value, sure.simulator, sure.robot) == (-0.2, 8.0, 7.8)
    (unsure,) = beside(model, dry, {key: parameter(-0.1, (-0.3, 0.1))}).parameters
    assert (unsure.value, unsure.simulator, unsure.robot) == (-1.0, None, None)  # the file's number stays


def test_what_is_best_in_a_file_is_fitted_without_the_friction_that_it_cannot_hold(monkeypatch: pytest.MonkeyPatch):
    def cause(effect: str, family: str, terms: dict[int, str], scope: str = "changed") -> tuple:
        own = tuple(Term(name, "N m", "joint_a2", spread=1.0) for name in terms.values())
        variant = Variant(SimpleNamespace(family=family), tuple(terms), own)
        return SimpleNamespace(name="torque"), FoundCause(effect, scope, ("joint_a2",), (variant,), 1.0, 1.0, 0.9)

    asked = []

    def fitted(finding: object, told: dict[int, Term], others: set[int]) -> list:
        asked.append(({k: term.name for k, term in told.items()}, others))
        return [quantity(term.name, term.joint, 0.5, term.unit, 0.1) for term in told.values()]

    monkeypatch.setattr(writing, "numbers_without", fitted)
    dry = cause("coulomb_friction", "friction", {7: "Fc"})
    rotor = cause("rotor_inertia", "bodies", {9: "Ia"})
    warm = cause("temperature_dependent_friction", "friction", {11: "k Fv", 12: "dFv"})
    found = alone_in_file([dry, rotor, warm], None)
    assert asked == [({7: "Fc", 12: "Fv"}, {11})]
    assert {key: one.value for key, one in found.items()} == {("joint_a2", "Fc"): 0.5, ("joint_a2", "Fv"): 0.5}
    assert alone_in_file([dry, rotor], None) == {}
    assert len(asked) == 1


@pytest.mark.parametrize(
    ("value", "interval", "simulator", "off"),
    [
        (0.104, (0.094, 0.114), 0.102, True),  # half of a rotor
        (-0.05, (-0.06, -0.04), 0.102, True),
        (0.104, (0.01, 0.2), 0.102, False),  # may be as little as a tenth
        (0.104, (-0.1, 0.3), 0.0, False),
        (0.104, (0.094, 0.114), 0.0, True),  # the model has none
        (0.104, (0.094, 0.114), None, False),  # no number of a model
    ],
)
def test_a_number_that_is_off_by_much_and_for_sure_matters(value, interval, simulator, off):
    cause = replace(
        document("attributed").causes[0], confidence=0.9, parameters=(parameter(value, interval, simulator),)
    )
    assert number_is_off(cause, DEFAULT.matters) == off
    assert not number_is_off(replace(cause, confidence=0.4), DEFAULT.matters)


def test_a_cause_that_no_finding_that_matters_has_is_marked():
    said = document("ambiguous")
    assert not any(one.folded_away for one in folded(said.causes, said.findings))
    little = [replace(one, matters=False) for one in said.findings]
    assert all(one.folded_away for one in folded(said.causes, little))


def test_a_little_cause_that_left_out_runs_do_not_confirm_is_doubted():
    first = document("ambiguous").findings[0]
    little, sure = replace(first, matters=False, share_interval95=(-0.1, 0.1)), replace(first, matters=False)
    assert closing_nothing([little]) == set(first.causes)
    assert closing_nothing([first, replace(sure, share_interval95=(0.01, 0.1))]) == set()


def test_a_guess_beside_a_likely_cause_adds_no_joint_to_what_is_said_of_the_family():
    cause = document("ambiguous").causes[0]
    guess, other = (replace(cause, joints=(joint,), confidence=0.49) for joint in ("joint_1", "joint_2"))
    assert _joints(arm(3), [guess, replace(other, confidence=0.5)]) == ("joint_2",)
    assert _joints(arm(3), [guess, other]) == ("joint_1", "joint_2")


def test_beside_something_unknown_a_cause_is_as_likely_as_not():
    cause, *_ = document("ambiguous").causes
    sure = replace(cause, confidence=0.92, evidence=replace(cause.evidence, probability_of_rivals={"backlash": 0.46}))
    told = doubted(sure, DEFAULT.criterion)
    assert told.confidence == pytest.approx(0.5)
    assert told.evidence.probability_of_rivals == pytest.approx({"backlash": 0.25})
    assert told.indistinguishable_from == sure.indistinguishable_from
