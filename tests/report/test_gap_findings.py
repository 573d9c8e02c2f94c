"""Findings in words: few, the largest first, the rest counted."""

from __future__ import annotations

from typing import Any

import pytest
from tests.html_elements import plain

from irtwin.report.gap.findings import ToldFinding, counted, sentence

FRICTION = "Friction of joint_5 differs from the twin’s (97 % sure)"


def finding(family: str = "friction", effect: str | None = None, **changes: Any) -> ToldFinding:
    """A finding of joint_5: of one effect, as sure as the finding, or of two that its data do not tell apart."""
    known: dict[str, Any] = {
        "joints": ("joint_5",),
        "against": "twin",
        "channel": "torque",
        "confidence": 0.97,
        "share": 0.44,
        "interval": (0.38, 0.5),
        "of": "the gap above the floor",
        "matters": True,
        "members": ((("load-dependent friction", 0.55), ("position-dependent friction", 0.3)),),
    }
    known |= changes
    return ToldFinding(family=family, **known | ({"members": (((effect, known["confidence"]),),)} if effect else {}))


def said(verdict: str, *findings: ToldFinding, where: str = "", closes: str | None = "", **more: str) -> str:
    return plain(sentence(verdict, findings, where, closes, **more))


LITTLE = {"matters": False, "share": 0.0004}


def test_of_many_joints_it_is_said_how_many() -> None:
    many, four = (finding(effect="hysteresis", joints=tuple(f"joint_{k}" for k in range(count))) for count in (7, 4))
    assert said("attributed", many).startswith("Friction of 7 joints differs from the twin’s: hysteresis (97 % sure).")
    assert "joint_0, joint_1, joint_2 and joint_3" in said("attributed", four)


def test_the_family_is_said_before_its_effects() -> None:
    assert said("ambiguous", finding(), closes=" It closes.") == (
        f"{FRICTION}: load-dependent friction (55 %) or position-dependent friction (30 %). It closes."
    )


def test_bodies_are_many() -> None:
    one = finding("bodies", "rigid body", joints=(), against="simulated", confidence=0.94)
    assert said("attributed", one) == "Bodies differ from the simulator’s: rigid body (94 % sure)."


def test_where_nothing_is_known_of_the_whole_the_first_finding_says_what_it_closes() -> None:
    told = said("attributed", finding(), finding("sensing", share=0.2), closes=None)
    assert told.endswith(
        "The first of these closes 44 % of the gap in torque on held-out runs (95 % interval 38 % to 50 %)."
    )
    alone = said("attributed", finding(of="the mean square, as no floor is known"), closes=None)
    assert alone.endswith(
        "That closes 44 % of the mean square of torque on held-out runs (95 % interval 38 % to 50 %)."
    )


def test_several_causes_are_joined_and_a_guess_keeps_its_effects_to_itself() -> None:
    both = finding(members=((("stribeck friction", 0.9),), (("hysteresis", 0.6), ("backlash", 0.2))))
    guess = finding("sensing", "gain", joints=("joint_1", "joint_3"), confidence=0.48)
    assert said("attributed", both, guess) == (
        f"{FRICTION}: stribeck friction (90 %) and hysteresis (60 %) or backlash (20 %); "
        "perhaps sensing of joint_1 and joint_3 (48 % sure)."
    )


def test_a_confidence_that_all_share_is_said_once() -> None:
    both = finding(members=((("stribeck friction", 0.971),), (("hysteresis", 0.968),)))
    assert said("attributed", both) == f"{FRICTION}: stribeck friction and hysteresis."
    assert not both.has_alternatives and finding().has_alternatives


def test_guesses_beside_a_likely_cause_are_counted() -> None:
    three = finding(members=((("stribeck friction", 0.9),), (("hysteresis", 0.3), ("backlash", 0.1)), (("lag", 0.04),)))
    assert said("attributed", three) == f"{FRICTION}: stribeck friction (90 %), and 2 less likely."


def test_guesses_alone_are_said_to_be_guesses() -> None:
    guesses = [finding("load", "payload", confidence=0.4), finding("sensing", "gain", confidence=0.2)]
    told = said("unexplained", *guesses, where=" in the torque", closes=" It closes.", because="unsure")
    assert told == (
        "There is a gap in the torque, and no cause that was found is sure: perhaps load of joint_5 (40 % sure); "
        "perhaps sensing of joint_5 (20 % sure). It closes."
    )


