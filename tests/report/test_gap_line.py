"""What the terminal says of a diagnosis: its largest cause first."""

from __future__ import annotations

import pytest
from tests import gap_cases

from irtwin.gap.document.document import Document
from irtwin.report.gap.headline import line, refused


@pytest.mark.parametrize(
    ("verdict", "against", "said"),
    [
        ("no_gap", None, "no_gap: no cause named"),
        ("unexplained", "reference", "unexplained: no cause named"),
        (
            "attributed",
            "reference",
            "attributed: viscous friction on joint_a3 and stribeck friction on joint_a3 changed since the reference "
            "runs",
        ),
        (
            "attributed",
            "simulated",
            "attributed: the simulator lacks viscous friction on joint_a3 and stribeck friction on joint_a3",
        ),
        (
            "ambiguous",
            None,
            "ambiguous: the twin lacks stribeck friction or nonlinear viscous friction on joint_a3 and "
            "nonlinear viscous friction or stribeck friction on joint_a3",
        ),
    ],
)
def test_one_line_names_what_lacks_what(verdict, against, said):
    assert line(gap_cases.document(verdict), against) == said


def test_a_robots_own_effect_and_what_the_simulator_lacks_are_told_apart():
    diagnosis = gap_cases.diagnosis("attributed")
    diagnosis["causes"][1] |= {"scope": "missing", "joints": [], "effect": "base_tilt"}
    assert line(Document.from_json(diagnosis), "simulated") == (
        "attributed: the twin lacks base tilt; the simulator lacks stribeck friction on joint_a3"
    )


def test_what_was_refused_has_a_line_each():
    assert refused(gap_cases.document("attributed")) == [
        "refused: torque constant error on joint_a2: g = 2.1 (2.05 to 2.16); 0.7 to 1.4 is possible",
        "refused: payload: m = -9 kg (-9.2 to -8.8); at least -3 is possible",
    ]
    assert refused(gap_cases.document("no_gap")) == []
