from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from tests.synthetic import arm, measure, swing

from irtwin.document.odd_stretch import OddStretch
from irtwin.effects.catalogue import BASELINE
from irtwin.effects.load import ExternalContact
from irtwin.effects.supply import HoldingBrakes
from irtwin.errors import InputError
from irtwin.twin.files import load, to_json
from irtwin.twin.identify import identify
from irtwin.twin.torque_scale import FittedTorqueScale
from irtwin.twin.twin import Choice

ROBOT = arm(3)
MOTION = measure(ROBOT, swing(ROBOT, 1), noise=0.3)
# from currents: the robot then carries torque constants that its URDF lacks
TWIN = identify(ROBOT, [replace(MOTION, torque=None)], ("rigid_body", "copper_loss", "torque_offset"))
KEPT = ("effects", "parameters", "base_parameters", "cutoff", "unidentified", "condition_number", "fitted")
MORE = {
    "odd_stretches": (OddStretch(run="run", start=1.0, stop=2.5, joints=("joint_2",)),),
    "torque_scale": FittedTorqueScale(0.1, "assumed", 0.95, 1.05, "torque of drives comes from nominal constants"),
    "choices": (
        Choice("copper_loss", ("joint_1",), True, 0.9, ("inverter_loss",), "W", 6.0, 3.0, 2.0, 1.0),
        Choice("iron_loss", (), False, 0.4),
    ),
}


def saved(folder, twin, change=lambda document: None):
    """The file of a twin, whose document is changed."""
    document = json.loads(to_json(twin))
    change(document)
    (folder / "twin.json").write_text(json.dumps(document))
    return folder / "twin.json"


def test_a_saved_twin_is_the_same_twin(tmp_path):
    (tmp_path / "twin.json").write_text(to_json(TWIN))
    again = load(tmp_path / "twin.json")
    for name in (*KEPT, "body_change"):
        assert getattr(again, name) == getattr(TWIN, name)
    np.testing.assert_allclose(again.covariance, TWIN.covariance)
    assert again.robot.joints == TWIN.robot.joints
    np.testing.assert_array_equal(again.torque(MOTION), TWIN.torque(MOTION))
    np.testing.assert_array_equal(again.power(MOTION), TWIN.power(MOTION))
    (tmp_path / "again.json").write_text(to_json(again))
    assert (tmp_path / "again.json").read_text() == (tmp_path / "twin.json").read_text()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["again.json", "twin.json"]


@pytest.mark.parametrize("name", MORE)
def test_a_saved_twin_says_more_where_it_is_known(tmp_path, name):
    assert getattr(TWIN, name) != MORE[name]
    assert getattr(load(saved(tmp_path, replace(TWIN, **{name: MORE[name]}))), name) == MORE[name]


CONTACT = {"id": "external_contact", "joints": None, "runs": None}


def spoil(document, *keys, value=None, drop=False):
    *way, last = keys
    for key in way:
        document = document[key]
    if drop:
        del document[last]
    else:
        document[last] = value


@pytest.mark.parametrize(
    "keys, change, message",
    [
        (("format",), {"value": "gcode"}, '"format" is not "irtwin twin"; name a twin that irtwin saved'),
        (("version",), {"value": 9}, '"version" is not 1; identify the twin again'),
        (("effects",), {"drop": True}, "twin.effects must be an array"),
        (("effects",), {"value": ["rigid_body", "magic"]}, 'there is no effect "magic"'),
        (("effects",), {"value": [3]}, "twin.effects[0] must be an id"),
        (("cutoff",), {"value": "fast"}, "twin.cutoff must be a finite number"),
        (("robot",), {"value": []}, "twin.robot must be an object"),
        (("robot", "urdf"), {"value": "<robot"}, "URDF in it, line 1"),
        (("robot", "joints", "joint_2"), {"drop": True}, "twin.robot.joints.joint_2 must be given"),
        (("parameters", 3, "value"), {"value": None}, "twin.parameters[3].value must be a finite number"),
        (("parameters", 3, "value"), {"value": float("nan")}, "parameters[3].value must be a finite number"),
        (("parameters", 0), {"value": 5}, "twin.parameters[0] must be an object"),
        (("covariance",), {"value": ["1.0"]}, "twin.covariance must be an array of"),
        (("covariance", 1), {"value": "1.0 x"}, "twin.covariance[1] must be 2 finite numbers"),
        (("covariance", 1), {"value": "1.0 nan"}, "twin.covariance[1] must be 2 finite numbers"),
        (("parameters", 0), {"drop": True}, 'parameter m of effect "rigid_body" on link_1 is missing'),
        (("torque_scale", "low"), {"value": "small"}, "torque_scale.low must be a finite number; save the twin again"),
        (("choices", 1, "chosen"), {"value": "no"}, "twin.choices[1].chosen must be a boolean"),
        (("effects", 0), {"value": CONTACT | {"shape": {}}}, "twin.effects[0].shape"),
        (("effects", 0), {"value": CONTACT | {"shape": {"start": "early", "stop": 1.0}}}, "twin.effects[0].shape"),
    ],
)
def test_what_is_wrong_with_a_file_is_named(tmp_path, keys, change, message):
    path = saved(tmp_path, replace(TWIN, **MORE), lambda document: spoil(document, *keys, **change))
    with pytest.raises(InputError) as error:
        load(path)
    assert message in str(error.value)
    assert str(path) in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        *((content, ".*name a twin that irtwin saved") for content in (b"", b"{", b"[]")),
        (b"\xff\xfe", ".*not UTF-8 text"),
        (b"[" * 200_000, ": not JSON"),
    ],
    ids=["empty", "cut off", "a list", "bytes", "JSON in JSON without end"],
)
def test_files_that_are_no_twin(tmp_path, content, said):
    (tmp_path / "twin.json").write_bytes(content)
    with pytest.raises(InputError, match=rf"twin\.json{said}"):
        load(tmp_path / "twin.json")
    with pytest.raises(InputError, match=r"none\.json: cannot be read"):
        load(tmp_path / "none.json")


def test_an_effect_of_a_shape_is_written_with_it(tmp_path):
    shaped = ExternalContact(start=-np.inf, stop=4.0, joints=("joint_2",), runs=("swing_1",))
    path = saved(tmp_path, identify(ROBOT, [MOTION], (*BASELINE, shaped)))
    shape = {"start": "-inf", "stop": 4.0}
    said = {"id": "external_contact", "joints": ["joint_2"], "runs": ["swing_1"], "shape": shape}
    assert json.loads(path.read_text())["effects"] == [*BASELINE, said]
    assert load(path).effects[-1] == shaped


@pytest.mark.slow
def test_brakes_of_a_former_release_open_as_a_joint_moves(tmp_path):
    braked = ("standby_power", "mechanical_power", "rigid_body", HoldingBrakes(delay=0.3))
    path = saved(tmp_path, identify(ROBOT, [MOTION], braked), lambda said: said["effects"][-1]["shape"].pop("lead"))
    assert HoldingBrakes(delay=0.3, lead=0.0) in load(path).stack.effects
