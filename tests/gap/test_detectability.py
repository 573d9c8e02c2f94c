"""What data cannot show."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.synthetic import arm, as_run, data_set, measure, swing, with_constants

from irtwin.effects.catalogue import BASELINE, catalogue
from irtwin.gap.data.case import case_of
from irtwin.gap.diagnosis import diagnose
from irtwin.gap.isolation.detectability import untestable
from irtwin.gap.search import variants
from irtwin.gap.thresholds import DEFAULT

ROBOT = arm(2)
WARM = "winding_temperature"


@pytest.fixture(scope="module")
def run():
    motion = measure(ROBOT, swing(ROBOT, 0, seconds=5.0), noise=0.1)
    return as_run(motion, temperature=np.full_like(motion.dq, 40.0))


WITHOUT_VISCOUS = tuple(effect for effect in BASELINE if effect != "viscous_friction")


@pytest.mark.parametrize(("altering", "signal", "twin", "tried"), [
    (WARM, "power", BASELINE, False),
    (WARM, "power", (*BASELINE, "copper_loss"), True),
    ("nonlinear_viscous_friction", "torque", WITHOUT_VISCOUS, False),
    ("nonlinear_viscous_friction", "torque", BASELINE, True),
    ("nonlinear_viscous_friction", "torque", (*WITHOUT_VISCOUS, "nonlinear_viscous_friction"), True),
])  # fmt: skip
def test_what_alters_an_effect_is_tried_in_a_twin_that_has_it(run, altering, signal, twin, tried):
    case = case_of(data_set(ROBOT, [run], twin), (), DEFAULT, None)
    assert (altering in {effect.id for effect in variants(case, signal)}) == tried


def test_an_effect_that_alters_what_the_twin_lacks_is_said(run):
    motions = case_of(data_set(ROBOT, [run], BASELINE), (), DEFAULT, None).seen
    channels = [("power", type("Nothing", (), {"hypotheses": (), "visible": np.zeros((0, 2))}))]
    (said,) = untestable([catalogue()[WARM]], BASELINE, channels, motions, DEFAULT.criterion)
    assert (said.effect, said.why) == (WARM, "the twin has no copper_loss, which it alters")


@pytest.mark.slow
@pytest.mark.parametrize(("gain", "told"), [(1.003, False), (1.03, True)])
def test_a_meter_that_is_off_by_less_than_its_class_is_no_cause(gain, told):
    robot, runs = with_constants(arm(2)), []
    for seed in range(4):
        motion = measure(robot, replace(swing(robot, seed, seconds=5.0), run=f"run_{seed}"), noise=0.03, seed=seed)
        runs.append(as_run(replace(motion, power=gain * motion.power)))
    said = diagnose(data_set(robot, runs, (*BASELINE, "copper_loss"))).document
    assert ("meter_gain" in {cause.effect for cause in said.causes}) == told
