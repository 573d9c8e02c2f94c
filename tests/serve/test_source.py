"""`irtwin serve --graph`: pages and endpoint where a SPARQL server keeps the graph."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import psutil
import pytest
from pyoxigraph import RdfFormat, parse
from starlette.testclient import TestClient
from tests import rows
from tests.data_sets import refused
from tests.endpoint import TOKEN, TWO_ROBOTS
from tests.sparql_servers import Running, oxigraph

from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_ACTIVITY, GRAPH_SOURCE
from irtwin.location import Location
from irtwin.serve import server
from irtwin.serve.pool import Limits, Pool, Worker
from irtwin.serve.protocol import Operation, Refusal
from irtwin.serve.updates import Updates
from irtwin.storage.database import Workspace

pytestmark = pytest.mark.slow

SECRET = "do-not-tell"
COUNT = "SELECT (COUNT(*) AS ?n) { ?robot a irt:Industrial_Robot }"


@pytest.fixture(scope="module")
def keeper() -> Iterator[Running]:
    with oxigraph() as running:
        yield running


def with_password(keeper: Running) -> str:
    return keeper.url.replace("//", f"//me:{SECRET}@")


@pytest.fixture(scope="module")
def served(keeper: Running, tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    with KnowledgeGraph(keeper.url) as graph:
        graph.load_ontology()
        graph.replace(parse(path=str(TWO_ROBOTS), format=RdfFormat.TRIG), GRAPH_SOURCE, GRAPH_ACTIVITY)
    place = Location(tmp_path_factory.mktemp("workspace"), graph_url=with_password(keeper))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(server, "Pool", lambda place, size, limits: Pool(place, 1, limits))
        app = server.application(place, "127.0.0.1", token=TOKEN, limits=Limits())
    with TestClient(app, base_url="http://127.0.0.1") as client:
        yield client


def ask(served: TestClient, query: str, accept: str = "text/csv") -> tuple[int, str]:
    answer = served.get("/sparql", params={"query": query}, headers={"Accept": accept})
    return answer.status_code, answer.text


def test_pages_and_endpoint_ask_it(served: TestClient) -> None:
    for path in ("/", "/robot/Arm_A", "/irtwin/id/robot/Arm_A"):
        page = served.get(path, headers={"Accept": "text/html"})
        assert (page.status_code, "Arm_A" in page.text, SECRET in page.text) == (200, True, False), path
    assert ask(served, COUNT)[1].split() == ["n", "2"]
    assert ask(served, "ASK { ?s a irt:Industrial_Robot }") == (200, "true")
    made = ask(served, "CONSTRUCT { ?s a irt:Industrial_Robot } { ?s a irt:Industrial_Robot }", "text/turtle")
    assert made[1].count("a irt:Industrial_Robot") == 2
    assert ask(served, "SELECT ?s")[0] == 400
    assert ask(served, "SELECT * { SERVICE <http://127.0.0.1:1/> { ?s ?p ?o } }")[0] == 400


def test_updates_reach_it(served: TestClient, keeper: Running) -> None:
    update = partial(served.post, "/sparql", data={"update": "INSERT DATA { <http://e/s> <http://e/p> 1 }"})
    assert update(headers={"Authorization": "Bearer another"}).status_code == 401
    assert update(headers={"Authorization": f"Bearer {TOKEN}"}).status_code == 204
    with KnowledgeGraph(keeper.url) as graph:
        assert graph.query("ASK { GRAPH ?any { <http://e/s> <http://e/p> 1 } }")[0]["answer"]
    assert ask(served, "ASK { <http://e/s> <http://e/p> 1 }") == (200, "true")


def test_the_password_is_in_no_command(served: TestClient) -> None:
    commands = [
        " ".join(child.cmdline()) for child in psutil.Process().children() if child.status() != psutil.STATUS_ZOMBIE
    ]
    assert any("irtwin.serve.worker" in command for command in commands)
    assert not any(SECRET in command for command in commands)


def test_one_that_is_gone_is_told_without_its_address(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    async def asked() -> list[Refusal]:
        place = Location(tmp_path, graph_url=with_password(keeper))
        worker = await Worker.start(place, Limits())
        keeper.stop()
        told = []
        clear = Operation("update", "CLEAR ALL")
        update = Updates(place, TOKEN, Limits()).do(clear, "http://e/", f"Bearer {TOKEN}", "me")
        for asking in (worker.ask(Operation("query", "ASK {}"), "http://e/", "", False), update):
            with pytest.raises(Refusal) as refusal:
                await asking
            told.append(refusal.value)
        await worker.end()
        return told

    with oxigraph() as keeper:
        for refusal in asyncio.run(asked()):
            assert refusal.status == 502
            assert "does not answer" in refusal.message and "127" not in refusal.message
    said = capfd.readouterr().err  # for who runs the server
    assert (said.count(f"{keeper.url}: no SPARQL server answers"), SECRET in said) == (2, False)
    begun = refused("serve", "--workspace", tmp_path, "--graph", with_password(keeper))
    assert "no SPARQL server answers" in begun and SECRET not in begun


def test_a_graph_that_was_lost_is_told_where_the_database_is_known(tmp_path: Path) -> None:
    with oxigraph() as empty, Workspace(tmp_path) as place:
        place.ingest(*rows.data_set())
        database = f"sqlite:///{tmp_path / 'irtwin.db'}"
        said = refused("serve", "--workspace", tmp_path, "--graph", empty.url, "--database", database)
        assert "the graph is empty, though the database knows of robots; `irtwin workspace repair" in said
