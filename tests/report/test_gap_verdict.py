"""What the verdict says of causes that reference or simulated runs lack."""

from __future__ import annotations

import pytest

from irtwin.report.gap_verdict import sentence
from irtwin.report.questions import Answer, Question


def answers(scope, simulated, referenced):
    """A diagnosis with one cause, payload, of the whole robot."""
    rows = {
        "diagnosis": [{"verdict": "attributed", "against_simulator": simulated, "referenced": referenced}],
        "causes": [{"rank": 1, "effect": "payload", "label": "payload", "confidence": 0.9, "scope": scope}],
    }
    names = ("diagnosis", "causes", "cause_joints", "rivals", "locations", "closed")
    return {name: Answer(Question(name, "", (), ""), tuple(rows.get(name, ()))) for name in names}


@pytest.mark.parametrize(
    ("scope", "simulated", "referenced", "said"),
    [
        ("missing", False, False, "The twin lacks payload"),
        ("missing", True, False, "The twin lacks payload"),
        ("changed", False, True, "changed since the reference runs."),
        ("changed", True, False, "The simulator lacks payload"),
        ("changed", True, True, "changed since the reference runs, and the simulator lacks it"),
    ],
)
def test_a_cause_is_set_against_the_runs_that_lack_it(scope, simulated, referenced, said):
    assert said in sentence(answers(scope, simulated, referenced))
