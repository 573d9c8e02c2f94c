"""Robots that are watched: no sample lost, the graph current, and at the end a run like any other."""

from __future__ import annotations

import dataclasses
import math
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
import pytest
from pyoxigraph import Quad
from sqlalchemy import select
from tests import rows
from tests.mapped import map_into
from tests.waiting import wait_for

from irtwin.errors import InputError
from irtwin.knowledge.shacl.validation import validate
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_ACTIVITY, GRAPH_SOURCE
from irtwin.live import live_twin as live
from irtwin.live.joint_stream import State
from irtwin.live.live_run import columns, journal_rows
from irtwin.live.live_twin import LiveTwin
from irtwin.storage.database import Workspace
from irtwin.storage.journal import Header, Journal
from irtwin.storage.schema import LIVE, LIVE_RUN, PLANNED_RUN, RunRow

pytestmark = pytest.mark.slow

NOON = 1772366400.0  # 2026-03-01T12:00:00Z
UNSAID = (math.nan, math.nan)
NOW = """SELECT ?state ?time ?count ?superseded ?q WHERE {
  ?run a irt:Live_Run ; irt:Current_State ?state ; irt:State_Time ?time ; irt:Sample_Count ?count ;
    irt:Superseded_States ?superseded .
  ?joint irt:state_of ?run .
  ?joint irt:of_Joint <https://w3id.org/irtwin/id/joint/KUKA_KR6_R700/joint_a1> ; irt:Joint_Position ?q }"""

TOOK_PLACE = """SELECT ?start ?end WHERE {
  ?run a irt:Live_Run ; prov:startedAtTime ?start OPTIONAL { ?run prov:endedAtTime ?end } }"""


@pytest.fixture
def place(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Workspace]:
    on_server = getattr(request, "param", False)
    with Workspace(tmp_path, request.getfixturevalue("new_postgresql_database")() if on_server else None) as place:
        place.ingest(*rows.data_set())
        yield place


@pytest.fixture
def graph(place: Workspace) -> Iterator[KnowledgeGraph]:
    with KnowledgeGraph(place.graph_folder) as graph:
        yield graph


def state(number: int, robot: str = rows.ROBOT, said: bool = True) -> State:
    """A swing at 100 Hz of two joints, the second at rest."""
    at = 0.01 * number
    speed = (math.cos(at), 0.0) if said else UNSAID
    return State(robot, NOON + at, ((math.sin(at), 0.5), speed, (10.0, -3.0), UNSAID, (400.0 + number,)))


def send(twin: LiveTwin, numbers: Iterable[int], late: float = 0.0, said: bool = True) -> None:
    """Send states of the swing whose times are wrong by so many seconds."""
    for number in numbers:
        right = state(number, said=said)
        twin.receive(dataclasses.replace(right, time=right.time + late))


def live_runs(place: Workspace) -> list[RunRow]:
    return list(place.all(select(RunRow).where(RunRow.kind == LIVE_RUN).order_by(RunRow.start_time)))


def counts(place: Workspace) -> list[tuple[float, int]]:
    """When each live run began, s from noon, and its samples."""
    return [(round(run.start_time.timestamp() - NOON, 3), run.sample_count) for run in live_runs(place)]


def quads(graph: KnowledgeGraph) -> set[Quad]:
    below = (GRAPH_SOURCE, GRAPH_ACTIVITY)
    found = graph.answer("SELECT ?g ?s ?p ?o { GRAPH ?g { ?s ?p ?o } }")
    return {
        Quad(r["s"], r["p"], r["o"], r["g"])
        for r in found
        if r["g"].value.startswith(below) and not r["g"].value.endswith("/version")
    }


def mapped(place: Workspace) -> set[Quad]:
    with KnowledgeGraph() as fresh:
        return quads(map_into(fresh, place))


def live_run(place: Workspace) -> RunRow:
    (run,) = live_runs(place)
    return run


