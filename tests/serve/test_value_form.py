"""The form by which users say values on a robot's page: what it offers, who may send it, what it keeps and refuses."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlencode

import httpx
import pytest
from tests.endpoint import CLIENT, TOKEN, Server, serving

from irtwin.knowledge.explain.mapping import maps_of
from irtwin.knowledge.mapping.document import TermMap
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import IRT, LIMIT, term
from irtwin.report.plant import page
from irtwin.resources import shipped
from irtwin.serve.protocol import Refusal
from irtwin.serve.value_form import read_value
from irtwin.storage.asserted import FILLED

BASE = "https://w3id.org/irtwin/id/"
RUN = f"{BASE}run/Arm_A.fit_1"
PAYLOAD = f"{RUN} {IRT}Payload"
STANDBY = f"{LIMIT}standby_share {IRT}Limit_Value"


def form(**said: str) -> bytes:
    return urlencode({"what": PAYLOAD, "value": "5.5", "by": "anna", "token": TOKEN, **said}).encode()


def test_a_value_is_a_literal_of_its_property_and_none_takes_it_out() -> None:
    said = read_value(form(value=' 5" . } ; DROP ALL #', token="t"))
    assert (said.author, said.authorization) == ("anna", "Bearer t")
    assert (
        said.operation("urn:kind").text
        == f'INSERT DATA {{ <{RUN}> <{IRT}Payload> "5\\" . }} ; DROP ALL #"^^<urn:kind> }}'
    )
    assert read_value(form(value=" ")).operation("urn:kind").text == f"DELETE WHERE {{ <{RUN}> <{IRT}Payload> ?value }}"


@pytest.mark.parametrize("what", ["", "x", f"{RUN}", f"{RUN}> ?p ?o . <x {IRT}Payload", f"{PAYLOAD} {RUN}"])
def test_what_is_not_of_the_list_is_a_line(what: str) -> None:
    with pytest.raises(Refusal, match="is not of the list"):
        read_value(form(what=what))


def test_the_page_offers_all_that_rows_take_from_users_and_each_limit(plant_place: Path) -> None:
    filled = {
        pair.predicates[0].constant.value
        for _, triples_map in maps_of(shipped().of("mappings"))
        for pair in triples_map.properties
        for made in pair.objects
        if triples_map.table.table and isinstance(made, TermMap) and made.column is not None
        if made.column.name in FILLED.get(triples_map.table.table[-1].name, ())
    }
    with KnowledgeGraph(plant_place / "graph", read_only=True) as graph:
        rows = graph.query(page.questions("robot")["sayable"].text, {"robot": "robot/Arm_A"}).rows
        limits = {row["limit"] for row in graph.query("SELECT ?limit { ?limit a irt:Limit }")}
        notes = graph.query("SELECT ?note { ?note irt:note_of <robot/Arm_A> }").rows
    offered = {row["property"] for row in rows}
    assert offered | ({term("Note_Text")} if not notes else set()) == filled | {term("Limit_Value")}
    assert {row["about"] for row in rows if row["property"] == term("Limit_Value")} == limits
    assert all(row["range"] and row["label"] for row in rows)


@pytest.fixture(scope="module")
def writable(plant_place: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    folder = Path(shutil.copytree(plant_place, tmp_path_factory.mktemp("writable"), dirs_exist_ok=True))
    with serving(folder / "graph", "--timeout", 300) as running:
        yield running


def post(server: Server, **said: str) -> httpx.Response:
    headers = {"Content-Type": "application/x-www-form-urlencoded", "Accept": "text/html"}
    return CLIENT.post(f"{server.url}/say/Arm_A", content=form(**said), headers=headers, timeout=300)


@pytest.mark.slow
def test_a_payload_and_a_limit_are_kept_and_shown(writable: Server) -> None:
    kept = post(writable)
    assert (kept.status_code, kept.headers.get("location")) == (303, "/robot/Arm_A#say")
    assert post(writable, what=STANDBY, value="0.7").status_code == 303
    shown = writable.get("/robot/Arm_A").text
    assert "fit_1: payload, kg: 5.5" in shown and "limit of the standby share: 0.7" in shown
    assert "by anna" in writable.get("/run/Arm_A.fit_1").text


@pytest.mark.slow
def test_a_refusal_says_why_on_the_page_and_leaves_the_form_as_it_was(writable: Server) -> None:
    refused = post(writable, value="-3", by='"><b>')
    assert refused.status_code == 400 and 'role="alert">refused, nothing changed' in refused.text
    assert "one number, 0 kg or more" in refused.text and "&#34;&gt;&lt;b&gt;" in refused.text
    assert f'value="{PAYLOAD}" selected' in refused.text
    assert "cannot be &#39;heavy&#39;; nothing changed." in post(writable, value="heavy").text


@pytest.mark.slow
def test_who_has_no_token_and_what_is_not_offered_is_turned_away(writable: Server, plant: Server) -> None:
    wrong = post(writable, token="guessed")
    assert wrong.status_code == 401 and 'role="alert">the token for updates is wrong; nothing changed' in wrong.text
    assert f'value="{PAYLOAD}" selected' in wrong.text and "guessed" not in wrong.text
    other = post(writable, what=f"{RUN} {IRT}Run_Time")
    assert (other.status_code, "has nothing to say of" in other.text) == (404, True)
    of_another = post(writable, what=f"{BASE}run/Arm_B.pick_1 {IRT}Payload")
    assert of_another.status_code == 404
    assert post(plant).status_code == 403
    assert "with a token for updates" in plant.get("/robot/Arm_A").text
