"""What the page says first agrees with the terminal, by way of the graph's answers."""

from __future__ import annotations

import pytest
from tests.html_elements import plain
from tests.report.robots import answered

from irtwin.report.gap.verdict import sentence


def answers(scope, simulated=False, parameters=(), sure=0.9, verdict="ambiguous", odd=()):
    """A diagnosis with one finding, payload or contact, of the whole robot."""
    rows = dict.fromkeys(("finding_joints", "locations", "disturbances", "sizes"), ()) | {
        "diagnosis": [
            {"verdict": verdict, "reason": "unsure", "floor_from": "repeats"}
            | {"tracking_error": None, "torque_error": 0.42}
            | {"against_simulator": simulated, "against_reference": not simulated}
        ],
        "findings": [
            {"finding": "f1", "family": "load", "family_label": None, "confidence": 0.9, "scope": scope}
            | {"channel": "torque", "share": 0.5, "lower": 0.4, "upper": 0.6, "of": "the gap", "matters": True}
        ],
        "finding_members": [
            {"finding": "f1", "cause": "c1", "effect": "payload", "label": None, "confidence": 0.7},
            {"finding": "f1", "cause": "c1", "effect": "x/external_contact", "label": None, "confidence": 0.2},
        ],
        "closed": [{"closed": 0.5, "lower": None, "upper": None}],
        "causes": [{"cause": "c1", "confidence": sure, "told": True}],
        "cause_parameters": parameters,
        "odd_stretches": odd,
    }
    return answered(rows)


@pytest.mark.parametrize(
    ("scope", "simulated", "claim"),
    [
        ("missing", False, "differs from the twin’s"),
        ("missing", True, "differs from the twin’s"),
        ("changed", False, "changed since the reference runs"),
        ("changed", True, "differs from the simulator’s"),
    ],
)
def test_a_finding_is_set_against_the_runs_that_lack_it(scope, simulated, claim):
    closes = "the simulator closes 50 % of its gap to the robot" if simulated else "the twin closes 50 % of the gap"
    assert plain(sentence(answers(scope, simulated))) == (
        f"Load {claim} (90 % sure): payload (70 %) or external contact (20 %). Adding this to {closes} on held-out "
        "runs."
    )


def test_numbers_of_the_simulator_are_said_the_farthest_first():
    numbers = [("k", None, None), ("Fv", 19.2, 8.71), ("Fc", 7.55, 5.89), ("mu", 0.0, 0.04), ("Ia", 2.0, 2.1)]
    parameters = [
        {"cause": "c1", "name": name, "joint": "j1", "simulator": simulator, "robot": robot, "unit": "N m"}
        | {"lower": None, "upper": None}
        for name, simulator, robot in numbers
    ]
    parameters.append(parameters[-1] | {"name": "offset", "simulator": 0.0, "lower": -0.01, "upper": 0.007})
    said = plain(sentence(answers("changed", simulated=True, parameters=parameters)))
    assert said.startswith(
        "The robot has other numbers than the simulator: mu of j1 0.0400 N m in place of 0, damping (Fv) of j1 8.71 "
        "N m in place of 19.2, frictionloss (Fc) of j1 5.89 N m in place of 7.55, and 1 more. "
    )
    guessed = sentence(answers("changed", simulated=True, parameters=parameters, sure=0.3))
    assert "other numbers" not in guessed


def test_a_simulator_that_is_right_agrees_beside_what_the_twin_leaves_of_both():
    agrees = "There is no gap: the simulator agrees with the robot, beside the 0.42 N m RMS that no effect explains."
    assert sentence(answers("changed", simulated=True, verdict="no_gap")).startswith(agrees)
    assert "simulator" not in sentence(answers("changed", simulated=False, verdict="no_gap"))


def test_stretches_that_stand_out_are_said_where_a_gap_is_unexplained():
    odd = [
        {"rank": rank, "run": "run_1", "start": float(rank), "end": rank + 0.5, "joint": joint}
        for rank in (1, 2, 3, 4)
        for joint in ("j1", "j2")
    ]
    said = sentence(answers("missing", verdict="unexplained", odd=odd))
    assert said.endswith(
        " Look first at run_1 from 1.0 to 1.5 s (j1, j2); run_1 from 2.0 to 2.5 s (j1, j2); run_1 from 3.0 to 3.5 s "
        "(j1, j2); and 1 more: there the twin leaves over six times as much torque as elsewhere."
    )
    assert "Look first" not in sentence(answers("missing", odd=odd))