def test_the_graph_shows_the_newest_state_while_the_run_lasts(place: Workspace, graph: KnowledgeGraph) -> None:
    with LiveTwin(place, graph) as twin:
        send(twin, range(100))
        wait_for(lambda: graph.query(NOW) and graph.query(NOW)[0]["count"] == 100)
        (row,) = graph.query(NOW)
        assert row["time"].timestamp() == pytest.approx(NOON + 0.99, abs=1e-6)
        assert (row["state"], row["q"]) == ("moving", pytest.approx(math.sin(0.99)))
        assert row["superseded"] == twin.superseded <= 99
        assert graph.query("ASK { ?run irt:run_of id:robot\\/KUKA_KR6_R700 ; a irt:Live_Run }")[0]["answer"]
        assert [row["start"].timestamp() for row in graph.query(TOOK_PLACE) if row["end"] is None] == [NOON]
        for number in range(100, 130):
            standing = ((1.0, 0.5), (0.0, 0.0), UNSAID, UNSAID, (math.nan,))
            twin.receive(State(rows.ROBOT, NOON + 0.01 * number, standing))
        wait_for(lambda: graph.query(NOW)[0]["state"] == "standstill")
        assert len(graph.query(NOW)) == 1


@pytest.mark.parametrize(
    ("place", "said"),
    [(False, True), (False, False), pytest.param(True, True, marks=pytest.mark.system)],
    indirect=["place"],
)
def test_at_the_end_it_is_a_run_like_any_other(place: Workspace, graph: KnowledgeGraph, said: bool) -> None:
    with LiveTwin(place, graph) as twin:
        send(twin, range(500), said=said)
        wait_for(lambda: graph.query(NOW) and graph.query(NOW)[0]["count"] == 500)
        shown = {quad for quad in quads(graph) if quad.predicate.value.endswith(("Joint_Speed", "Joint_Acc"))}
    assert twin.stored == 500
    run = live_run(place)
    table = place.read_series(run.run_id)
    assert table.column_names[:3] == ["time", "q_joint_a1", "q_joint_a2"]
    assert ("dq_joint_a1" in table.column_names) == said
    assert not {"temp_joint_a1"} & set(table.column_names)  # never said
    np.testing.assert_allclose(table["time"].to_numpy(), 0.01 * np.arange(500), atol=1e-6)
    np.testing.assert_array_equal(table["power"].to_numpy(), 400.0 + np.arange(500))
    assert (run.sample_count, run.sample_rate_hz) == (500, pytest.approx(100.0))
    assert quads(graph) == mapped(place)
    (row,) = graph.query(TOOK_PLACE)
    assert [row[at].timestamp() for at in ("start", "end")] == pytest.approx([NOON, NOON + 4.99], abs=1e-6)
    assert shown <= quads(graph)  # what was shown last is what the run ended with
    energy = pytest.approx(np.trapezoid(400.0 + np.arange(500), dx=0.01), rel=1e-5)
    taken = graph.query("SELECT ?e ?by { ?run irt:Energy_Consumption ?e ; irt:Energy_From ?by ; irt:State_Time ?at }")
    assert taken.rows == ({"e": energy, "by": "measured"},)  # it has no twin
    found = graph.query(f"SELECT (series:integral(id:run\\/{run.run_id}, 'power', 0, 10) AS ?e) {{}}")
    assert found.rows == ({"e": energy},)
    assert not list((place.folder / "live").iterdir())


def test_a_run_of_one_sample_breaks_no_shape(place: Workspace, graph: KnowledgeGraph) -> None:
    graph.load_ontology()
    with LiveTwin(place, graph) as twin:
        twin.receive(state(0))
        wait_for(lambda: graph.query(NOW))
        while_it_lasts = validate(graph)
    run = live_run(place)
    assert (run.run_time_s, run.sample_count, run.sample_rate_hz) == (0.0, 1, None)
    assert quads(graph) == mapped(place)
    assert [while_it_lasts, validate(graph)] == [(), ()]
    assert not graph.query("ASK { ?run a irt:Live_Run ; irt:Sample_Rate|irt:Energy_Consumption ?any }")[0]["answer"]


def test_a_run_names_the_plan_that_it_carries_out(place: Workspace, graph: KnowledgeGraph) -> None:
    place.keep_run(rows.run("reach", kind=PLANNED_RUN, role=None), rows.samples(3))
    place.ingest(rows.robot(robot_id="Other"), [], [], {})
    theirs = rows.run("lift", run_id="Other.lift", robot_id="Other", kind=PLANNED_RUN, role=None)
    place.keep_run(theirs, rows.samples(4))
    with LiveTwin(place, graph) as twin:
        for plan, said in (("lift", '"lift"; the nearest is "reach"'), ("work", 'no planned run "work"')):
            with pytest.raises(InputError, match=said):
                twin.receive(dataclasses.replace(state(0), performs=plan))
        twin.receive(dataclasses.replace(state(0), performs="reach"))
        send(twin, range(1, 5))
        wait_for(lambda: graph.query("SELECT ?plan { ?run a irt:Live_Run ; irt:performs / irt:Run_Name ?plan }"))
    assert live_run(place).performs == f"{rows.ROBOT}.reach"
    assert quads(graph) == mapped(place)


