"""Planned runs: kept with what they will take, beside what was measured, and counted in no sum of it."""

from __future__ import annotations

import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
import sqlalchemy
from sqlalchemy import select

from irtwin import asking, plans, workflow
from irtwin.errors import InputError
from irtwin.knowledge.shacl.validation import validate
from irtwin.location import Location
from irtwin.planning.plan import Task
from irtwin.providers.records import ingest
from irtwin.rewriting import rewriting
from irtwin.signals.channels import Signals, csv_text, from_columns
from irtwin.signals.log import Run, read_data_set
from irtwin.signals.motion import Motion
from irtwin.storage import schema
from irtwin.storage.database import Workspace
from irtwin.storage.staging import staged
from tests import data_sets
from tests.data_sets import Said, irtwin, refused, refused_in_a_line
from tests.synthetic import arm, as_run, measure, swing, with_constants

pytestmark = pytest.mark.slow

ROBOT = with_constants(arm(2))
EFFECTS = '[twin]\neffects = ["rigid_body", "rotor_inertia", "coulomb_friction", "viscous_friction", "torque_offset", '
EFFECTS += '"mechanical_power", "copper_loss", "standby_power"]'
GOAL = ("--from", "0,0", "--to", "1,-1")


def recorded() -> list[Run]:
    return [as_run(measure(ROBOT, swing(ROBOT, seed, seconds=8.0), noise=0.02)) for seed in (1, 2, 3)]


def carried_out(file: Path) -> Run:
    """The run of a robot that does what a planned motion's file says, and stands for a second before and after."""
    table = pq.read_table(file)
    signals = from_columns({name: table[name].to_numpy() for name in table.column_names}, ROBOT.joint_names)
    step = signals.time[1] - signals.time[0]
    still = round(1.0 / step)
    q = np.concatenate([np.repeat(signals.q[:1], still, 0), signals.q, np.repeat(signals.q[-1:], still, 0)])
    time = np.arange(len(q)) * step
    dq = np.gradient(q, step, axis=0)
    done = Motion(time, q, dq, np.gradient(dq, step, axis=0), run="done")
    return as_run(measure(ROBOT, done, noise=0.02))


def write(folder: Path, runs: list[Run], changes: dict[str, str] | None = None) -> Path:
    """Write a data set in whose text, but for its twin, some is said otherwise."""
    logs = data_sets.write(folder, ROBOT, runs, tail=EFFECTS)
    toml = (logs / "dataset.toml").read_text()
    for before, after in (changes or {}).items():
        assert before in toml
        toml = toml.replace(before, after, 1)
    (logs / "dataset.toml").write_text(toml)
    return logs


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Said]:
    """A workspace with a robot whose plan "reach" is kept, and what the command said."""
    folder = tmp_path_factory.mktemp("plans")
    workflow.run(write(folder / "logs", recorded()), folder / "workspace")
    said = irtwin("plan", "arm_2", *GOAL, "--workspace", folder / "workspace", "--out", folder / "reach.parquet")
    return folder, said


@pytest.fixture(scope="module")
def performed(kept: tuple[Path, Said]) -> Path:
    """The workspace after the robot carried the plan out; its data set has a plan of its own."""
    folder, _ = kept
    changes = {
        'file = "runs/done.parquet"': 'file = "runs/done.parquet"\nperforms = "reach"',
        "[twin]": '[[run]]\nfile = "runs/later.parquet"\nrole = "planned"\n\n[twin]',
    }
    logs = write(folder / "logs_2", [*recorded(), carried_out(folder / "reach.parquet")], changes)
    shutil.copy(folder / "reach.parquet", logs / "runs" / "later.parquet")
    workflow.run(logs, folder / "workspace")
    return folder / "workspace"


def test_a_plan_is_kept_with_what_it_will_take(kept: tuple[Path, Said]) -> None:
    said = kept[1]
    assert said.status == 0, said.err
    assert 'reach.parquet and planned run "reach" of arm_2: ' in said.out
    assert "+- 95 % interval" in said.out


