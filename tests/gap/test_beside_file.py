"""Numbers of a simulator's file beside the robot's."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import pytest
from tests.gap_cases import document, parameter

from irtwin.document.document import CauseParameter
from irtwin.effects.effect import Term, quantity
from irtwin.gap import beside_file
from irtwin.gap.beside_file import alone_in_file, beside
from irtwin.gap.isolation.cause import FoundCause
from irtwin.gap.regression.hypotheses import Variant
from irtwin.simulator.differences import not_held


def test_damping_that_differs_beside_what_warmth_does_is_a_number_of_the_model():
    thinning = CauseParameter(name="k", joint="joint_a3", value=0.02, unit="1/K", interval95=None)
    damping = CauseParameter(name="Fv", joint="joint_a3", value=-9.5, unit="N m s/rad", interval95=None)
    cause = document("attributed").causes[0]
    warm = replace(
        cause, effect="temperature_dependent_friction", scope="changed", confidence=0.9, parameters=(thinning, damping)
    )
    told = beside(lambda joint: {"damping": 19.0}, warm, {})
    assert [(one.simulator, one.robot) for one in told.parameters] == [(None, None), (19.0, 9.5)]
    assert not_held(SimpleNamespace(causes=(told,))) == (told,)
    coupled = replace(warm, effect="joint_coupling", parameters=(damping,))
    assert beside(lambda joint: {"damping": 19.0}, coupled, {}) == coupled  # a friction of its own


def test_friction_that_goes_with_what_no_file_holds_is_written_as_it_is_best_there():
    numbers = {"frictionloss": 8.0}
    cause = document("attributed").causes[0]
    dry = replace(cause, effect="coulomb_friction", scope="changed", parameters=(parameter(-1.0, (-1.1, -0.9)),))
    key = ("joint_a2", "Fc")
    (sure,) = beside(lambda joint: numbers, dry, {key: parameter(-0.2, (-0.3, -0.1))}).parameters
    assert (sure.value, sure.simulator, sure.robot) == (-0.2, 8.0, 7.8)
    (unsure,) = beside(lambda joint: numbers, dry, {key: parameter(-0.1, (-0.3, 0.1))}).parameters
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

    monkeypatch.setattr(beside_file, "numbers_without", fitted)
    dry = cause("coulomb_friction", "friction", {7: "Fc"})
    rotor = cause("rotor_inertia", "bodies", {9: "Ia"})
    warm = cause("temperature_dependent_friction", "friction", {11: "k Fv", 12: "dFv"})
    found = alone_in_file([dry, rotor, warm], None)
    assert asked == [({7: "Fc", 12: "Fv"}, {11})]
    assert {key: one.value for key, one in found.items()} == {("joint_a2", "Fc"): 0.5, ("joint_a2", "Fv"): 0.5}
    assert alone_in_file([dry, rotor], None) == {}
    assert len(asked) == 1
