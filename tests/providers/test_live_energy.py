"""A live run has energy, ledger, gap and alarms in the graph, as it goes and at its end."""

from __future__ import annotations

import math
import shutil
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from sqlalchemy import select
from tests import small_robots, synthetic
from tests.waiting import wait_for

from irtwin.errors import InputError
from irtwin.knowledge.explain.explain import explain
from irtwin.knowledge.questions.queries import ask
from irtwin.knowledge.reasoning import reason
from irtwin.knowledge.shacl.validation import validate
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_SHACL
from irtwin.live import live_twin
from irtwin.live.joint_stream import STREAMED, State
from irtwin.live.live_run import columns, journal_rows
from irtwin.live.live_twin import LiveTwin
from irtwin.signals.log import Run as LoggedRun
from irtwin.storage import schema
from irtwin.storage.database import Workspace
from irtwin.storage.journal import Header, Journal
from irtwin.workflow import run as run_all

pytestmark = pytest.mark.slow

NOON = 1772366400.0  # 2026-03-01T12:00:00Z
ROBOT = synthetic.with_constants(synthetic.arm(2))
RULE = "https://w3id.org/irtwin/rules/gap_alarm"
ALARMS = """SELECT ?state ?reason ?rule ?joint {
  ?alarm a irt:Gap_Alarm ; irt:Alarm_State ?state ; irt:Alarm_Reason ?reason ;
  irt:raised_by_Rule ?rule OPTIONAL { ?alarm irt:gap_at_Joint / irt:Joint_Name ?joint } }"""
ENERGY = """SELECT ?energy ?power ?modelled ?from ?part { ?run a irt:Live_Run ; irt:Energy_Consumption ?energy ;
  irt:Run_Power ?power ; irt:Energy_From ?from
  OPTIONAL { ?run irt:Modelled_Energy ?modelled ; irt:Part_In_Twin ?part } }"""


@pytest.fixture
def place(small_run: Path, tmp_path: Path) -> Iterator[Workspace]:
    shutil.copytree(small_run / "workspace", tmp_path / "w")
    with Workspace(tmp_path / "w") as place:
        yield place


@pytest.fixture
def graph(place: Workspace) -> Iterator[KnowledgeGraph]:
    with KnowledgeGraph.of_workspace(place) as graph:
        yield graph


def log(seconds: float = 12.0, seed: int = 7) -> LoggedRun:
    return synthetic.as_run(synthetic.measure(ROBOT, synthetic.swing(ROBOT, seed, seconds=seconds), noise=0.01))


def states(run: LoggedRun, torque: Callable[[float], float] = lambda at: 0.0, power: bool = True) -> Iterator[State]:
    """The states of a run; `torque` is added to that of the second joint."""
    for row, at in enumerate(run.signals.time - run.signals.time[0]):
        values = []
        for field, channel in STREAMED.items():
            said = getattr(run.signals, field)
            if said is None or (field == "power" and not power):
                values.append((math.nan,) * (2 if channel.per_joint else 1))
            else:
                more = np.array([0.0, torque(at)]) if field == "torque" else 0.0
                values.append(tuple((np.atleast_1d(said[row]) + more).tolist()))
        yield State("Arm", NOON + float(at), tuple(values))


def watch(place: Workspace, graph: KnowledgeGraph, states: Iterable[State]) -> None:
    with LiveTwin(place, graph) as twin:
        for state in states:
            twin.receive(state)


def energy_of(place: Workspace) -> schema.RunEnergy:
    """Return the energy of the one live run."""
    with place.reading() as session:
        of_live = select(schema.RunEnergy).join(schema.RunRow).where(schema.RunRow.kind == schema.LIVE_RUN)
        return session.scalars(of_live).one()