def test_the_graph_says_of_a_plan_what_the_command_printed(performed: Path, kept: tuple[Path, Said]) -> None:
    rows = {row["run"]: row for row in asking.ask("planned_runs", performed)}
    assert set(rows) == {"reach", "later"}
    reach = rows["reach"]
    assert reach["from"] == "modelled"
    assert reach["lower_Wh"] < reach["energy_Wh"] < reach["upper_Wh"]
    assert reach["energy_Wh"] * 3600 == pytest.approx(reach["mean_power_W"] * reach["time_s"])
    assert rows["later"]["energy_Wh"] == pytest.approx(reach["energy_Wh"], rel=1e-3)
    printed = float(kept[1].out.partition("energy ")[2].partition(" ")[0])
    assert reach["energy_Wh"] * 3600 == pytest.approx(printed, rel=1e-3)  # whatever the twin is since


def test_a_plan_leads_back_to_twin_and_motion(performed: Path) -> None:
    used = asking.ask(
        """SELECT ?kind { ?run irt:Run_Name "reach" ; irt:priced_by ?twin . GRAPH ?g { ?run irt:Planned_Energy ?j }
        ?g prov:wasGeneratedBy ?activity . ?activity prov:used|prov:wasInformedBy ?used FILTER(?used IN (?run, ?twin))
        BIND(IF(?used = ?run, "motion", "twin") AS ?kind) } ORDER BY ?kind""",
        performed,
    )
    assert [row["kind"] for row in used] == ["motion", "twin"]
    (known,) = asking.explain("id:run/arm_2.reach irt:Planned_Energy ?", performed)
    assert known.by.startswith("provider:energy of irtwin ")
    assert [one.by for one in known.because if one.what == "id:run/arm_2.reach"] == ["what was planned"]


def test_planned_is_held_against_measured(performed: Path) -> None:
    (pair,) = asking.ask("planned_against_measured", performed)
    assert (pair["plan"], pair["run"]) == ("reach", "done")
    assert pair["difference_percent"] == pytest.approx(100 * (pair["planned_Wh"] / pair["measured_Wh"] - 1))
    assert pair["within_interval"] is (pair["lower_Wh"] <= pair["measured_Wh"] <= pair["upper_Wh"])
    assert pair["measured_s"] - pair["planned_s"] == pytest.approx(2.0, abs=0.1)
    assert abs(pair["planned_peak_W"] - pair["measured_peak_W"]) < 0.25 * pair["measured_peak_W"]


def test_what_is_planned_is_in_no_sum(performed: Path) -> None:
    total, *others = asking.ask(
        """SELECT ?runs ?energy ?time { ?total a irt:Robot_Total ; irt:Run_Count ?runs ; irt:Total_Energy ?energy ;
        irt:Total_Run_Time ?time }""",
        performed,
    )
    assert not others
    measured = list(asking.ask("energy_per_run", performed))
    assert total["runs"] == len(measured) == 4
    assert total["energy"] == pytest.approx(sum(row["energy_Wh"] for row in measured) * 3600)
    assert total["time"] == pytest.approx(sum(row["time_s"] for row in measured))
    summed = """SELECT * { ?run a irt:Planned_Run { ?run irt:Energy_Consumption|irt:Idle_Share|irt:Start_Time ?x } UNION
        { ?x irt:of_Run|irt:fitted_on|irt:fails_on|irt:last_Run ?run } }"""
    assert not list(asking.ask(summed, performed))


def test_the_graph_conforms_and_the_page_shows_both(performed: Path) -> None:
    with Workspace.existing(performed) as place, rewriting(place) as graph:
        assert list(validate(graph)) == []
    page = (performed / "reports" / "arm_2.html").read_text(encoding="utf-8")
    assert ">Planned motions</h3>" in page
    assert ">Planned against measured</h3>" in page
    assert "<small>planned as reach</small>" in page
    assert "Runs of this robot" in page.partition(">Planned motions<")[0]
    assert '"name":"reach","part":"planned"' in page


