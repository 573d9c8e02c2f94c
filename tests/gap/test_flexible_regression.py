"""The yardstick, held to gaps whose size is known."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from tests.synthetic import arm, measure, swing

from irtwin.effects.catalogue import BASELINE, catalogue
from irtwin.effects.effect import Predicted
from irtwin.effects.stack import Stack
from irtwin.gap.isolation.explained import ExplainedTorque
from irtwin.gap.isolation.finding import find
from irtwin.gap.localisation.channel_residuals import channel_residual
from irtwin.gap.localisation.flexible_regression import closeable, flexible_regression
from irtwin.gap.regression.channel_equations import torque_system
from irtwin.gap.regression.groups import Grouping
from irtwin.gap.thresholds import DEFAULT

pytestmark = pytest.mark.slow

ROBOT = arm(2)
NOISE = 0.2


def runs(added, count=5):
    """Motions of the arm with torque that something adds to."""
    made = []
    for seed in range(count):
        motion = replace(swing(ROBOT, seed, 12.0), run=f"run_{seed}")
        shown = measure(ROBOT, motion, noise=NOISE, seed=seed)
        made.append(replace(shown, torque=shown.torque + added(motion)))
    return made


def of(motions, tried=("stribeck_friction",)):
    stack = Stack(ROBOT, BASELINE)
    values = np.array([term.expected for _, term in stack.torque_terms])

    def predicted(motion):
        return stack.real_torque(motion, values)

    effects = [shape for effect in tried for shape in catalogue()[effect].candidates(ROBOT)]
    grouping = Grouping({m.run: m.run for m in motions}, frozenset(m.run for m in motions))
    system = torque_system(stack, motions, grouping, effects, lambda motion: Predicted(predicted(motion)))
    case = SimpleNamespace(
        modelled=frozenset((effect, None) for effect in BASELINE),
        robot=ROBOT,
        observed=grouping.observed,
        seen=motions,
        others=[],
        grouping=grouping,
        thresholds=DEFAULT,
    )
    finding = find("torque", case, system, np.full(2, NOISE), 0)
    explained = ExplainedTorque(stack, finding, lambda motion: Predicted(predicted(motion)))
    return finding, flexible_regression(channel_residual(case, explained, predicted), 0)


def on_second(function):
    def added(motion):
        torque = np.zeros_like(motion.dq)
        torque[:, 1] = function(motion.q[:, 1], motion.dq[:, 1])
        return torque

    return added


def test_nothing_is_closeable_where_there_is_noise_alone():
    _, found = of(runs(lambda motion: 0.0))
    assert found.closeable is None


def test_what_no_effect_names_is_nameless():
    finding, found = of(runs(on_second(lambda q, dq: np.exp(-(((q - 0.3) / 0.2) ** 2)) * np.tanh(3 * dq))))
    assert not finding.causes
    assert found.nameless > 0.6
    assert found.nameless == pytest.approx(found.closeable, rel=1e-3)


def test_what_a_cause_closes_is_not_nameless():
    finding, found = of(runs(on_second(lambda q, dq: 3 * np.sign(dq) * np.exp(-np.abs(dq) / 0.1))))
    assert [cause.effect for cause in finding.causes] == ["stribeck_friction"]
    assert found.closeable > 0.9
    assert found.by_regression > 0.5
    assert found.nameless < 0.05


def test_the_same_seed_gives_the_same_yardstick():
    motions = runs(on_second(lambda q, dq: np.sin(5 * q)), count=3)
    one, other = (of(motions)[1] for _ in range(2))
    assert one == other


def test_one_short_run_has_none():
    (run,) = runs(lambda motion: 0.0, count=1)
    assert of([run.part(0, 40)])[1] is None


def test_without_a_floor_shares_are_of_the_mean_square():
    shares = closeable(np.array([[4.0], [1.0], [2.0], [1.0]]), None, 0.1)
    assert (shares.closeable, shares.nameless) == (0.75, 0.25)
    assert "no floor" in shares.of


def test_without_a_gap_there_are_no_shares():
    squares = np.ones((4, 1))
    assert closeable(squares, np.array([1.1]), 0.1).closeable is None
    assert closeable(squares, np.array([0.98]), 0.1).closeable is None
