"""A small sample of the blind benchmark: the plant and the scoring know the truth, the diagnosis does not."""

from __future__ import annotations

import pytest

from blind.cases import Plan, make
from blind.score import judge
from irtwin.gap.diagnosis import diagnose
from irtwin.signals.log import read_data_set

pytestmark = pytest.mark.nightly

SEED = 5_000_000  # of neither split


@pytest.fixture(scope="module")
def scored(tmp_path_factory):
    folder = tmp_path_factory.mktemp("blind")

    def score(name, kind, effects=(), level=0.0, scope="missing"):
        plan = Plan(name, SEED + len(name), "pall4", kind, effects, level, scope)
        label = make(plan, folder)
        return judge(diagnose(read_data_set(folder / name)).to_json(), label)

    return score


def test_a_healthy_robot_raises_no_alarm(scored):
    assert scored("healthy", "clean_null")["false alarms, clean nulls"] == 0


def test_a_slightly_imperfect_robot_raises_no_alarm(scored):
    assert scored("imperfect", "dirty_null", scope="changed")["false alarms, dirty nulls"] == 0


@pytest.mark.parametrize("effect", ["stribeck_friction", "copper_loss"])
def test_a_missing_effect_is_named_first(scored, effect):
    scores = scored(f"missing_{effect}", "single", (effect,), 3.0)
    assert scores["right effect first"] == 1


def test_a_changed_effect_is_named_with_its_joints_and_scope(scored):
    scores = scored("changed", "single", ("asymmetric_friction",), 3.0, "changed")
    assert scores["right effect first"] == scores["joint right"] == scores["scope right"] == 1


def test_joints_that_never_move_are_no_obstacle(scored):
    scores = scored("poor", "poor", ("payload",), 3.0)
    assert set(scores) == {"right effect first, gap 3, poor"}