def test_bad_plans_are_told_and_nothing_is_kept(performed: Path, tmp_path: Path) -> None:
    before = list(asking.ask("planned_runs", performed))
    here = ("--workspace", performed)
    assert 'no robot "arm_3" here; the nearest is "arm_2"' in refused_in_a_line("plan", "arm_3", *GOAL, *here)
    taken = refused_in_a_line("plan", "arm_2", *GOAL, *here, "--run", "Reach")
    assert taken.endswith('the robot has a run "reach" already; choose another name')
    assert "outside its limits" in refused_in_a_line("plan", "arm_2", "--from", "0,0", "--to", "3,0", *here)
    assert "give 2 joint positions" in refused_in_a_line("plan", "arm_2", "--from", "0,0,0", "--to", "1,0,0", *here)
    other, file, out = swing(arm(3), 1, seconds=2.0), tmp_path / "other.csv", tmp_path / "torn.parquet"
    predict = ("predict", "arm_2", file)
    file.write_text(csv_text(Signals(other.time, other.q), ("joint_1", "joint_2", "joint_3")))
    assert 'no moving joint "joint_3"' in refused_in_a_line(*predict, *here)
    file.write_text(csv_text(Signals(other.time / 8, other.q[:, :2]), ROBOT.joint_names))
    assert "above its limit" in refused_in_a_line(*predict, *here)
    torn = Signals(other.time, other.q[:, :2]).rows(np.flatnonzero((other.time < 0.5) | (other.time > 1.5)))
    file.write_text(csv_text(torn, ROBOT.joint_names))
    assert "has a hole in time" in refused_in_a_line(*predict, *here, "--out", out)
    assert not out.exists()
    assert "--workspace FOLDER" in refused_in_a_line(*predict)
    assert "give --workspace FOLDER too" in refused_in_a_line(*predict, "--run", "x", "--out", tmp_path / "x")
    assert list(asking.ask("planned_runs", performed)) == before


@pytest.fixture(scope="module")
def also_priced(performed: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Said]:
    """A copy of the workspace, in which the robot was watched while it carried "reach" out, and what priced "laden"."""
    workspace = tmp_path_factory.mktemp("watched") / "w"
    shutil.copytree(performed, workspace)
    log = performed.parent / "logs_2" / "runs" / "done.parquet"
    live = ("live", "--replay", log, "--robot", "arm_2", "--speed", 1000, "--workspace", workspace)
    for plan, said in (("reech", 'no planned run "reech"; the nearest is "reach"'), ("done", 'no planned run "done"')):
        assert said in refused_in_a_line(*live, "--performs", plan)
    ended = irtwin(*live, "--performs", "reach")
    assert ended.status == 0, ended.err
    reach = performed.parent / "reach.parquet"
    priced = irtwin("predict", "arm_2", reach, "--workspace", workspace, "--run", "laden", "--payload-mass", 2)
    return workspace, priced


@pytest.fixture(scope="module")
def watched(also_priced: tuple[Path, Said]) -> Path:
    return also_priced[0]


@pytest.mark.nightly
def test_a_motion_from_a_file_is_kept_as_well(also_priced: tuple[Path, Said]) -> None:
    workspace, priced = also_priced
    assert priced.status == 0, priced.err
    assert priced.out.startswith('planned run "laden" of arm_2: energy ')
    rows = {row["run"]: row for row in asking.ask("planned_runs", workspace)}
    assert rows["laden"]["payload_kg"] == 2.0
    assert f"{rows['laden']['energy_Wh'] * 3600:.4g}" in priced.out


@pytest.mark.nightly
def test_a_live_run_is_held_against_the_plan_that_it_carried_out(watched: Path) -> None:
    pairs = list(asking.ask("planned_against_measured", watched))
    live, done = sorted(pairs, key=lambda row: row["run"] == "done")
    assert (live["plan"], live["run"][:5], done["run"]) == ("reach", "live_", "done")
    assert live["measured_Wh"] == pytest.approx(done["measured_Wh"], rel=0.01)
    page = (watched / "reports" / "arm_2.html").read_text(encoding="utf-8")
    assert page.count("<small>planned as reach</small>") == 2


def test_a_live_run_outlasts_the_plan_of_an_earlier_data_set(watched: Path, tmp_path: Path) -> None:
    shutil.copytree(watched, tmp_path / "w")
    with Workspace(tmp_path / "w") as place:
        with place.engine.begin() as connection:
            later = sqlalchemy.update(schema.RunRow).where(schema.RunRow.kind.in_(schema.WATCHED_RUNS))
            connection.execute(later.values(performs="arm_2.later"))
        with staged(place, "arm_2") as apart:
            ingest(apart, read_data_set(write(tmp_path / "logs", recorded())))
        runs = {run.name: run for run in place.all(select(schema.RunRow))}
    assert "later" not in runs
    assert [run.performs for name, run in runs.items() if name.startswith("live_")] == [None]