def test_a_run_of_a_crash_outlasts_its_plan(place: Workspace, graph: KnowledgeGraph) -> None:
    header = Header(f"{rows.ROBOT}.live_1", rows.ROBOT, 0.0, columns(["joint_a1", "joint_a2"]), performs="gone")
    journal = Journal(place.folder / LIVE, header)
    journal.append(journal_rows([state(number) for number in range(5)]))
    journal.close()
    said: list[str] = []
    with LiveTwin(place, graph, said.append):
        pass
    assert f"{header.run_id}: its plan gone is no more; kept without" in said
    assert (live_run(place).performs, live_run(place).sample_count) == (None, 5)


@pytest.mark.parametrize("place", [False, pytest.param(True, marks=pytest.mark.system)], indirect=True)
def test_a_data_set_taken_in_again_leaves_live_runs(place: Workspace, graph: KnowledgeGraph) -> None:
    with LiveTwin(place, graph) as twin:
        send(twin, range(2))
    assert place.ingest(*rows.data_set()) == "unchanged"
    robot, joints, runs, series = rows.data_set()
    robot.weight_kg = 51.0
    assert place.ingest(robot, joints, runs, series) == "replaced"
    assert place.read_series(live_run(place).run_id).num_rows == 2
    place.drop_robot(rows.ROBOT)
    assert not place.all(select(RunRow))