def test_a_likely_cause_that_may_close_nothing_is_told_with_what_is_not_sure() -> None:
    likely = finding(share=0.27, interval=(-0.17, 0.72))
    told = said("unexplained", likely, where=" in the torque", closes=None, because="unsure")
    assert told == (
        "There is a gap in the torque: friction of joint_5 differs from the twin’s (97 % sure): load-dependent "
        "friction (55 %) or position-dependent friction (30 %). How much of the gap that makes is not sure. "
        "That closes 27 % of the gap in torque on held-out runs (95 % interval −17 % to 72 %)."
    )


def test_alternatives_of_other_families_are_named_where_one_of_them_is_likely() -> None:
    guess = finding("load", confidence=0.4, members=((("cable drag", 0.4), ("torque ripple", 0.3)),))
    assert said("ambiguous", guess) == (
        "Several effects explain the gap, and none of them is sure: perhaps load of joint_5 (40 % sure): cable drag "
        "(40 %) or torque ripple (30 %)."
    )


def test_what_is_sure_is_named_before_larger_guesses_and_stays_in_its_place() -> None:
    guesses = [finding(effect="x", joints=(f"joint_{k}",), confidence=0.2) for k in range(1, 5)]
    told = said("attributed", *guesses, finding("load", "payload", confidence=0.9))
    assert told.startswith("Perhaps friction of joint_1 (20 % sure); perhaps friction of joint_2 (20 % sure); load of ")
    assert "joint_3" not in told and "payload (90 % sure)" in told


def test_at_most_three_are_named_and_the_rest_is_counted() -> None:
    many = [finding(joints=(f"joint_{k}",), share=0.1) for k in range(1, 6)]
    told = said("ambiguous", *many, finding(**LITTLE), finding(channel="power", **LITTLE))
    assert "joint_3" in told and "joint_4" not in told
    assert told.endswith(
        "Beyond this, 3 findings together close 20 % of the gap in torque and 1 finding closes less than 0.1 % "
        "of the gap in power."
    )


def test_what_closes_nothing_is_no_gap_and_named_nowhere() -> None:
    assert said("no_gap", finding("environment", **LITTLE)) == (
        "There is no gap that matters: 1 finding closes less than 0.1 % of the gap in torque."
    )
    assert said("no_gap") == "There is no gap: away from reversals the twin explains the data down to the noise floor."


def test_without_a_noise_floor_nobody_says_that_the_twin_reaches_it() -> None:
    assert sentence("no_gap", [], "", None, has_floor=False).endswith(": the twin may leave more than noise.")


def test_an_unexplained_gap_says_what_part_is_closed() -> None:
    told = said("unexplained", finding(), finding(**(LITTLE | {"share": -0.01})), where=" in the power")
    assert told.startswith(
        "There is a gap in the power, and no effect in the catalogue closes it. Part of it is closed:"
    )
    assert told.endswith("Beyond this, 1 finding closes nothing of the gap in torque.")
    assert said("unexplained") == "There is a gap, and no effect in the catalogue closes it."


@pytest.mark.parametrize(
    ("because", "told"),
    [
        ("much_is_left", "There is a gap in the power, and no effect in the catalogue closes it."),
        (
            "impossible_number",
            "There is a gap in the power, and what would close it needs a number that cannot be true.",
        ),
        ("does_not_repeat", "Runs of one motion differ by a drift, and no effect in the catalogue explains that."),
    ],
)
def test_an_unexplained_gap_says_why(because: str, told: str) -> None:
    more = {"where": " in the power", "because": because, "differ": "a drift"}
    assert said("unexplained", **more) == told
    guess = finding(effect="x", confidence=0.3)
    assert said("unexplained", guess, **more) == f"{told} Part of it is perhaps friction of joint_5 (30 % sure)."


def test_what_does_not_repeat_is_told_beside_a_cause() -> None:
    told = said("attributed", finding(), differ="a drift in the torque of joint_2")
    assert told.endswith(
        " Besides, runs of one motion differ by a drift in the torque of joint_2, which no effect explains."
    )


def test_nothing_is_counted_as_nothing() -> None:
    assert counted([]) == ""