def test_one_run_is_dropped_and_the_others_stay(watched: Path) -> None:
    here = ("workspace", "drop", "arm_2", "--workspace", watched, "--run")
    (live,) = (row["run"] for row in asking.ask("planned_against_measured", watched) if row["run"] != "done")
    for name, said in (
        ("done", "stands in the robot's data set; take it out there and run that again"),
        ("later", "stands in the robot's data set"),
        ("reach", 'carried out "reach"'),
        ("rech", 'the robot has no run "rech"; the nearest is "reach"'),
    ):
        assert said in refused_in_a_line(*here, name)
    before, files = told(watched), len(list((watched / "series").iterdir()))
    for name in ("laden", live):
        gone = irtwin(*here, name)
        assert (gone.status, gone.out) == (0, "")
        assert [line for line in gone.err.splitlines() if line[0] != " "] == ["Reasoning", "Checking the constraints"]
    after = told(watched)
    assert not {triple for triple in after if "laden" in triple or live in triple}
    assert {one for one in before if "laden" not in one and live not in one} == after
    assert len(list((watched / "series").iterdir())) == files - 3  # the motion of "laden" is that of "reach"
    with Workspace(watched) as place, place.reading() as session:
        assert {run.name for run in session.scalars(select(schema.RunRow))} >= {"reach", "later", "done", "swing_1"}
        for table in schema.Base.metadata.sorted_tables:
            assert not [row for row in session.execute(select(table)) if "laden" in str(row) or live in str(row)]
    assert "laden" not in (watched / "reports" / "arm_2.html").read_text(encoding="utf-8")


def told(workspace: Path) -> set[str]:
    """What the graph says of runs, with the graph that says it: from rows of the database, not of sums."""
    query = """SELECT ?g ?s ?p ?o { GRAPH ?g { ?s ?p ?o } FILTER(CONTAINS(STR(?s), "/id/run/"))
        FILTER(REGEX(STR(?g), "/graph/(source|activity)/")) }"""
    return {" ".join(map(str, row.values())) for row in asking.ask(query, workspace)}


def test_a_robot_without_a_twin_prices_nothing(tmp_path: Path) -> None:
    Workspace(tmp_path).close()
    with pytest.raises(InputError, match='no robot "arm_2" here'):
        plans.plan("arm_2", Task(np.zeros(2), np.ones(2)), Location(tmp_path), name="x")


def role(run: str, said: str) -> dict[str, str]:
    file = f'file = "runs/{run}.parquet"\nrole = '
    return {f'{file}"observed"': f'{file}"{said}"'}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"[[run]]": '[[run]]\nperforms = "swing_2"'}, '"swing_1" performs = "swing_2", which is not a planned run'),
        (role("swing_1", "planned") | role("swing_2", "planned") | role("swing_3", "planned"), "every run is planned"),
        (role("swing_1", "plan"), 'role = "plan"; use observed, reference, simulated, planned'),
    ],
)
def test_what_a_data_set_says_of_plans_is_checked(tmp_path: Path, changes: dict[str, str], said: str) -> None:
    with pytest.raises(InputError, match=re.escape(said)):
        read_data_set(write(tmp_path / "logs", recorded(), changes))


def test_a_plan_that_nobody_made_is_told(tmp_path: Path) -> None:
    logs = write(tmp_path / "logs", recorded(), {"[[run]]": '[[run]]\nperforms = "nothing"'})
    with pytest.raises(InputError, match=r'run "swing_1" performs = "nothing", which is no planned run, here or in'):
        workflow.run(logs, tmp_path / "workspace")