def test_energy_grows_while_the_run_lasts_and_the_end_breaks_no_shape(
    place: Workspace, graph: KnowledgeGraph, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(live_twin, "SHOWN_EVERY", 0.0)
    before = {violation.message for violation in validate(graph)}
    run = log()
    said = list(states(run))
    with LiveTwin(place, graph) as twin:
        for state in said[: len(said) // 2]:
            twin.receive(state)
        wait_for(lambda: graph.query(ENERGY))
        halfway = graph.query(ENERGY)[0]["energy"]
        assert graph.query("ASK { ?gap a irt:Gap_State ; irt:Band_State 'inside' }")[0]["answer"]
        for state in said[len(said) // 2 :]:
            twin.receive(state)
        wait_for(lambda: graph.query(ENERGY)[0]["energy"] > 1.2 * halfway)
    (row,) = graph.query(ENERGY)
    assert row["energy"] == pytest.approx(np.trapezoid(run.signals.power, run.signals.time), rel=1e-3)
    assert row["power"] == pytest.approx(row["energy"] / 12.0, rel=1e-2)
    assert (row["from"], row["part"]) == ("measured", "held_out")
    shares = graph.query("""SELECT (SUM(?each) AS ?all) (COUNT(DISTINCT ?joint) AS ?joints) {
        ?share a irt:Energy_Share ; irt:of_Run ?run . ?run a irt:Live_Run . ?share irt:Energy ?each
        OPTIONAL { ?share irt:of_Joint ?joint } }""")
    assert shares[0]["all"] == pytest.approx(row["modelled"])
    assert shares[0]["joints"] == 2
    (streams,) = graph.query("SELECT ?stream ?used { ?run irt:Stream_State ?stream ; irt:modelled_by ?used }")
    assert streams["stream"] == "ended"
    assert not graph.query(ALARMS)
    series = place.read_series(energy_of(place).run_id, "modelled")
    assert {"time", "held_out", "power", "power_model", "energy", "energy_model"} <= set(series.column_names)
    assert series["energy"].to_numpy()[-1] == pytest.approx(row["energy"])
    reason(graph)
    assert {violation.message for violation in validate(graph)} == before == set()


def test_a_gap_that_lasts_raises_one_alarm_and_clears_it(
    place: Workspace, graph: KnowledgeGraph, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(live_twin, "SHOWN_EVERY", 0.0)
    lines: list[str] = []
    said = list(states(log(20.0), torque=lambda at: 25.0 if 4.0 < at < 12.0 else 0.0))
    with LiveTwin(place, graph, lines.append) as twin:
        for state in said[:1100]:
            twin.receive(state)
        wait_for(lambda: graph.query(ALARMS))
        for row in graph.query(ALARMS):
            assert (row["state"], row["rule"]) == ("active", RULE)
        for state in said[1100:]:
            twin.receive(state)
        wait_for(lambda: [row for row in graph.query(ALARMS) if row["state"] == "cleared"])
    (row,) = graph.query(ALARMS)
    assert row["state"] == "cleared"
    assert row["joint"] == ROBOT.joint_names[1]
    assert row["reason"].startswith(f"torque of {ROBOT.joint_names[1]} was up to 25 N m from the twin, ")
    assert [line.partition(":")[2].split(":")[0] for line in lines if "alarm" in line] == [
        " alarm active", " alarm cleared"
    ]  # fmt: skip
    (why,) = explain(graph, "? irt:Alarm_Reason ?")
    assert why.by == 'the rule "gap alarm", in SHACL'
    assert {"irt:Excursion_Lasted", "irt:Peak_Residual", "irt:Limit_Value"} <= {
        one.what.split()[1] for one in why.because
    }
    found = graph.triples(f"{GRAPH_SHACL}gap_alarm")
    reason(graph)
    assert graph.triples(f"{GRAPH_SHACL}gap_alarm") == found  # raised live as the rules conclude it of the graph
    assert validate(graph) == ()


def test_a_run_that_the_twin_misses_raises_an_alarm_when_it_ends(place: Workspace, graph: KnowledgeGraph) -> None:
    metered = replace((run := log()).signals, power=run.signals.power + 500.0)
    watch(place, graph, states(replace(run, signals=metered)))
    (alarm,) = (row for row in ask(graph, "alarms") if row["rule"] == "twin_alarm")
    assert (alarm["state"], alarm["since"].timestamp()) == ("active", NOON)
    assert alarm["reason"].startswith("the twin misses the energy of this run by ")
    found = graph.triples(f"{GRAPH_SHACL}twin_alarm")
    reason(graph)
    assert graph.triples(f"{GRAPH_SHACL}twin_alarm") == found
    assert validate(graph) == ()


def test_a_push_of_half_a_second_raises_none(place: Workspace, graph: KnowledgeGraph) -> None:
    watch(place, graph, states(log(), torque=lambda at: 25.0 if 4.0 < at < 4.5 else 0.0))
    assert not graph.query(ALARMS)


def test_power_that_is_not_measured_is_modelled(place: Workspace, graph: KnowledgeGraph) -> None:
    watch(place, graph, states(log(), power=False))
    (row,) = graph.query(ENERGY)
    assert row["energy"] == row["modelled"]
    assert row["from"] != "measured"


def test_what_a_crash_left_gets_its_energy_too(place: Workspace, graph: KnowledgeGraph) -> None:
    said = list(states(log()))
    header = Header("Arm.live_20260301T120000000000", "Arm", 0.0, columns(ROBOT.joint_names))
    journal = Journal(place.folder / "live", header)
    journal.append(journal_rows(said))
    journal.close()
    with LiveTwin(place, graph) as twin:
        (row,) = graph.query(ENERGY)
        assert row["energy"] == pytest.approx(np.trapezoid(log().signals.power, log().signals.time), rel=1e-3)
        with pytest.raises(InputError, match="covers this time"):
            twin.receive(said[5])


@pytest.mark.nightly
def test_a_new_twin_gives_live_runs_their_energy_anew(place: Workspace, tmp_path: Path) -> None:
    with KnowledgeGraph.of_workspace(place) as graph:
        watch(place, graph, states(log()))
    old = energy_of(place)
    run_all(small_robots.data_set(tmp_path / "data", "Arm"), place.folder)  # the same once more
    run_all(small_robots.data_set(tmp_path / "other", "Arm", seed=4), place.folder)
    new = energy_of(place)
    assert new.twin_id != old.twin_id
    assert new.energy_consumption_j == pytest.approx(old.energy_consumption_j, rel=1e-3)  # as measured
    assert new.modelled_energy_j != old.modelled_energy_j
    with KnowledgeGraph.of_workspace(place) as graph:
        assert len(graph.query(ENERGY)) == 1
        assert validate(graph) == ()


def test_a_stream_that_stops_is_marked_and_its_last_state_kept(
    place: Workspace, graph: KnowledgeGraph, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("irtwin.live.stream_health.STALE", 0.3)
    lines: list[str] = []
    stale = "SELECT ?at ?why { ?run irt:Stream_State 'stale' ; irt:Stale_Reason ?why ; irt:State_Time ?at }"
    with LiveTwin(place, graph, lines.append) as twin:
        said = list(states(log()))
        for state in said[:100]:
            twin.receive(state)
        wait_for(lambda: graph.query(stale))
        (row,) = graph.query(stale)
        assert row["at"].timestamp() == pytest.approx(said[99].time, abs=1e-5)
        assert row["why"].startswith("no state came for")
        twin.receive(said[100])
        wait_for(lambda: not graph.query(stale))
        monkeypatch.setattr("irtwin.live.stream_health.STALE", 60.0)
        step = said[1].time - said[0].time
        q, _, *others = said[100].values
        for number in range(1, 401):  # times go on, values do not, though a speed is said
            twin.receive(State("Arm", said[100].time + number * step, (q, (0.5, 0.5), *others)))
        wait_for(lambda: graph.query(stale))
        assert graph.query(stale)[0]["why"].endswith("though the speed that is said is not zero")
        twin.receive(replace(said[101], time=said[100].time + 401 * step))
        wait_for(lambda: not graph.query(stale))
    assert twin.stored == 101 + 400 + 1
    assert lines[0].startswith("Arm: stale: no state came for")
    assert lines[2].startswith("Arm: stale: every value has been the same for 3 s")
    assert lines[2].endswith("; its states are stored")
    assert lines[1] == lines[3] == "Arm: the stream flows again"
