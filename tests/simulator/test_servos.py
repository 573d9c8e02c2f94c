from __future__ import annotations

import re
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from tests import servo_arm

from irtwin.errors import InputError
from irtwin.simulator.play import play, whole
from irtwin.simulator.servos import NAMES, has_servos

SWING = {"a": servo_arm.swings(4, 1)}


def arm(folder, text=servo_arm.MODEL):
    return servo_arm.read(*servo_arm.write(folder, SWING, text))


def rewritten(own, numbers, folder):
    """Return the file that has numbers of a robot, and what is read of it."""
    file = folder / "new.xml"
    file.write_bytes(own.written(numbers, numbers != own.numbers))
    return file, servo_arm.read(folder / "data", file)[2]


def stepped(file, run, gears=1.0):
    """Return positions as MuJoCo itself steps a file under the commands of a run, times gears."""
    compiled = mujoco.MjModel.from_xml_path(str(file))
    moving, found = mujoco.MjData(compiled), np.empty_like(run.signals.q)
    for row, told in enumerate(run.signals.command):
        found[row], moving.ctrl[:] = moving.qpos, gears * told
        mujoco.mj_step(compiled, moving, round(0.02 / compiled.opt.timestep))
    return found


def test_a_models_servos_are_told_by_their_numbers(tmp_path):
    own = arm(tmp_path)[2]
    expected = [[20, 15], [0.9, 0.7], [0.05, 0.05], [0.9, 0.9], [0.02, 0.02], [0, 0], [0, 0], [5, 30 * np.pi]]
    np.testing.assert_allclose(own.numbers, np.vstack([expected, np.zeros((len(NAMES) - len(expected), 2))]))
    np.testing.assert_allclose(own.of_chart(own.chart(own.numbers)), own.numbers)


def test_what_differs_is_written_and_read_back(tmp_path):
    own = arm(tmp_path)[2]
    numbers = servo_arm.changed(
        own, stiffness=(12.5, 15), damping=(0.05, 0.3), friction=(0.05, 0.2), holding=(0.9999, 0.9),
        armature=(0.02, 0.1), offset=(0, 0.02), delay=(0.033, 0), torque_limit=(5, 2), spring=(1.5, 0),
    )  # fmt: skip
    file, again = rewritten(own, numbers, tmp_path)
    np.testing.assert_allclose(again.numbers, numbers, rtol=1e-12, atol=1e-15)
    text = file.read_text()
    assert '<joint name="lift" axis="0 1 0" damping="0.05" stiffness="1.5" solimpfriction="0.9999 0.9999"/>' in text
    assert "<!-- servos as the maker says -->" in text
    assert '<position joint="lift" kp="12.5" kv="0.0" ctrlrange="-1.5 1.5" forcerange="-5 5" delay=' in text
    assert '<general joint="elbow" ctrlrange="-1.5 1.5" gaintype="fixed"' in text


@pytest.mark.parametrize("late", [0.0100006, 0.02 - 4e-16, 0.0333])
def test_mujoco_has_a_delay_that_is_written_as_it_is_played(tmp_path, late):
    data, model = servo_arm.write(tmp_path, {"a": servo_arm.swings(2, 1)})
    data_set, _, own = servo_arm.read(data, model)
    numbers, (run,) = servo_arm.changed(own, delay=(late, 0.0)), data_set.runs
    found = stepped(rewritten(own, numbers, tmp_path)[0], run)
    np.testing.assert_allclose(found, play(own, [numbers], [whole(run)])[0][0][:, 0], atol=1e-9)


def test_a_tilt_is_written_as_gravity_where_the_file_has_options(tmp_path):
    text = servo_arm.MODEL.replace("<worldbody>", '<option gravity="0 0 -9.81"/><worldbody>')
    own = arm(tmp_path, text)[2]
    numbers = servo_arm.changed(own, tilt_x=(0.1, 0.1))
    gravity = rewritten(own, numbers, tmp_path)[1].model.compiled.opt.gravity
    np.testing.assert_allclose(gravity, 9.81 * np.array([0.0, np.sin(0.1), -np.cos(0.1)]), atol=1e-12)
    without = arm(tmp_path / "without")[2]
    assert without.written(numbers, numbers != own.numbers).decode() == servo_arm.MODEL


