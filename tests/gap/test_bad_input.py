"""What `irtwin diagnose` says of data that it cannot diagnose: one line, status 2, nothing written."""

from __future__ import annotations

import json
import signal
from dataclasses import replace

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from tests.data_sets import irtwin_does, irtwin_refuses, write
from tests.forks import Command
from tests.synthetic import arm, as_run, heavier, measure, swing

from irtwin.signals.log import Run

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("no_experiment")]

ROBOT = arm(3)
SIX = arm(6)
HEAVY = heavier(SIX, 6.0)


def runs(role: str = "observed", seeds: range = range(4), robot=ROBOT, noise: float = 0.3, **changes) -> list[Run]:
    """Runs of an arm; `changes` replace signals, or alter them where they are functions."""
    made = []
    for seed in seeds:
        motion = replace(measure(robot, swing(robot, seed, seconds=8.0), noise=noise, seed=seed), current=None)
        run = as_run(replace(motion, run=f"{role}_{seed}"))
        altered = {name: change(getattr(run.signals, name)) for name, change in changes.items()}
        made.append(replace(run, role=role, signals=replace(run.signals, **altered)))
    return made


def nothing(_values):
    return None


def still(q):
    return 0.3 + 1e-5 * np.random.default_rng(0).standard_normal(q.shape)


REFUSED = {
    "only reference runs": (lambda: runs("reference"), 'dataset.toml: no run has role = "observed"'),
    "neither torque nor power": (
        lambda: runs(torque=nothing, power=nothing),
        "observed_0.parquet: has neither torque nor power; log tau_, i_ or power",
    ),
    "too short": (
        lambda: [replace(run, signals=run.signals.rows(slice(26))) for run in runs(seeds=range(3))],
        "dataset.toml: the observed runs last 0.75 s together, too short to tell a gap from none; log at least 1 s",
    ),
    "nothing moves": (lambda: runs(q=still), "dataset.toml: no joint moves in any observed run; log runs in motion"),
    "nothing in common": (
        lambda: [*runs("reference", torque=nothing), *runs(seeds=range(5, 9), power=nothing)],
        "dataset.toml: the reference runs share neither torque nor power with the observed runs; log one",
    ),
    "one run twice": (
        lambda: [*runs(seeds=range(3)), replace(runs(seeds=range(1))[0], name="again")],
        "again.parquet: is a copy of",
    ),
    "reference of another robot": (
        lambda: [*runs("reference", robot=HEAVY), *runs(seeds=range(5, 9), robot=SIX)],
        "reference_0.parquet: the torque of the reference runs is nothing like that of the observed runs (on joint_2",
    ),
    "reference of the other sign": (
        lambda: [*runs("reference", torque=np.negative), *runs(seeds=range(5, 9))],
        "reference_0.parquet: the sign of tau_joint_1, tau_joint_2, tau_joint_3 is reversed in the reference runs",
    ),
    "one joint of the other sign": (
        lambda: [*runs("reference"), *runs(seeds=range(5, 9), torque=lambda tau: tau * [1, -1, 1])],
        "observed_5.parquet: the sign of tau_joint_2 is reversed in the observed runs",
    ),
    "simulator in another unit": (
        lambda: [*runs("simulated", torque=lambda tau: -1000 * tau), *runs(seeds=range(5, 9))],
        "the torque of the simulated runs is nothing like that of the observed runs",
    ),
}


@pytest.mark.parametrize("fault", REFUSED)
def test_what_cannot_be_diagnosed_is_refused(fault, tmp_path):
    made, message = REFUSED[fault]
    listed = made()
    data = write(tmp_path / "data", arm(listed[0].signals.q.shape[1]), listed)
    out = tmp_path / "out"
    files = ["--json", out / "out.json", "--report", out / "out.html", "--save-twin", out / "twin.json"]
    said = irtwin_refuses("diagnose", data, *files, "--workspace", out / "workspace")
    assert message in said.err.splitlines()[-1]
    assert str(data) in said.err.splitlines()[-1]
    assert not out.exists()


@pytest.mark.parametrize(
    ("tail", "options", "message"),
    [
        ("", ["--withhold", "phlogiston"], "--withhold phlogiston: there is no such effect; choose from rigid_body"),
        ("", ["--withhold", "copper_loss"], "--withhold copper_loss: the twin does not have this effect; it has"),
        ('[twin]\neffects = ["rigid_body", "phlogiston"]', [], '[twin] effects: there is no effect "phlogiston"'),
        ('[twin]\neffects = "rigid_body"', [], "dataset.toml: [twin] effects should be a list of effect ids"),
    ],
)
def test_an_unknown_effect_is_refused(tail, options, message, tmp_path):
    data = write(tmp_path / "data", ROBOT, runs(seeds=range(2)), tail=tail)
    said = irtwin_refuses("diagnose", data, "--json", tmp_path / "out.json", *options)
    assert message in said.err.splitlines()[-1]
    assert not (tmp_path / "out.json").exists()


