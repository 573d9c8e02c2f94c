"""Logs of commands and positions beside a model, from the command line."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest
from tests import gap_cases, servo_arm
from tests.data_sets import irtwin, irtwin_does, irtwin_refuses

from irtwin.document.document import Change, Document
from irtwin.errors import InputError
from irtwin.report.gap.summary import line
from irtwin.simulator.play import play, whole
from irtwin.simulator.playing import commanded_runs, diagnose
from irtwin.simulator.writing import together


def logs(folder, change=None, text=servo_arm.MODEL, runs=("a", "b"), seconds=4, **numbers):
    """Write a data set that a robot of some numbers made, and the model."""
    told = {name: servo_arm.swings(seconds, seed) for seed, name in enumerate(runs)}
    data, model = servo_arm.write(folder, told)
    data_set, _, own = servo_arm.read(data, model)
    made = servo_arm.played(data_set, own, servo_arm.changed(own, **numbers))
    for run in made.runs:
        servo_arm.log(run.file, data_set.robot, run.signals)
        if change:
            pa.parquet.write_table(change(pa.parquet.read_table(run.file)), run.file)
    model.write_text(text, encoding="utf-8")
    return data, model


@pytest.fixture(scope="module")
def told(tmp_path_factory):
    folder = tmp_path_factory.mktemp("playing")
    data, model = logs(folder, stiffness=(20.0, 10.0))
    new, out = folder / "new.xml", folder / "out.json"
    said = irtwin(
        "diagnose", data, "--simulator", model, "--save-simulator", new, "--json", out, "--workspace", folder / "w",
        "--save-sysid", folder / "fit.py",
    )  # fmt: skip
    return said, data, model, new, out


@pytest.mark.slow
def test_the_number_that_differs_is_told_and_written(told):
    said, data, model, new, _ = told
    assert said.status == 0, said.err
    number = (
        r"attributed: The robot has other numbers than the simulator: stiffness of elbow \d+(\.\d)? N m/rad in place"
    )
    assert re.search(number, " ".join(said.out.split())), said.out
    assert "Drive of elbow differs from the simulator’s" in said.out
    closed = r"numbers in the simulator close (9\d(\.\d+)?|100) % .*held-out runs"
    assert re.search(closed, " ".join(said.out.split())), said.out
    assert re.search(r"tracking error \(RMSE\) │ 0\.\d+ │ 0\.0009\d* │", said.out), said.out
    assert re.search(r"stiffness │ +15 │ +10(\.\d)? │ +-[45]", said.out), said.out
    assert "s since it was begun anew" in said.out
    changed = servo_arm.read(data, new)[2].numbers
    assert changed[0] == pytest.approx([20.0, 10.0], rel=0.02)
    assert len(set(model.read_text().splitlines()) - set(new.read_text().splitlines())) == 1
    handed_over = (model.parent / "fit.py").read_text()
    assert handed_over.count("('elbow', 'kp', [15.0], [") == 1
    assert "MODEL, LOGS, FITTED = 'arm.xml', 'data', 'fit-fitted.xml'" in handed_over


@pytest.mark.nightly
@pytest.mark.slow
def test_a_soft_joint_that_no_file_holds_is_written_by_the_numbers_that_come_nearest(tmp_path):
    data, model = logs(tmp_path, link_compliance=(0.0, 0.05))
    new = tmp_path / "new.xml"
    said = irtwin_does("diagnose", data, "--simulator", model, "--save-simulator", new)
    assert "joint elasticity" in said.out
    assert f"{new} has no place for a soft joint: it has the others of its numbers that come nearest" in said.err
    assert "with it; a file that is written has the others that come nearest" in " ".join(said.out.split())
    data_set = servo_arm.read(data, model)[0]
    left = []
    for file in (model, new):
        own = servo_arm.read(data, file)[2]
        left.append([np.abs(run.signals.q - play(own, [own.numbers], [whole(run)])[0][0][:, 0]).mean()
                     for run in data_set.runs])  # fmt: skip
    assert np.mean(left[1]) < 0.7 * np.mean(left[0])


@pytest.mark.slow
def test_the_document_says_simulator_robot_and_change(told):
    document = Document.from_json(json.loads(told[4].read_text()))
    (cause,) = document.causes
    assert (cause.id, cause.joints, cause.likely) == ("servo_stiffness@elbow", ("elbow",), True)
    (number,) = cause.parameters
    assert (number.joint, number.simulator, number.unit) == ("elbow", 15.0, "N m/rad")
    assert number.robot - number.simulator == pytest.approx(number.value)
    assert number.interval95[0] < -5.0 < number.interval95[1]
    assert document.simulator == "arm"
    assert document.gap.position["elbow"].rmse > document.shrink.position_rmse.after
    assert document.shrink.position_rmse.after < 1.2e-3 < document.shrink.position_rmse.before
    assert [one.seconds for one in document.horizons] == [0.1, 0.2, 0.3, 0.4, 0.5]
    (finding,) = document.findings
    assert finding.share_interval95[0] < finding.share <= finding.share_interval95[1]


@pytest.mark.slow
def test_runs_that_are_held_out_judge_what_the_others_say(tmp_path):
    data, model = logs(tmp_path, stiffness=(20.0, 10.0), runs=("a", "b", "c"))
    data_set, arm, own = servo_arm.read(data, model)
    other = servo_arm.played(data_set, own, servo_arm.changed(own, stiffness=(20.0, 7.0)))
    servo_arm.log(data_set.runs[2].file, data_set.robot, other.runs[2].signals)
    found = diagnose(servo_arm.read(data, model)[0], arm, held_out_runs=["c"])
    (number,) = found.document.causes[0].parameters
    assert number.robot == pytest.approx(10.0, rel=0.02)
    assert found.document.shrink.held_out_runs == ("c",)
    assert {of.run for of in found.curves.runs} == {"c"}
    assert found.document.shrink.position_rmse.after > 5e-3  # as c is of another robot


@pytest.mark.parametrize(("held_out", "options", "words"), [
    (["d"], (), 'no observed run is named "d"; there are a, b'),
    (["a", "b"], (), "all runs are held out; leave some to fit to"),
    (["a"], ("--save-sysid", "fit.py"), "the script fits all runs; hold none out for it"),
])  # fmt: skip
def test_runs_that_cannot_be_held_out_are_told(held_out, options, words, tmp_path):
    data, model = logs(tmp_path)
    options = [*options, *(word for run in held_out for word in ("--held-out", run))]
    assert words in irtwin_refuses("diagnose", data, "--simulator", model, *options).err


def test_nothing_is_held_out_where_nothing_is_played(tmp_path):
    data_set, _ = with_torque(tmp_path)
    for run in data_set.runs:
        servo_arm.log(run.file, data_set.robot, run.signals)
    said = irtwin_refuses("diagnose", tmp_path / "data", "--held-out", "a")
    assert "runs are held out where logs are played: this needs commands (cmd_JOINT) in all runs" in said.err


@pytest.mark.slow
def test_the_page_of_a_workspace_says_it_too(told):
    page = (told[1].parent / "w" / "reports" / "arm.gap.html").read_text()
    for said in ("Tracking error of each run", "differs from the simulator’s", "servo stiffness", "Simulator</th>"):
        assert said in page
    assert page.count('class="ia-picture"') == 2
    off = re.findall(r"<figcaption>(The simulator as it is|With the robot’s numbers): ([\d.]+)\s*mm off", page)
    assert [one for one, _ in off] == ["The simulator as it is", "With the robot’s numbers"]
    assert float(off[0][1]) > 5 * float(off[1][1])
    said = irtwin_refuses("improve", "arm", "--workspace", told[1].parent / "w")
    assert "its diagnosis (attributed) added nothing to the twin" in said.err


def test_what_is_left_is_within_its_interval_in_any_unit():
    """Also where squares are above one, as of torques in N m."""
    squares = np.array([[4.0, 6.0], [8.0, 10.0], [5.0, 3.0]])
    small, large = (together(4 * scale * squares, scale * squares) for scale in (1e-6, 1.0))
    assert large.after == pytest.approx(6**0.5)
    assert large.interval95_after[0] < large.after < large.interval95_after[1]
    assert large.interval95_after == pytest.approx([1e3 * end for end in small.interval95_after])
    assert together(squares[:1], squares[:1]).interval95_after is None


def test_a_simulator_that_is_right_agrees():
    change = Change(before=1.04e-3, after=1.04e-3, noise_floor=None, interval95_after=None)
    document = gap_cases.document("no_gap")
    right = replace(
        document, findings=(), causes=(), shrink=replace(document.shrink, by_cause=(), position_rmse=change)
    )
    assert line(right, "simulated") == (
        "no_gap: There is no gap: the simulator agrees with the robot, to 1.04 mrad RMS."
    )


@pytest.mark.nightly
@pytest.mark.slow
def test_a_small_change_is_told_beside_a_joint_that_falls(tmp_path):
    numbers = {"torque_limit": (0.52, 30 * np.pi), "armature": (0.02, 0.06)}
    data, model = logs(tmp_path, text=servo_arm.STOPPED, seconds=6, **numbers)
    data_set, arm, _ = servo_arm.read(data, model)
    falls, wrist = diagnose(data_set, arm).document.causes
    assert (falls.id, wrist.id) == ("servo_torque_limit@lift", "rotor_inertia@elbow")
    assert falls.parameters[0].robot == pytest.approx(0.52, rel=0.05)
    assert wrist.parameters[0].robot == pytest.approx(0.06, rel=0.02)
    assert not falls.folded_away
    assert not wrist.folded_away  # though it closes 1 % of the whole arm's error


def in_degrees(table):
    place = table.column_names.index("cmd_lift")
    return table.set_column(place, "cmd_lift", pa.array(np.degrees(table["cmd_lift"].to_numpy())))


def without_commands(table):
    return table.drop_columns(["cmd_lift", "cmd_elbow"])


def stuck(table):
    place, told = table.column_names.index("q_lift"), table["cmd_lift"].to_numpy()
    jitter = 0.1 * np.random.default_rng(1).standard_normal(len(told))
    return table.set_column(place, "q_lift", pa.array(np.radians(told) + jitter))


def test_commands_of_a_joint_that_is_stuck_are_not_taken_for_degrees(tmp_path):
    data, model = logs(tmp_path, change=stuck)
    irtwin_does("diagnose", data, "--simulator", model)


@pytest.mark.parametrize(("alter", "words"), [
    (lambda run: replace(run, role="reference"), "no run is observed; there is nothing to hold the model against"),
    (lambda run: replace(run, signals=replace(run.signals, command=None)), "a.parquet: has no commands to play; log"),
])  # fmt: skip
def test_observed_runs_with_commands_are_needed(alter, words, tmp_path):
    data_set = servo_arm.read(*logs(tmp_path))[0]
    with pytest.raises(InputError, match=words):
        commanded_runs(replace(data_set, runs=tuple(map(alter, data_set.runs))))


@pytest.mark.parametrize(
    ("change", "calls", "options", "told"),
    [
        (in_degrees, "elbow", (), "a.parquet: column cmd_lift is in degrees beside positions in rad"),
        (
            without_commands, "elbow", (),
            "has neither torque nor power; log tau_, i_ or power, or cmd_, the commands that the model is to play",
        ),
        (
            None, "elbow", ("--save-twin", "twin.json"),
            "has commands and no torque: a twin's file is of no use for it; leave that out",
        ),
        (
            None, "knee", (),
            "has no joint elbow; its joints are lift, knee: say what it calls the robot's: --joints lift,knee",
        ),
    ],
    ids=["commands in degrees", "logs without commands", "what needs torque", "a model of other joints"],
)  # fmt: skip
def test_what_cannot_be_played_is_refused(change, calls, options, told, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    data, model = logs(tmp_path, change, servo_arm.MODEL.replace('"elbow"', f'"{calls}"'))
    said = irtwin("diagnose", data, "--simulator", model, *options)
    assert (said.status, told in said.err) == (2, True)
    assert said.err.strip().count("\n") <= 3  # the lines of its steps, and one of the error


def test_without_a_model_a_log_of_commands_is_told_what_it_is_good_for(tmp_path):
    data, _ = logs(tmp_path)
    for command in ("diagnose", "run"):
        said = irtwin_refuses(command, data, *(["--workspace", tmp_path / "w"] if command == "run" else []))
        assert "its commands can be held against a model: irtwin diagnose DATASET --simulator MODEL.xml" in said.err


def test_torque_without_its_sign_is_said_and_left_out(tmp_path):
    def with_size(table):
        return table.append_column("tau_abs_lift", pa.array(np.ones(len(table))))

    data, _ = logs(tmp_path, with_size)
    said = irtwin_does("check", data)
    assert said.err.count("tau_abs_JOINT is torque without its sign") + said.out.count("without its sign") == 1


@pytest.mark.slow
def test_commands_that_the_model_clips_and_joints_that_the_robot_lacks_are_said(tmp_path):
    text = servo_arm.MODEL.replace("-1.5 1.5", "-0.8 0.8", 1)
    door = '<body><joint name="door"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody>'
    data, model = logs(tmp_path, text=text.replace("</worldbody>", door))
    said = irtwin("diagnose", data, "--simulator", model)
    assert f"{model}: joints that the robot lacks are told nothing: door\n" in said.err
    clips = r"read: lift: \d(\.\d+)? % of its commands are beyond the model's ctrlrange, which clips them"
    assert re.search(clips, " ".join(said.out.split())), said.out


def test_a_model_that_clips_many_commands_is_refused(tmp_path):
    data, model = logs(tmp_path, text=servo_arm.MODEL.replace("-1.5 1.5", "-0.1 0.1", 1))
    said = irtwin_refuses("diagnose", data, "--simulator", model)
    assert re.search(
        r"lift: \d\d % of its commands are beyond the model's ctrlrange.*; correct ctrlrange, or", said.err
    )


def with_torque(folder, **numbers):
    """Return a data set whose runs have commands, positions and torque, and a model that it is held against."""
    told = {name: servo_arm.swings(4, seed) for seed, name in enumerate("ab")}
    data_set, model, own = servo_arm.read(*servo_arm.write(folder, told))
    return servo_arm.played(data_set, own, servo_arm.changed(own, **numbers), torque_noise=5e-3), model


@pytest.mark.nightly
@pytest.mark.slow
def test_torque_says_what_motion_leaves_open(tmp_path):
    found = diagnose(*with_torque(tmp_path, delay=(0.04, 0.0), stiffness=(20.0, 12.0)))
    assert {one.id for one in found.document.causes} == {"command_delay@lift", "servo_stiffness@elbow"}
    numbers = found.document.causes[0].parameters + found.document.causes[1].parameters
    assert sorted(one.robot for one in numbers) == pytest.approx([0.04, 12.0], rel=0.01)
    assert found.document.gap.torque["elbow"].rmse > 0.05
    assert found.document.shrink.torque_rmse.after < 6e-3 < found.document.shrink.torque_rmse.before
    energy = found.document.shrink.energy_error_percent
    assert energy.before == found.document.gap.energy_error_percent > 1.0 > energy.after
    assert energy.interval95_after[0] <= energy.after <= energy.interval95_after[1]
    assert not found.is_open


@pytest.mark.slow
def test_where_no_number_differs_a_torque_that_stays_is_left_open(tmp_path):
    data_set, model = with_torque(tmp_path)
    rippled = [
        replace(run, signals=replace(run.signals, torque=run.signals.torque + 0.3 * np.sin(9 * run.signals.q)))
        for run in data_set.runs
    ]
    assert diagnose(replace(data_set, runs=tuple(rippled)), model).is_open


@pytest.mark.slow
def test_who_asks_for_a_twin_is_answered_from_the_torque(tmp_path):
    data_set, _ = with_torque(tmp_path)
    for run in data_set.runs:
        servo_arm.log(run.file, data_set.robot, run.signals)
    said = irtwin_does(
        "diagnose", tmp_path / "data", "--simulator", tmp_path / "arm.xml", "--save-twin", tmp_path / "t.json"
    )
    assert "Playing" not in said.err
    assert (tmp_path / "t.json").exists()
