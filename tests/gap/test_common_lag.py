"""What torque of most joints lags by is no cause; what one lags by is."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from irtwin.effects.friction import CoulombFriction
from irtwin.effects.sensing import TimeDelay
from irtwin.gap.data.case import Case
from irtwin.gap.isolation import common_lag as module
from irtwin.gap.isolation.common_lag import common_lag
from irtwin.signals.motion import Motion

ROBOT = SimpleNamespace(joints=range(6))
MOTIONS = [SimpleNamespace(rate=500.0)]


def finding(lags, joints=None, effect=None, scope="missing"):
    """One cause, its numbers as given, s."""
    cause = SimpleNamespace(
        variants=[SimpleNamespace(effect=effect or TimeDelay())],
        scope=scope,
        touched=lambda _: [f"j{k}" for k in range(joints or len(lags))],
        lags=lags,
    )
    return SimpleNamespace(causes=[cause])


@pytest.fixture(autouse=True)
def quantities(monkeypatch):
    monkeypatch.setattr(module, "quantities", lambda _, __, cause: [SimpleNamespace(value=lag) for lag in cause.lags])


def test_most_joints_late_alike_have_their_median():
    assert common_lag(ROBOT, finding([1.4e-3, 1.5e-3, 1.6e-3, 4e-3]), MOTIONS) == pytest.approx(1.55e-3)


@pytest.mark.parametrize(
    "found",
    [
        finding([1.5e-3] * 3),
        finding([20e-3] * 6),
        finding([1.5e-3] * 6, scope="changed"),
        finding([1.5e-3] * 6, effect=CoulombFriction()),
        SimpleNamespace(causes=[]),
    ],
    ids=["half of the joints", "longer than filters make it", "since the references", "another effect", "no cause"],
)
def test_what_else_is_found_stays(found):
    assert common_lag(ROBOT, found, MOTIONS) is None


def test_at_a_slow_rate_a_sample_is_no_lag_of_the_robot():
    assert common_lag(ROBOT, finding([15e-3] * 6), [SimpleNamespace(rate=50.0)]) == pytest.approx(15e-3)


def test_torque_comes_so_much_earlier_and_power_as_it_was():
    time = np.arange(0, 2, 1e-2)
    still = np.zeros((len(time), 1))
    late = np.sin(3 * (time - 4e-3))[:, None]
    motion = Motion(time, still, still, still, torque=late, run="a")
    case = Case(None, (), (), {"a": motion, "b": Motion(time, still, still, still, run="b")}, (None, {}), None)
    without = case.without_lag(4e-3).motions
    assert without["a"].torque[1:-1, 0] == pytest.approx(np.sin(3 * time)[1:-1], abs=1e-5)
    assert without["b"] is case.motions["b"]
