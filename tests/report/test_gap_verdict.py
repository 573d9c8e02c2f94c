"""What the verdict says of causes that reference or simulated runs lack."""

from __future__ import annotations

import pytest

from irtwin.report.gap.verdict import sentence
from irtwin.report.questions import Answer, Question


def answers(scope, simulated, referenced):
    """A diagnosis with one cause, payload, of the whole robot."""
    return answers_of({"payload": scope}, simulated, referenced)


def answers_of(causes, simulated=False, referenced=True, verdict="attributed", rivals=()):
    """A diagnosis with causes of the whole robot, the largest first; `causes`: the scope of each."""
    rows = {
        "diagnosis": [{"verdict": verdict, "against_simulator": simulated, "referenced": referenced}],
        "causes": [
            {"cause": cause, "effect": name, "label": name, "confidence": 0.9, "scope": scope}
            for cause, (name, scope) in enumerate(causes.items(), start=1)
        ],
        "rivals": [{"cause": cause, "rival": name, "rival_label": name} for cause, name in rivals],
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


def test_the_largest_cause_comes_first_whatever_its_scope():
    said = sentence(answers_of({"payload": "changed", "base tilt": "missing", "backlash": "changed"}))
    assert said == (
        "Payload (confidence 90\u00a0%) and backlash (confidence 90\u00a0%) changed since the reference runs; "
        "the twin lacks base tilt (confidence 90\u00a0%)."
    )


def test_an_ambiguous_verdict_names_the_largest_cause_first():
    causes = {"payload": "missing", "backlash": "missing"}
    said = sentence(answers_of(causes, verdict="ambiguous", rivals=((2, "joint elasticity"),)))
    assert said == (
        "There is a gap, and these data cannot tell its causes apart: payload; either backlash or joint elasticity."
    )