def test_a_file_with_no_number_changed_is_the_same_bytes(tmp_path):
    own = arm(tmp_path)[2]
    assert own.written(own.numbers, np.zeros(own.numbers.shape, dtype=bool)) == (tmp_path / "arm.xml").read_bytes()


def geared(text=servo_arm.MODEL):
    """The same arm by servos behind gears of 2 and -0.5, one of which has a filter and a rotor of its own."""
    lift = (
        '<general joint="lift" ctrlrange="-3 3" forcerange="-2.5 2.5" gear="2" gainprm="5" biastype="affine" '
        'biasprm="0.1 -5 -0.2"/>'
    )
    elbow = (
        '<position joint="elbow" gear="-0.5" ctrlrange="-0.75 0.75" forcerange="-8 6" kp="60" kv="2.4" '
        'timeconst="0.02" armature="0.04" damping="0.1 0.05 0.02"/>'
    )
    return re.sub("(?s)<actuator>.*</actuator>", f"<actuator>{lift}{elbow}</actuator>", text)


def test_a_servo_behind_a_gear_is_told_at_its_joint_and_played_as_mujoco_steps_it(tmp_path):
    data_set, model, own = arm(tmp_path, geared())
    expected = [[20, 15], [0.9, 0.7], [0.05, 0.05], [0.9, 0.9], [0.02, 0.02], [0.01, 0], [0, 0], [5, 4]]
    np.testing.assert_allclose(own.numbers[: len(expected)], expected, atol=1e-15)
    np.testing.assert_allclose(model.compiled.actuator_ctrlrange, [[-1.5, 1.5], [-1.5, 1.5]])
    assert own.clipped(np.array([[0.0, 1.0], [1.6, 0.0]])) == {"lift": 0.5}
    (run,) = data_set.runs
    found = stepped(model.file.path, run, np.array([2, -0.5]))
    assert np.abs(found).max() > 0.3
    np.testing.assert_allclose(play(own, [own.numbers], [whole(run)])[0][0][:, 0], found, atol=1e-9)


def test_a_damping_ratio_and_a_range_are_those_behind_the_gear(tmp_path):
    ratio = 'kp="5" gear="2" dampratio="0.7" ctrlrange="-3 3" forcerange="-2.5 2.5"/>'
    direct = 'kp="20" dampratio="0.7" ctrlrange="-1.5 1.5" forcerange="-5 5"/>'
    lift = 'kp="20" kv="0.8" ctrlrange="-1.5 1.5" forcerange="-5 5"/>'
    numbers = [arm(tmp_path / way, servo_arm.MODEL.replace(lift, new))[2].numbers for way, new in
               (("behind", ratio), ("direct", direct))]  # fmt: skip
    np.testing.assert_allclose(*numbers, rtol=1e-12)


def test_numbers_of_a_servo_behind_a_gear_are_written_as_its_file_has_them(tmp_path):
    own = arm(tmp_path, geared())[2]
    assert own.written(own.numbers, np.zeros(own.numbers.shape, dtype=bool)).decode() == geared()
    numbers = servo_arm.changed(
        own, stiffness=(12.0, 30.0), damping=(1.3, 0.5), offset=(0.02, -0.04), torque_limit=(3.0, 2.0)
    )
    file, again = rewritten(own, numbers, tmp_path)
    np.testing.assert_allclose(again.numbers, numbers, rtol=1e-12, atol=1e-15)
    text = file.read_text()
    assert 'gear="2"' in text and 'forcerange="-1.5 1.5"' in text and 'gainprm="3.0"' in text
    np.testing.assert_allclose(again.model.compiled.actuator_ctrlrange, [[-1.5, 1.5], [-1.5, 1.5]])


