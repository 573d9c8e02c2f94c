"""What the terminal says of a diagnosis: its largest finding first."""

from __future__ import annotations

import pytest
from tests import gap_cases

from irtwin.document.document import Document
from irtwin.report.gap.summary import line, refused

CAUSES = (
    "(96 % sure): viscous friction (70 %) and stribeck friction (96 %). Adding this to the twin closes 93 % of the gap "
    "on held-out runs (95 % interval 88 % to 97 %)."
)


@pytest.mark.parametrize(
    ("verdict", "against", "said"),
    [
        ("no_gap", None, "There is no gap: away from reversals the twin explains the data down to the noise floor."),
        (
            "unexplained",
            "reference",
            "There is a gap in the torque of joint_a3, mostly in the regime “low speed”, and no effect in the "
            "catalogue closes it.",
        ),
        ("attributed", "reference", f"Friction of joint_a3 changed since the reference runs {CAUSES}"),
        ("attributed", "simulated", f"Friction of joint_a3 differs from the simulator’s {CAUSES}"),
        (
            "ambiguous",
            "reference",
            "Friction of joint_a3 differs from the twin’s (52 % sure): stribeck friction (52 %) or nonlinear viscous "
            "friction (16 %) and nonlinear viscous friction (44 %) or stribeck friction (13 %). Adding this to the "
            "twin closes 90 % of the gap on held-out runs (95 % interval 85 % to 94 %).",
        ),
    ],
)
def test_the_verdict_is_one_sentence(verdict, against, said):
    assert line(gap_cases.document(verdict), against) == f"{verdict}: {said}"


def test_a_simulator_that_is_right_agrees_to_so_much_torque():
    diagnosis = gap_cases.diagnosis("no_gap")
    torque = {"before": 0.42, "after": 0.42, "noise_floor": 0.4, "interval95_after": None}
    diagnosis["shrink"] |= {"torque_rmse": torque}
    said = line(Document.from_json(diagnosis), "simulated")
    assert said == "no_gap: There is no gap: the simulator agrees with the robot, to 0.42 N m RMS."


def test_a_robots_own_effect_and_what_the_simulator_lacks_are_told_apart():
    diagnosis = gap_cases.diagnosis("attributed")
    diagnosis["causes"][0] |= {"scope": "missing", "joints": [], "effect": "base_tilt"}
    said = line(Document.from_json(gap_cases.with_findings(diagnosis)), "simulated")
    assert "Environment differs from the twin’s: base tilt (70 % sure); " in said
    assert "friction of joint_a3 differs from the simulator’s: stribeck friction (96 % sure)." in said


def test_what_was_refused_has_a_line_each():
    assert refused(gap_cases.document("attributed")) == [
        "refused: torque constant error on joint_a2: g = 2.1 (2.05 to 2.16); 0.7 to 1.4 is possible",
        "refused: payload: m = -9 kg (-9.2 to -8.8); at least -3 is possible",
    ]
    assert refused(gap_cases.document("no_gap")) == []
