"""Samples reached from SPARQL."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from tests import rows
from tests.mapped import map_into, ontology_graph

from irtwin.errors import InputError
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import SERIES
from irtwin.storage.database import Workspace

TIME = 10.0 + np.arange(5) / 4
POWER = np.array([100.0, 200.0, 300.0, 300.0, 100.0])
RUN = f"id:run\\/{rows.ROBOT}.work"


@pytest.fixture(scope="module")
def graph(tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest) -> Iterator[KnowledgeGraph]:
    folder = tmp_path_factory.mktemp("workspace")
    on_server = getattr(request, "param", False)
    url = request.getfixturevalue("new_postgresql_database")() if on_server else None
    with Workspace(folder, url) as place, KnowledgeGraph(place.graph_folder) as graph:
        robot, joints, runs, series = rows.data_set()
        series[f"{rows.ROBOT}.work"] = pa.table({"time": TIME, "power": POWER})
        place.ingest(robot, joints, runs, series)
        yield map_into(graph, place)


def ask(graph: KnowledgeGraph, call: str) -> object:
    return graph.query(f"SELECT ({call} AS ?value) {{}}")[0]["value"]


@pytest.mark.parametrize(
    ("call", "expected"),
    [
        ("series:mean(RUN, 'power', 10, 11)", 200.0),
        ("series:mean(RUN, 'power', 10.25, 10.5)", 250.0),
        ("series:min(RUN, 'power', 10.1, 10.9)", 200.0),
        ("series:max(RUN, 'power', 10, 10.3)", 200.0),
        ("series:integral(RUN, 'power', 10, 11)", np.trapezoid(POWER, TIME)),
        ("series:integral(RUN, 'power', 0, 1e9)", np.trapezoid(POWER, TIME)),
        ("series:integral(RUN, 'power', 10.125, 10.25)", 0.125 * 175.0),
        ("series:integral(RUN, 'power', 10, 11, 'measured')", np.trapezoid(POWER, TIME)),
        # the run began at noon, where its clock says 10
        (
            "series:mean(RUN, 'power', '2026-03-01T12:00:00.25Z'^^xsd:dateTime, '2026-03-01T12:00:01Z'^^xsd:dateTime)",
            225.0,
        ),
        ("series:mean(RUN, 'power', 10, '2026-03-01T13:00:00.25+01:00'^^xsd:dateTime)", 150.0),
        ("series:mean(RUN, 'power', 20, 30)", None),
        ("series:integral(RUN, 'power', 20, 30)", None),
    ],
)
def test_windows(graph: KnowledgeGraph, call: str, expected: float | None) -> None:
    assert ask(graph, call.replace("RUN", RUN)) == (None if expected is None else pytest.approx(expected))


def test_samples_come_as_json(graph: KnowledgeGraph) -> None:
    table = graph.query(f"SELECT (series:samples({RUN}, 'power', 10.2, 10.6) AS ?s) (DATATYPE(?s) AS ?kind) {{}}")
    assert json.loads(table[0]["s"]) == [[10.25, 200.0], [10.5, 300.0]]
    assert table[0]["kind"].endswith("#JSON")


@pytest.mark.parametrize("graph", [False, pytest.param(True, marks=pytest.mark.system)], indirect=True)
def test_functions_work_within_patterns_sums_and_filters(graph: KnowledgeGraph) -> None:
    found = graph.query("SELECT ?run { ?run a irt:Measured_Run FILTER(series:max(?run, 'power', 0, 1e6) > 250) }")
    assert [run["run"].rpartition(".")[2] for run in found] == ["work"]
    total = """SELECT (SUM(?energy) AS ?total) (COUNT(?energy) AS ?runs) {
                 ?run a irt:Measured_Run BIND(series:integral(?run, "power", START, 1e6) AS ?energy) }"""
    (row,) = graph.query(total.replace("START", "0"))
    assert row == {"total": pytest.approx(np.trapezoid(POWER, TIME) + 100.5), "runs": 2}
    (row,) = graph.query(total.replace("START", "10"))  # when the other run is over
    assert row["runs"] == 1


@pytest.mark.parametrize(
    ("call", "fault"),
    [
        ("series:mean(RUN, 'powr', 10, 11)", "id:run/KUKA_KR6_R700.work: there is no channel 'powr'; there are power"),
        ("series:mean(id:nobody, 'power', 10, 11)", "id:nobody: the graph has no measured series of this run"),
        ("series:mean(RUN, 'power', 10, 11, 'modelled')", "the graph has no modelled series of this run"),
        ("series:mean(RUN, 'power', 11, 10)", "ends before it begins"),
        ("series:mean(RUN, 'power', 'a', 10)", "is a number of seconds or an xsd:dateTime"),
        ("series:mean(RUN, 'power', true, 10)", "is a number of seconds or an xsd:dateTime"),
        ("series:mean(RUN, 'power', 'NaN'^^xsd:double, 10)", "ends before it begins"),
        ("series:mean(RUN, 'power')", "takes a run, a channel and the two ends"),
        ("series:mean('run', 'power', 1, 2)", "takes a run's IRI and a channel's name"),
    ],
)
def test_calls_without_an_answer_say_why(graph: KnowledgeGraph, call: str, fault: str) -> None:
    table = graph.query(f"SELECT ({call.replace('RUN', RUN)} AS ?value) {{}}")
    assert table[0]["value"] is None
    (said,) = table.faults
    assert said.startswith("series:mean: ")
    assert fault in said


def test_an_unknown_function_is_a_mistake_of_the_query(graph: KnowledgeGraph) -> None:
    with pytest.raises(InputError, match=r"series/median> is not supported"):
        ask(graph, "series:median(?run, 'power', 0, 1)")


def test_no_file_outside_the_workspace_is_read(graph: KnowledgeGraph, tmp_path: Path) -> None:
    """Whoever may update the graph may not thereby read the server's files."""
    pa.parquet.write_table(pa.table({"time": [0.0], "power": [1.0]}), tmp_path / "secret.parquet")
    with KnowledgeGraph(workspace=tmp_path / "workspace") as other:
        other.store.embedded.update(
            """PREFIX irt: <https://w3id.org/irtwin#> INSERT DATA {
              <urn:s> irt:series_of <urn:run> ; irt:Series_Kind "measured" ; irt:File "../secret.parquet" }"""
        )
        table = other.query("SELECT (series:mean(<urn:run>, 'power', 0, 1) AS ?value) {}")
    assert table[0]["value"] is None
    assert "leads outside the workspace" in "".join(table.faults)


def test_every_function_is_described_in_the_ontology(tmp_path: Path) -> None:
    graph = ontology_graph(tmp_path)
    told = graph.query("SELECT ?f { ?f a irt:Series_Function ; rdfs:label ?l ; skos:definition ?d ; skos:example ?e }")
    assert {row["f"] for row in told} == {name.value for name in graph._functions({}) if name.value.startswith(SERIES)}