def test_a_long_stream_becomes_several_runs(
    place: Workspace, graph: KnowledgeGraph, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(live, "RUN_SECONDS", 1.0)
    monkeypatch.setattr(live, "BATCH", 0.01)
    with LiveTwin(place, graph) as twin:
        for number in range(450):
            twin.receive(state(number))
            if number % 50 == 0:
                time.sleep(0.05)
    runs = live_runs(place)
    assert len(runs) > 1
    assert sum(run.sample_count for run in runs) == 450
    power = np.concatenate([place.read_series(run.run_id)["power"].to_numpy() for run in runs])
    np.testing.assert_array_equal(power, 400.0 + np.arange(450))
    assert quads(graph) == mapped(place)


def test_states_that_are_not_later_are_refused(place: Workspace, graph: KnowledgeGraph) -> None:
    with LiveTwin(place, graph) as twin:
        twin.receive(state(5))
        for number, said in ((5, "of the same time as"), (4, r"comes late, out of order, by 0\.01 s; not stored")):
            with pytest.raises(InputError, match=said):
                twin.receive(state(number))
        twin.receive(state(6))
    assert live_run(place).sample_count == 2
    with pytest.raises(InputError, match="watching has ended"):
        twin.receive(state(7))


@pytest.mark.parametrize("wrong", [1800.0, -1800.0])
def test_a_state_of_a_wrong_time_is_refused_by_itself(place: Workspace, graph: KnowledgeGraph, wrong: float) -> None:
    with LiveTwin(place, graph) as twin:
        send(twin, range(50))
        send(twin, [50], late=wrong)
        with pytest.raises(InputError, match="more than 60 s away from its neighbours"):
            twin.receive(state(51))
        send(twin, range(52, 150))
    assert counts(place) == [(0.0, 149)]


def test_a_state_far_ahead_of_the_clock_is_refused(place: Workspace, graph: KnowledgeGraph) -> None:
    with LiveTwin(place, graph) as twin:
        for first in (0, 100):  # as the first of a robot, and later
            with pytest.raises(InputError, match=r"more than 7200 s ahead of the clock here, by \d+ s"):
                twin.receive(dataclasses.replace(state(0), time=253402300799.0))
            send(twin, range(first, first + 100))
    assert counts(place) == [(0.0, 200)]


@pytest.mark.parametrize(
    ("sent", "kept"),
    [
        pytest.param([(range(50), 0.0), (range(30), 300.0)], [(0.0, 50), (300.0, 30)], id="a hole ends the run"),
        pytest.param([([0], 0.0), ([0], 300.0)], [(0.0, 1), (300.0, 1)], id="the last after a hole is kept"),
        pytest.param([([0], 1800.0), (range(1, 100), 0.0)], [(0.01, 99), (1800.0, 1)], id="the first may be wrong"),
    ],
)
def test_a_state_far_from_its_neighbour_is_of_another_run(
    place: Workspace, graph: KnowledgeGraph, sent: list[tuple[Iterable[int], float]], kept: list[tuple[float, int]]
) -> None:
    with LiveTwin(place, graph) as twin:
        for numbers, late in sent:
            send(twin, numbers, late)
    assert counts(place) == kept
    assert twin.stored == sum(count for _, count in kept)


@pytest.mark.parametrize("restarted", [True, False])
def test_a_log_that_comes_again_is_stored_once(place: Workspace, graph: KnowledgeGraph, restarted: bool) -> None:
    twin = LiveTwin(place, graph)
    send(twin, range(50))
    if restarted:
        twin.stop()
        twin = LiveTwin(place, graph)
    else:  # by the hole, the first run ends while the watching goes on
        send(twin, range(3), late=-300.0)
        wait_for(lambda: counts(place) == [(0.0, 50)])
    for number in range(50):
        with pytest.raises(InputError, match=r"the stored run \S+live_20260301T120000000000 covers this time"):
            twin.receive(state(number))
    send(twin, range(50, 80))
    twin.stop()
    assert counts(place) == ([] if restarted else [(-300.0, 3)]) + [(0.0, 50), (0.5, 30)]
    assert quads(graph) == mapped(place)


def test_where_storage_is_slow_the_source_waits(
    place: Workspace, graph: KnowledgeGraph, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(live, "MOST_WAITING", 10)
    lines: list[str] = []
    with LiveTwin(place, graph, lines.append) as twin:
        send(twin, range(50))
        assert twin.waited > 0.1
    assert twin.stored == live_run(place).sample_count == 50
    assert lines == ["storage cannot keep up: the source waits (back-pressure); no sample is lost"]
    (row,) = graph.query("SELECT ?waited { ?run a irt:Live_Run ; irt:Source_Waited ?waited }")
    assert row["waited"] == pytest.approx(twin.waited)


def test_what_stops_the_work_is_told_to_the_source(
    place: Workspace, graph: KnowledgeGraph, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("irtwin.storage.journal.Journal.append", full)
    twin = LiveTwin(place, graph)
    twin.receive(state(0))
    wait_for(lambda: twin._failure is not None)
    with pytest.raises(OSError, match="No space left"):
        twin.receive(state(1))
    with pytest.raises(OSError, match="No space left"):
        twin.stop()


WATCHER = """
import sys
from pathlib import Path
sys.path.insert(0, sys.argv[2])
from tests.providers.test_live import state
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.live.live_run import columns, journal_rows
from irtwin.live.live_twin import LiveTwin
from irtwin.storage.database import Workspace

with Workspace(Path(sys.argv[1])) as place, KnowledgeGraph(place.graph_folder) as graph:
    twin = LiveTwin(place, graph)
    for number in range(10**9):
        twin.receive(state(number))
        if number % 100 == 0:
            print(twin.stored, flush=True)
"""


def test_a_kill_loses_no_stored_sample(place: Workspace, tmp_path: Path) -> None:
    command = [sys.executable, "-c", WATCHER, str(tmp_path), str(Path(__file__).parents[2])]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        stored = 0
        while stored < 1000:
            stored = int(process.stdout.readline())
        process.kill()
        stored = max([stored, *(int(line) for line in process.stdout.read().split())])
    (journal,) = (tmp_path / "live").iterdir()
    with journal.open("ab") as file:
        file.write(b"torn")
    lines: list[str] = []
    with KnowledgeGraph(place.graph_folder) as graph, LiveTwin(place, graph, lines.append):
        run = live_run(place)
        assert run.sample_count >= stored >= 1000
        power = place.read_series(run.run_id)["power"].to_numpy()
        np.testing.assert_array_equal(power, 400.0 + np.arange(run.sample_count))
        assert quads(graph) == mapped(place)
    assert lines == [f"{run.run_id}: a crash ended this run; its {run.sample_count} samples on disk are kept"]
