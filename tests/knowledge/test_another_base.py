"""A plant's own base of individuals: all that is said and asked is what it is below the default, but for the names."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass
from pathlib import Path

import httpx
import pytest
from pyoxigraph import Quad, QueryResultsFormat, QueryTriples, RdfFormat, serialize
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import Response
from tests import small_fleet
from tests.mapped import MAPPINGS

from irtwin import asking
from irtwin.knowledge.explain.explain import explain
from irtwin.knowledge.mapping import refresh
from irtwin.knowledge.questions.queries import ask, named_questions
from irtwin.knowledge.reasoning import reason
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_ONTOLOGY, GRAPH_REASONED, GRAPH_SOURCE, ID
from irtwin.serve import individuals
from irtwin.serve.asking import Asking
from irtwin.serve.pool import AnswerHead
from irtwin.serve.protocol import Refusal
from irtwin.storage.database import Workspace

pytestmark = pytest.mark.slow
PLANT = "https://plant.example/energy/"
# What has blank nodes, and which database and statements the rest was made of.
UNLIKE = (GRAPH_ONTOLOGY, f"{GRAPH_SOURCE}version", GRAPH_REASONED)


@dataclass
class Filled:
    """A workspace of four robots, as it stands below a base."""

    folder: Path
    graph: KnowledgeGraph

    def quads(self) -> set[str]:
        """Return what it says, as if it lay below the default."""
        return {default(one) for one in self.graph.quads() if one.graph_name.value not in UNLIKE}  # type: ignore[union-attr]


def default(said: Quad | str | object) -> str:
    return str(said).replace(PLANT, ID)


@pytest.fixture(scope="module")
def two(tmp_path_factory: pytest.TempPathFactory) -> tuple[Filled, Filled]:
    """Return the same workspace below the default and below PLANT."""
    return tuple(_filled(tmp_path_factory.mktemp("base"), base) for base in (None, PLANT))  # type: ignore[return-value]


def _filled(place: Path, base: str | None) -> Filled:
    with Workspace(place, base=base) as workspace:
        small_fleet.fill(workspace)
        with KnowledgeGraph(place / "graph", base=workspace.base) as graph:
            graph.load_ontology()
            refresh(graph, workspace.engine, MAPPINGS, workspace.mapped_rows)
            reason(graph)
    return Filled(place, KnowledgeGraph(place / "graph", read_only=True))  # which only the graph tells of its base


def test_each_triple_is_the_same(two: tuple[Filled, Filled]) -> None:
    here, there = two
    assert there.graph.base == PLANT and here.graph.base == ID
    assert len(there.quads()) > 3000 and there.quads() == here.quads()
    assert [one for one in there.graph.quads() if ID in str(one)] == []


def test_each_question_has_the_same_answer(two: tuple[Filled, Filled]) -> None:
    answered = 0
    for name in named_questions():
        here, there = (sorted(default(row) for row in ask(one.graph, name, None).rows) for one in two)
        assert there == here, name
        answered += bool(here)
    assert answered > 40


@pytest.mark.parametrize(
    "triple", ["id:run/Arm_A.fit_1 irt:Energy_Consumption", "id:robot/Arm_A/information irt:IR_Name"]
)
def test_an_explanation_is_the_same(two: tuple[Filled, Filled], triple: str) -> None:
    here, there = ([str(one) for one in explain(it.graph, triple)] for it in two)
    assert there == here and "id:" in there[0]


def test_names_below_the_base_need_no_more(two: tuple[Filled, Filled]) -> None:
    name = "SELECT ?name { <robot/Arm_A> irt:has_Information / irt:IR_Name ?name . id:robot\\/Arm_A a ?any } LIMIT 1"
    for one in two:
        assert one.graph.query(name).rows == ({"name": "Arm_A"},)
        of = one.graph.query("SELECT ?name { ?arm irt:has_Information / irt:IR_Name ?name }", {"arm": "robot/Arm_A"})
        assert of.rows == ({"name": "Arm_A"},)


def test_an_update_names_individuals_so(tmp_path: Path) -> None:
    with KnowledgeGraph(base=PLANT) as graph:
        graph.update('INSERT DATA { id:robot\\/x irt:Note "a" . <robot/y> irt:Note "b" }')
        assert {one.subject.value for one in graph.triples()} == {f"{PLANT}robot/x", f"{PLANT}robot/y"}


def test_the_exported_file_names_them_so(two: tuple[Filled, Filled], tmp_path: Path) -> None:
    asking.export(tmp_path / "whole.owl", two[1].folder)
    text = (tmp_path / "whole.owl").read_text(encoding="utf-8")
    assert f"{PLANT}robot/Arm_A" in text and ID not in text


class Asked(Asking):
    """Asks a graph in this process, where a server asks its workers."""

    def __init__(self, graph: KnowledgeGraph) -> None:
        self.base, self._graph = graph.base, graph

    async def _all(self, client: str, asked: list[tuple[str, str]]) -> list[tuple[AnswerHead, bytes]]:
        return [self._written(text, accept) for text, accept in asked]

    def _written(self, text: str, accept: str) -> tuple[AnswerHead, bytes]:
        found = self._graph.answer(text)
        if isinstance(found, QueryTriples):
            return AnswerHead("text/turtle", None, None), serialize(found, format=RdfFormat.TURTLE) or b""
        return AnswerHead(accept, None, None), found.serialize(format=QueryResultsFormat.JSON) or b""


def test_individuals_answer_at_their_iris(two: tuple[Filled, Filled]) -> None:
    app = Starlette(
        routes=individuals.routes(Asked(two[1].graph), two[1].graph.resources), exception_handlers={Refusal: _status}
    )

    def got(path: str, accept: str) -> httpx.Response:
        async def get() -> httpx.Response:
            async with httpx.AsyncClient(
                transport=httpx.ASGITransport(app), base_url="https://plant.example"
            ) as client:
                return await client.get(path, headers={"Accept": accept})

        return asyncio.run(get())

    page = got("/energy/robot/Arm_A", "text/html").text
    assert 'href="/energy/joint/Arm_A/j1"' in page and 'href="/irtwin#has_Joint"' in page
    assert f"<{PLANT}robot/Arm_A> " in got("/energy/robot/Arm_A", "text/turtle").text
    for nobody in ("/energy/robot/nobody", "/irtwin/id/robot/Arm_A"):
        assert got(nobody, "text/html").status_code == 404
    assert got("/irtwin/effect/copper_loss", "text/html").status_code == 200


def _status(request: Request, error: Exception) -> Response:
    assert isinstance(error, Refusal)
    return Response(error.message, error.status)


def test_mappings_that_ship_leave_the_base_to_the_workspace() -> None:
    for file in MAPPINGS:
        assert ID not in file.read_text(encoding="utf-8"), file.name