def test_a_plan_has_no_hole_and_is_repeated_by_nobody(tmp_path: Path) -> None:
    first, *others = recorded()
    torn = replace(first, role="planned", signals=first.signals.rows(np.r_[0:100, 300:800]))
    with pytest.raises(InputError, match=r"swing_1\.parquet: has a hole in time after 0\.99 s; plan the motion whole"):
        read_data_set(write(tmp_path / "torn", [torn, *others]))
    again = replace(others[0], repeat_of="swing_1")
    with pytest.raises(InputError, match=r'"swing_1" is a planned run; write performs = "swing_1"'):
        read_data_set(write(tmp_path / "again", [replace(first, role="planned"), again, others[1]]))


def test_a_planned_motion_that_the_robot_cannot_make_stores_nothing(tmp_path: Path) -> None:
    first, *others = recorded()
    far = replace(first, role="planned", signals=replace(first.signals, q=4 * first.signals.q))
    with pytest.raises(InputError, match=r"outside its limits.*nothing of this data set was stored"):
        workflow.run(write(tmp_path / "logs", [far, *others]), tmp_path / "workspace")
    with Workspace(tmp_path / "workspace") as place, place.reading() as session:
        assert session.scalars(select(schema.RunRow)).all() == []


@pytest.mark.nightly
def test_another_timing_says_what_it_saves(performed: Path, tmp_path: Path) -> None:
    out = tmp_path / "slower.csv"
    here = ("--workspace", performed, "--out", out, "--run", "slower")
    said = irtwin("optimise", "arm_2", "done", "--cycle", 6, "--base", *here)
    assert said.status == 0, said.err
    # two joints cannot follow from elsewhere
    assert "no place of the base up to 0.3 m beside saves anything" in said.out
    *others, last = said.out.splitlines()
    (row,) = asking.ask("retimed_motions", performed)
    assert (row["run"], row["plan"]) == ("done", "slower")
    assert row["lower_Wh"] < row["saving_Wh"] < row["upper_Wh"]
    assert f'{out} and planned run "slower" of arm_2: 6.00 s: ' in last
    printed = float(last.partition(" J, ")[2].partition(" ")[0])
    assert printed == pytest.approx(abs(row["saving_Wh"] * 3600), rel=0.01)
    assert f" J {'less' if row['saving_Wh'] >= 0 else 'more'} than done " in last
    assert any(line.startswith("move from ") and line.endswith(" times as long") for line in others)
    times = np.loadtxt(out, delimiter=",", skiprows=1)[:, 0]
    assert times[-1] - times[0] == pytest.approx(6.0, abs=0.01)
    asked = "SELECT ?run ?j ?s { ?any irt:Run_Name ?run ; irt:Run_Time ?s ; irt:Planned_Energy|irt:Modelled_Energy ?j }"
    energies = {one["run"]: one for one in asking.ask(asked, performed)}
    quick, slower = energies["done"], energies["slower"]
    assert row["times_longer"] == pytest.approx(slower["s"] / quick["s"], rel=1e-3)
    twin = plans.robot_twin("arm_2", Location(performed))
    q = np.repeat([[1.0, -1.0]], 50, axis=0)  # where the motion ends
    held = Motion(np.linspace(0, 1, 50), q, 0 * q, 0 * q, run="held")
    waiting = float(np.mean(twin.power(held))) * (slower["s"] - quick["s"])
    assert row["saving_Wh"] * 3600 == pytest.approx(quick["j"] + waiting - slower["j"], abs=0.02 * quick["j"])
    page = (performed / "reports" / "arm_2.html").read_text(encoding="utf-8")
    assert ("Timed as slower, in " in page) is (row["lower_Wh"] > 0)


@pytest.mark.parametrize(
    ("run", "more", "message"),
    [
        ("swing_1", (), 'run "swing_1" has no move from rest to rest; name a run that has one'),
        ("dome", (), 'the robot has no measured run "dome"; the nearest is "done"'),
        ("done", ("--run", "reach"), 'the robot has a run "reach" already; choose another name'),
        ("done", ("--cycle", "0.5"), 'run "done" cannot be done in 0.5 s; the fastest'),
        ("done", ("--out", "x.txt"), "a motion is written as .csv, .parquet, .script or .src"),
    ],
)
def test_what_cannot_be_timed_otherwise(performed: Path, run: str, more: tuple[str, ...], message: str) -> None:
    assert message in refused("optimise", "arm_2", run, "--workspace", performed, *more)
