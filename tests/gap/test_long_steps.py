from __future__ import annotations

import pytest
from tests.gap.test_diagnosis import WITH_LOSS, data_set, runs
from tests.synthetic import arm

from irtwin.gap.diagnosis import diagnose
from irtwin.identification import progress

ROBOT = arm(3)
STEPS = {
    "case": "friction near zero speed of each joint",
    "twin": "the twin without",
    "remainders": "what is left of",
    "contacts": "contacts in",
    "windows": "windows of",
    "ripples": "ripples of",
    "places of effects": "places of",
    "trials": "hypotheses tried for the next cause",
    "judged": "how far the gap closes without a group",
    "shares": "causes leave",
    "estimate": "coefficients, weighed",
    "residual": "torque that is left of",
    "followed": "what torque follows at",
}


pytestmark = pytest.mark.nightly


@pytest.fixture(scope="module")
def lines():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(progress, "_EVERY", 0.0)
        said: list[str] = []
        with progress.telling(said.append):
            diagnose(data_set(runs(robot=ROBOT), ROBOT, WITH_LOSS), withhold=["coulomb_friction"])
    return said


@pytest.mark.parametrize("step", STEPS)
def test_each_long_step_says_how_far_it_has_come(lines, step):
    assert any(STEPS[step] in line for line in lines)