@pytest.mark.parametrize(
    "servo", ['<motor joint="lift"/>', '<velocity joint="lift" kv="1"/>', '<motor joint="lift" gear="2"/>']
)
def test_an_actuator_that_is_no_position_servo_is_refused(tmp_path, servo):
    first = servo_arm.MODEL.index('<position joint="lift"')
    text = servo_arm.MODEL[:first] + servo + servo_arm.MODEL[servo_arm.MODEL.index("/>", first) + 2 :]
    why = "joint lift is not driven by one position servo; its commands need one.*or kp of the joint in dataset.toml"
    with pytest.raises(InputError, match=why):
        arm(tmp_path, text)


def test_commands_beyond_the_models_range_are_counted(tmp_path):
    own = arm(tmp_path)[2]
    assert own.clipped(np.array([[0.0, 1.0], [0.0, 1.6], [0.0, -1.7], [1.0, 0.0]])) == {"elbow": 0.5}


OWN = '<dynamics damping="0.1" friction="0.05"/>'
BARE = servo_arm.MODEL.replace('armature="0.02"', 'armature="0"').replace(' forcerange="-5 5"', "")
UNDRIVEN = re.sub("(?s)<actuator>.*</actuator>", "", BARE)


def with_gains(tmp_path, model_text, suffix):
    """Return the data set that tells a controller's gains, and the servos of a model that has none."""
    data, _ = servo_arm.write(tmp_path, {"a": servo_arm.swings(4, 0)}, BARE)
    file = data / "dataset.toml"
    file.write_text(file.read_text().replace("[[run]]", f"{servo_arm.GAINS}[[run]]", 1), encoding="utf-8")
    model = tmp_path / f"told{suffix}"
    model.write_text(model_text, encoding="utf-8")
    return servo_arm.read(data, model)


@pytest.mark.parametrize(
    "text", [UNDRIVEN, re.sub('<position joint="(.*?)" [^>]*>', r'<motor joint="\1" gear="50"/>', BARE)]
)
def test_gains_that_are_told_make_servos_as_those_of_a_model(tmp_path, text):
    data_set, model, own = with_gains(tmp_path, text, ".xml")
    assert list(model.gains) == ["lift", "elbow"]
    servos_of_file = servo_arm.read(data_set.folder, tmp_path / "arm.xml")[2]
    runs = [whole(run) for run in data_set.runs]
    told, wanted = (play(one, [one.numbers], runs)[0][0] for one in (own, servos_of_file))
    np.testing.assert_allclose(told, wanted, atol=1e-9)


def test_a_urdf_with_gains_is_played_and_has_its_damping_written(tmp_path):
    text = servo_arm.URDF.replace("</joint>", f"{OWN}</joint>")
    _, model, own = with_gains(tmp_path, text, ".urdf")
    assert has_servos(model)
    np.testing.assert_allclose(own.numbers[:3], [[20.0, 15.0], [0.9, 0.7], [0.05, 0.05]])
    robots = servo_arm.changed(own, stiffness=(25.0, 15.0), damping=(0.9, 1.0), armature=(0.1, 0.0))
    new = own.written(robots, robots != own.numbers).decode()
    assert new == text[::-1].replace('damping="0.1"'[::-1], 'damping="0.4"'[::-1], 1)[::-1]
    assert own.unwritten(robots != own.numbers) == ["stiffness of lift", "armature of lift"]


def test_a_commanded_speed_takes_away_what_damping_of_a_controller_lags(tmp_path):
    data_set, _, own = with_gains(tmp_path, UNDRIVEN, ".xml")
    (run,) = data_set.runs
    time = run.signals.time
    told = 0.5 * np.sin(3 * time[:, None] * np.ones(2))
    speed = 1.5 * np.cos(3 * time[:, None] * np.ones(2))
    left = []
    for more in (None, speed):
        signals = replace(run.signals, q=told, command=told, command_speed=more)
        stretch = whole(replace(run, signals=signals))
        left.append(np.abs(play(own, [own.numbers], [stretch])[0][0][50:, 0] - told[50:]).max())
    assert left[1] < left[0] / 2
