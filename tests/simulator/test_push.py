"""What pushes a robot for a while is found in its run, with its force and its time; nothing else is."""

from __future__ import annotations

import numpy as np
import pytest
from tests import servo_arm

from irtwin.simulator.alone import alone
from irtwin.simulator.choice import choose
from irtwin.simulator.fit import unjudged
from irtwin.simulator.play import Push, whole
from irtwin.simulator.playing import diagnose
from irtwin.simulator.push import find_pushes

pytestmark = pytest.mark.slow
PUSH = Push("b", np.array([0.0, 0.0, 3.0]), 2.5, 4.0, 0.2)


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    told = {name: servo_arm.swings(6, seed) for name, seed in (("a", 1), ("b", 2))}
    return servo_arm.read(*servo_arm.write(tmp_path_factory.mktemp("arm"), told))


def test_a_push_lifts_an_arm_and_the_arm_comes_back(arm):
    data_set, _, own = arm
    free, pushed = (
        servo_arm.played(data_set, own, own.numbers, noise=0.0, pushes=some).runs[1].signals for some in ((), (PUSH,))
    )
    off, time = np.abs(pushed.q - free.q).max(axis=1), free.time
    assert off[(time > 1.5) & (time < PUSH.start)].max() < 1e-6
    assert off[(time > PUSH.start + 0.5) & (time < PUSH.stop)].min() > 0.01
    assert off[time > PUSH.stop + 1.0].max() < 5e-3  # but for dry friction


def test_a_push_is_told_with_its_force_and_its_time_beside_a_number_that_differs(arm):
    data_set, model, own = arm
    numbers = servo_arm.changed(own, stiffness=(20.0, 10.0))
    logged = servo_arm.played(data_set, own, numbers, pushes=(PUSH,))
    document = diagnose(logged, model).document
    contact = next(cause for cause in document.causes if cause.evidence.runs)
    assert (contact.effect, contact.evidence.runs, contact.joints) == ("external_contact", ("b",), ())
    assert contact.evidence.window == pytest.approx((PUSH.start, PUSH.stop), abs=0.1)
    for name, true in (("f", 3.0), ("f_z", 3.0), ("start", PUSH.start), ("stop", PUSH.stop)):
        told = next(one for one in contact.parameters if one.name == name)
        assert told.interval95[0] <= true <= told.interval95[1]
    others = {cause.id for cause in document.causes if cause is not contact and not cause.folded_away}
    assert others == {"servo_stiffness@elbow"}
    assert document.verdict == "attributed"
    assert document.shrink.position_rmse.after < 1.5e-3


def test_nothing_pushes_where_nothing_is_left(arm):
    data_set, _, own = arm
    runs = servo_arm.played(data_set, own, own.numbers).runs
    assert find_pushes(choose(unjudged(alone(own, [whole(run) for run in runs], 0.01)))) == ()


@pytest.mark.parametrize(("seconds", "rate"), [(0.45, 50.0), (4.0, 5.0)])
def test_nothing_is_sought_where_a_run_is_too_short_or_too_coarse(tmp_path, seconds, rate):
    told = {"a": servo_arm.swings(1.0 + seconds, 1, rate), "b": servo_arm.swings(1.0 + seconds, 2, rate)}
    data_set, _, own = servo_arm.read(*servo_arm.write(tmp_path, told, rate=rate))
    runs = servo_arm.played(data_set, own, own.numbers).runs
    assert find_pushes(choose(unjudged(alone(own, [whole(run) for run in runs], 0.01)))) == ()


def test_what_a_load_leaves_all_the_time_is_no_push_of_a_part(arm):
    data_set, _, own = arm
    laden = servo_arm.played(data_set, own, servo_arm.changed(own, payload=(0.1, 0.1)))
    document = diagnose(laden, arm[1]).document
    assert [cause.effect for cause in document.causes if not cause.folded_away] == ["payload"]
