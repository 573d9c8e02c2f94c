"""What a diagnosis writes of a cause and of what the data cannot tell from it."""

from __future__ import annotations

from dataclasses import replace

import pytest
from tests.gap_cases import document, parameter
from tests.synthetic import arm

from irtwin.gap.thresholds import DEFAULT
from irtwin.gap.writing import _joints, _members, closing_nothing, doubted, folded, number_is_off


def test_members_are_the_cause_and_its_rivals_each_with_its_probability():
    cause = next(one for one in document("ambiguous").causes if one.indistinguishable_from)
    likely = dict.fromkeys(cause.indistinguishable_from, 0.3)
    one = replace(cause, evidence=replace(cause.evidence, probability_of_rivals=likely | {"backlash": 0.02}))
    told = {member.effect: member.confidence for member in _members(one)}
    assert told == {cause.effect: cause.confidence} | likely


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
