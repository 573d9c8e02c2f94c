import csv
import io
import json
import re
from datetime import UTC, datetime

import pytest

from irtwin.errors import InputError
from irtwin.knowledge.questions.queries import ask, to_csv, to_json
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.table import AnswerTable


def test_sparql_is_asked_as_it_is(graph: KnowledgeGraph) -> None:
    assert ask(graph, "ASK { ?twin irt:twin_of ?robot }")[0] == {"answer": True}


def test_unknown_name_is_met_with_the_nearest(graph: KnowledgeGraph) -> None:
    with pytest.raises(InputError, match=r"'energy_per_runs'.*did you mean energy_per_run\?"):
        ask(graph, "energy_per_runs")
    with pytest.raises(InputError, match="`irtwin query` alone lists them; SPARQL begins with SELECT"):
        ask(graph, "xyzzy")


def test_a_term_that_the_ontology_lacks_is_told_where_nothing_is_found(graph: KnowledgeGraph) -> None:
    asked = ask(graph, "SELECT ?run { ?run irt:Energy_Consumtion ?energy ; irt:run_of ?robot }")
    assert list(asked.faults) == ["the ontology has no irt:Energy_Consumtion: did you mean irt:Energy_Consumption?"]
    assert not ask(graph, "SELECT ?run { ?run irt:Run_Name 'none' }").faults


TABLE = AnswerTable(
    ("name", "value", "time", "nothing"),
    (
        {"name": 'a "b",c', "value": 1.5, "time": datetime(2026, 3, 2, tzinfo=UTC), "nothing": None},
        {"name": "ü", "value": float("nan"), "time": None, "nothing": None},
    ),
)


def test_json_has_null_for_what_is_not_there() -> None:
    assert json.loads(to_json(TABLE)) == [
        {"name": 'a "b",c', "value": 1.5, "time": "2026-03-02T00:00:00+00:00", "nothing": None},
        {"name": "ü", "value": None, "time": None, "nothing": None},
    ]


def test_a_notebook_shows_a_table() -> None:
    shown = AnswerTable(
        ("name", "value"), ({"name": "<a>", "value": 1.23456}, {"name": None, "value": 2})
    )._repr_html_()
    head, first, second = re.findall(r"<tr>(.*?)</tr>", shown)
    assert head == "<th>name</th><th>value</th>"
    assert (first, second) == ("<td>&lt;a&gt;</td><td>1.235</td>", "<td></td><td>2</td>")


def test_csv_reads_back() -> None:
    rows = list(csv.reader(io.StringIO(to_csv(TABLE))))
    assert rows[0] == ["name", "value", "time", "nothing"]
    assert rows[1] == ['a "b",c', "1.5", "2026-03-02T00:00:00+00:00", ""]
