"""What torque of several joints lags by, and of none not, is no cause; what one lags by is."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from irtwin.effects.sensing import TimeDelay
from irtwin.gap.data.case import Case
from irtwin.gap.isolation import common_lag as module
from irtwin.gap.isolation.common_lag import common_lag
from irtwin.signals.motion import Motion

MOTIONS = [SimpleNamespace(rate=500.0)]
LATE, EARLY, OPEN = (1.5e-3, 1e-4), (0.0, 1e-4), (0.5e-3, 1e-3)  # the lag of a joint and its deviation, s


def finding(*joints, effect=TimeDelay.id):
    """One cause, and the lags of the joints."""
    return SimpleNamespace(causes=[SimpleNamespace(effect=effect)], joints=joints)


@pytest.fixture(autouse=True)
def lags(monkeypatch):
    def of_joints(found):
        return np.column_stack([np.array(found.joints), np.full(len(found.joints), 2.5e-4)]).T

    monkeypatch.setattr(module, "lags_of_joints", of_joints)


@pytest.mark.parametrize(
    "joints",
    [[LATE] * 6, [LATE] * 2 + [OPEN] * 4, [LATE] * 2 + [EARLY] + [OPEN] * 3, [LATE, LATE, (4e-3, 1e-4)] + [EARLY] * 2],
    ids=["all", "the others do not tell", "one says that it is early", "one is later still"],
)
def test_what_several_joints_lag_by_is_their_median(joints):
    assert common_lag(finding(*joints), MOTIONS) == pytest.approx(1.5e-3)


@pytest.mark.parametrize(
    "found",
    [
        finding(LATE, *[OPEN] * 5),
        finding(*[LATE] * 2, *[EARLY] * 2),
        finding(*[(20e-3, 1e-4)] * 6),
        finding(*[LATE] * 6, effect="coulomb_friction"),
        SimpleNamespace(causes=[]),
    ],
    ids=["one joint alone", "as many are early", "longer than filters make it", "another effect", "no cause"],
)
def test_what_else_is_found_stays(found):
    assert common_lag(found, MOTIONS) is None


def test_at_a_slow_rate_a_sample_is_no_lag_of_the_robot():
    assert common_lag(finding(*[(15e-3, 1e-4)] * 6), [SimpleNamespace(rate=50.0)]) == pytest.approx(15e-3)


def test_torque_comes_so_much_earlier_and_power_as_it_was():
    time = np.arange(0, 2, 1e-2)
    still = np.zeros((len(time), 1))
    late = np.sin(3 * (time - 4e-3))[:, None]
    motion = Motion(time, still, still, still, torque=late, run="a")
    case = Case(None, (), (), {"a": motion, "b": Motion(time, still, still, still, run="b")}, (None, {}), None)
    without = case.without_lag(4e-3).motions
    assert without["a"].torque[1:-1, 0] == pytest.approx(np.sin(3 * time)[1:-1], abs=1e-5)
    assert without["b"] is case.motions["b"]
