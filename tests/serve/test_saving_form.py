"""The form that says what was done: who may send it, what it keeps, and what it refuses."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlencode

import httpx
import pytest
from tests.endpoint import CLIENT, TOKEN, Server, serving

from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_ASSERTED
from irtwin.serve.protocol import Refusal
from irtwin.serve.saving_form import read_form

BASE = "https://w3id.org/irtwin/id/"
ACTION = f"{BASE}saving_action/Arm_A/switch_off_while_waiting"


def form(**said: str) -> bytes:
    return urlencode({"action": ACTION, "day": "2026-03-02", "by": "anna", "token": "t", **said}).encode()


def test_a_day_replaces_the_one_before_and_none_takes_it_back() -> None:
    said = read_form(form())
    assert (said.author, said.authorization) == ("anna", "Bearer t")
    graph = KnowledgeGraph()
    proposed = f"<{ACTION}> a irt:Saving_Action ; irt:saves_at id:robot\\/Arm_A ; irt:applies_Remedy <urn:off>"
    graph.update(f"INSERT DATA {{ GRAPH <urn:rules> {{ {proposed} }} }}")
    days = f"SELECT ?day {{ <{ACTION}> irt:Done_On ?day }}"
    for day, told in (("2026-03-01", ["2026-03-01"]), ("2026-03-02", ["2026-03-02"]), ("", [])):
        graph.update(read_form(form(day=day)).operation.text)
        assert [row["day"] for row in graph.query(days).rows] == told
    assert len(graph.triples(GRAPH_ASSERTED)) == 0 and len(graph.triples("urn:rules")) == 3


@pytest.mark.parametrize(
    ("said", "why"),
    [
        ({"action": ""}, "action '' is no IRI; take one of the list"),
        ({"action": f"{ACTION}> ?p ?o }} ; DROP ALL #"}, "is no IRI"),
        ({"day": "soon"}, "day: 'soon' is not a day: write it as 2026-03-02"),
        ({"by": "\udcff"}, "are not UTF-8"),
    ],
)
def test_what_is_wrong_is_a_line(said: dict[str, str], why: str) -> None:
    body = urlencode({"action": ACTION, **said}, errors="surrogateescape").encode()
    with pytest.raises(Refusal, match=why.replace("?", r"\?")):
        read_form(body)


@pytest.fixture(scope="module")
def writable(plant_place: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    folder = Path(shutil.copytree(plant_place, tmp_path_factory.mktemp("writable"), dirs_exist_ok=True))
    with serving(folder / "graph", "--timeout", 300) as running:
        yield running


@pytest.mark.slow
def test_what_was_done_is_kept_with_its_author(writable: Server) -> None:
    def post(**said: str) -> httpx.Response:
        headers = {"Content-Type": "application/x-www-form-urlencoded"}
        return CLIENT.post(f"{writable.url}/saving", content=form(token=TOKEN, **said), headers=headers, timeout=300)

    unknown = post(action=f"{BASE}robot/Arm_A")
    assert (unknown.status_code, "knows no saving action" in unknown.text) == (404, True)
    kept = post(by="Anna <b>")
    assert (kept.status_code, kept.headers.get("location"), kept.text) == (303, "/#saving", "")
    page = writable.get("/").text
    assert "<strong>too few runs</strong><small>done 2026-03-02 by Anna &lt;b&gt;</small>" in page
    assert "0 runs before, 1 after" in page and '<form action="/saving" method="post"' in page
    table = writable.get("/tables/actions.csv").text
    assert 'switch off while waiting,,"done, too few runs",2026-03-02,Anna <b>' in table


@pytest.mark.slow
def test_who_has_no_token_says_nothing(writable: Server, plant: Server) -> None:
    wrong = CLIENT.post(f"{writable.url}/saving", content=form(token="wrong"))
    assert (wrong.status_code, "needs the token" in wrong.text) == (401, True)
    closed = CLIENT.post(f"{plant.url}/saving", content=form())
    assert (closed.status_code, closed.text) == (403, "this endpoint is read-only\n")
    assert "with a token for updates" in plant.get("/").text