def test_a_reference_run_with_other_joints_is_refused(tmp_path):
    data = write(tmp_path / "data", ROBOT, [*runs("reference", range(1)), *runs()])
    file = data / "runs" / "reference_0.parquet"
    renamed = pq.read_table(file)
    pq.write_table(renamed.rename_columns([n.replace("joint_3", "elbow") for n in renamed.column_names]), file)
    said = irtwin_refuses("diagnose", data, "--json", tmp_path / "out.json")
    assert 'reference_0.parquet: column q_elbow: the robot has no moving joint "elbow"' in said.err


def test_bad_samples_are_named_and_repaired(tmp_path):
    holed = runs(seeds=range(2), power=nothing)
    holed[0].signals.torque[[5, 700], 1] = [np.nan, 1e282]
    data = write(tmp_path / "data", ROBOT, holed)
    said = irtwin_refuses("diagnose", data, "--json", tmp_path / "out.json")
    assert "observed_0.parquet, row 5, column tau_joint_2: is not a finite number; correct it, or use" in said.err
    said = irtwin_does("diagnose", data, "--json", tmp_path / "out.json", "--repair")
    assert "samples dropped, column tau_joint_2 is not a finite number: row 5" in said.err
    assert "samples dropped, column tau_joint_2 is beyond 1e+06, which no robot reaches: row 700" in said.err
    assert json.loads((tmp_path / "out.json").read_text())["gap"]["torque"]["joint_2"]["rmse"] < 1.0


def diagnosed(folder, made):
    """The document of a diagnosis of these runs."""
    irtwin_does("diagnose", write(folder / "data", ROBOT, made), "--json", folder / "out.json")
    return json.loads((folder / "out.json").read_text())


def test_what_was_not_measured_is_not_testable(tmp_path):
    made = [*runs("reference"), *runs(seeds=range(5, 9), power=nothing)]
    document = diagnosed(tmp_path, made)
    assert document["gap"].get("power") is None
    why = {one["effect"]: one["why"] for one in document["not_testable"]}
    assert why["copper_loss"] == "no power was measured"
    assert why["temperature_dependent_friction"] == "no temperature was measured"
    assert not {cause["effect"] for cause in document["causes"]} & set(why)


def test_one_run_shows_no_effect_that_differs_between_runs(tmp_path):
    document = diagnosed(tmp_path, runs(seeds=range(1), power=nothing))
    assert document["verdict"] == "no_gap"
    assert "payload" in {one["effect"] for one in document["not_testable"]}


@pytest.mark.parametrize("option", ["--json", "--report", "--save-twin"])
def test_places_are_checked_before_the_work(option, tmp_path):
    (tmp_path / "file").write_text("")
    data = write(tmp_path / "data", ROBOT, runs(seeds=range(1)))
    places = {"--json": tmp_path / "out.json"} | {option: tmp_path / "file" / "out"}
    said = irtwin_refuses("diagnose", data, *[part for pair in places.items() for part in pair])
    assert f"{tmp_path}/file/out: cannot be written" in said.err
    assert "Reading" not in said.err
    assert not (tmp_path / "out.json").exists()


def test_stopped_half_way_nothing_is_left(tmp_path):
    data = write(tmp_path / "data", ROBOT, runs())
    files = ["--json", "out/out.json", "--report", "out/out.html", "--save-twin", "out/twin.json"]
    process = Command("diagnose", data, *files, folder=tmp_path)
    for line in process.stderr:
        if "every effect" in line:
            process.send_signal(signal.SIGINT)
            break
    _, rest = process.communicate()
    assert process.returncode == 130
    assert "irtwin: stopped" in rest
    assert "Traceback" not in rest
    assert [path.name for path in tmp_path.iterdir()] == ["data"]


def test_the_time_column_of_nulls_is_no_traceback(tmp_path):
    data = write(tmp_path / "data", ROBOT, runs(seeds=range(1)))
    file = data / "runs" / "observed_0.parquet"
    table = pq.read_table(file)
    pq.write_table(table.set_column(0, "time", pa.nulls(table.num_rows, pa.float64())), file)
    for options in ([], ["--repair"]):
        said = irtwin_refuses("diagnose", data, "--json", tmp_path / "out.json", *options)
        assert "observed_0.parquet" in said.err.splitlines()[-1]
