"""Robots and logs out of the ordinary: a diagnosis of finite numbers, or one clear line."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.gap.test_diagnosis import valid
from tests.synthetic import arm, as_run, measure, swing

import diagnosis_speed
from irtwin.errors import InputError
from irtwin.gap.diagnosis import diagnose
from irtwin.report.gap.page import render_alone
from irtwin.robot.description import Robot
from irtwin.robot.urdf import parse_urdf
from irtwin.signals.log import DataSet, Run, read_data_set
from irtwin.twin.files import from_json, to_json

SLIDER = '<link name="{child}">{body}</link><joint name="{name}" type="prismatic"><parent link="{parent}"/>'
SLIDER += '<child link="{child}"/><axis xyz="{axis}"/><limit lower="-2" upper="2" velocity="2" effort="500"/></joint>'
BODY = '<inertial><mass value="4"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>'


def gantry(body: str = BODY) -> Robot:
    """Two level axes: neither gravity nor a floor has anything to say."""
    links = [SLIDER.format(name=f"axis_{a}", parent=p, child=c, axis=x, body=body) for a, p, c, x in AXES]
    return parse_urdf(f'<robot name="gantry"><link name="bed"/>{"".join(links)}</robot>')


AXES = (("x", "bed", "bridge", "1 0 0"), ("y", "bridge", "head", "0 1 0"))


def runs(robot: Robot, count: int = 4, seconds: float = 4.0, **changes) -> list[Run]:
    """Runs of a robot; `changes` alter signals by their name."""
    made = []
    for seed in range(count):
        motion = replace(measure(robot, swing(robot, seed, seconds), noise=0.2, seed=seed), run=f"run_{seed}")
        run = as_run(replace(motion, current=None))
        altered = {name: change(getattr(run.signals, name)) for name, change in changes.items()}
        made.append(replace(run, signals=replace(run.signals, **altered)))
    return made


def data_set(robot: Robot, made: list[Run]) -> DataSet:
    return DataSet(Path("odd"), robot, tuple(made), None, None, "mains", True, {})


@pytest.mark.nightly
def test_what_one_of_thirty_joints_lacks_is_named(tmp_path):
    diagnosis_speed.write(tmp_path / "chain", 9, 600, 30)
    found = diagnose(read_data_set(tmp_path / "chain")).document
    assert found.verdict == "attributed"
    assert [(one.effect, one.joints, one.scope) for one in found.causes] == [("cable_drag", ("joint_3",), "changed")]


def checked(robot: Robot, made: list[Run], tmp_path: Path) -> str:
    """Diagnose, and hold every number that leaves to be finite; return the verdict."""
    data = data_set(robot, made)
    found = diagnose(data)
    json.dumps([valid(found), found.evidence], allow_nan=False)
    from_json(to_json(found.twin), Path("twin.json"))
    render_alone(data, found.document, found.curves, tmp_path / "page.html")
    return found.verdict


def nothing(_values):
    return None


def one_stands(q):
    still = q.copy()
    still[:, -1] = 0.5
    return still


ROBOTS = {"one joint": arm(1), "a gantry": gantry(), "a gantry without masses": gantry("")}


@pytest.mark.slow
@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize(
    "robot", ["one joint", pytest.param("a gantry", marks=pytest.mark.nightly), "a gantry without masses"]
)
@pytest.mark.parametrize("lacking", ["power", "torque"])
def test_small_robots_are_diagnosed(robot, lacking, tmp_path):
    made = runs(ROBOTS[robot], 2, **{lacking: nothing})
    assert checked(ROBOTS[robot], made, tmp_path) in ("no_gap", "attributed", "ambiguous")


@pytest.mark.slow
@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize(
    "changes",
    [
        {"q": one_stands, "power": nothing},
        {"torque": lambda torque: 1e-300 * torque, "power": nothing},
        pytest.param(
            {"torque": lambda torque: np.clip(1e4 * torque, -1e6, 1e6), "power": nothing}, marks=pytest.mark.nightly
        ),
        {"torque": lambda torque: 20 * np.round(torque / 20), "power": nothing},
        {"torque": nothing, "power": lambda power: 1e-9 * power},
        {"torque": nothing, "power": np.negative},
    ],
    ids=["a joint stands", "tiny torque", "huge torque", "coarse torque", "tiny power", "power of the other sign"],
)
def test_odd_signals_are_diagnosed(changes, tmp_path, no_experiment):
    checked(arm(2), runs(arm(2), 2, **changes), tmp_path)


@pytest.mark.parametrize(
    ("changes", "seconds", "message"),
    [
        ({"torque": np.zeros_like, "power": nothing}, 6.0, "run_0.csv: the torque of joint_1, by column tau_joint_1"),
        ({"torque": lambda t: t * [1, 0], "power": nothing}, 6.0, "run_0.csv: the torque of joint_2, by column"),
        ({"power": lambda power: np.full_like(power, 80.0)}, 6.0, "run_0.csv: column power does not change"),
        ({"power": nothing}, 0.2, "the observed runs last 0.19 s together, too short to tell a gap from none"),
    ],
    ids=["no torque", "a dead channel", "constant power", "short runs"],
)
def test_what_would_pass_for_no_gap_is_refused(changes, seconds, message):
    with pytest.raises(InputError, match=message):
        diagnose(data_set(arm(2), runs(arm(2), 1, seconds, **changes)))


def test_fewer_samples_than_coefficients_are_refused():
    made = runs(arm(2), 1, 1.2, power=nothing)
    few = [replace(run, signals=run.signals.rows(slice(None, None, 6))) for run in made]
    with pytest.raises(InputError, match="samples are left of all runs to find 28 coefficients of the twin"):
        diagnose(data_set(arm(2), few))


@pytest.mark.parametrize(
    ("spoilt", "message"),
    [
        (('mass value="8.0"', 'mass value="1e300"'), 'arm_2: m of "link_1" is 1e+300 kg'),
        (('<origin xyz="0.03 0.02', '<origin xyz="0.03 1e150'), "arm_2: m"),
    ],
)
def test_bodies_that_no_robot_has_are_refused(spoilt, message):
    robot = parse_urdf(arm(2).urdf.replace(*spoilt))
    assert spoilt[1] in robot.urdf
    with pytest.raises(InputError, match=message.replace("+", ".") + ".* as no robot has; mend the URDF"):
        diagnose(data_set(robot, runs(arm(2), 2)))


def test_a_payload_that_no_robot_carries_is_refused():
    made = [replace(run, payload_mass=1e300) for run in runs(arm(2), 2)]
    with pytest.raises(InputError, match=r'run "run_0": the payload is 1e\+300 kg; give 0 to'):
        diagnose(data_set(arm(2), made))
