"""The forms of the plant's pages: what they offer, who may send them, what they keep and refuse."""

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
from irtwin.knowledge.vocabulary import GRAPH_ASSERTED, ID, IRT, LIMIT, term
from irtwin.report.plant import page
from irtwin.resources import shipped
from irtwin.serve.forms import read_done, read_value
from irtwin.serve.protocol import Refusal
from irtwin.storage.asserted import FILLED

ACTION = f"{ID}saving_action/Arm_A/switch_off_while_waiting"
RUN = f"{ID}run/Arm_A.fit_1"
PAYLOAD = f"{RUN} {IRT}Payload"
STANDBY = f"{LIMIT}standby_share {IRT}Limit_Value"


def done(**said: str) -> bytes:
    return urlencode({"action": ACTION, "day": "2026-03-02", "by": "anna", "token": TOKEN, **said}).encode()


def value(**said: str) -> bytes:
    return urlencode({"what": PAYLOAD, "value": "5.5", "by": "anna", "token": TOKEN, **said}).encode()


def test_a_day_replaces_the_one_before_and_none_takes_it_back() -> None:
    said = read_done(done(token="t"))
    assert (said.author, said.authorization) == ("anna", "Bearer t")
    graph = KnowledgeGraph()
    proposed = f"<{ACTION}> a irt:Saving_Action ; irt:saves_at id:robot\\/Arm_A ; irt:applies_Remedy <urn:off>"
    graph.update(f"INSERT DATA {{ GRAPH <urn:rules> {{ {proposed} }} }}")
    days = f"SELECT ?day {{ <{ACTION}> irt:Done_On ?day }}"
    for day, told in (("2026-03-01", ["2026-03-01"]), ("2026-03-02", ["2026-03-02"]), ("", [])):
        graph.update(read_done(done(day=day)).operation.text)
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
def test_what_is_wrong_with_an_action_is_a_line(said: dict[str, str], why: str) -> None:
    body = urlencode({"action": ACTION, **said}, errors="surrogateescape").encode()
    with pytest.raises(Refusal, match=why.replace("?", r"\?")):
        read_done(body)


def test_a_value_is_a_literal_of_its_property_and_none_takes_it_out() -> None:
    said = read_value(value(value=' 5" . } ; DROP ALL #', token="t"))
    assert (said.author, said.authorization) == ("anna", "Bearer t")
    assert (
        said.operation("urn:kind").text
        == f'INSERT DATA {{ <{RUN}> <{IRT}Payload> "5\\" . }} ; DROP ALL #"^^<urn:kind> }}'
    )
    taken_out = read_value(value(value=" ")).operation("urn:kind")
    assert taken_out.text == f"DELETE WHERE {{ <{RUN}> <{IRT}Payload> ?value }}"


@pytest.mark.parametrize("what", ["", "x", f"{RUN}", f"{RUN}> ?p ?o . <x {IRT}Payload", f"{PAYLOAD} {RUN}"])
def test_what_is_not_of_the_list_is_a_line(what: str) -> None:
    with pytest.raises(Refusal, match="is not of the list"):
        read_value(value(what=what))


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


def post(server: Server, path: str, content: bytes, accept: str = "text/html") -> httpx.Response:
    headers = {"Content-Type": "application/x-www-form-urlencoded", "Accept": accept}
    return CLIENT.post(f"{server.url}{path}", content=content, headers=headers, timeout=300)


def say(server: Server, **said: str) -> httpx.Response:
    return post(server, "/say/Arm_A", value(**said))


@pytest.mark.slow
def test_what_was_done_is_kept_with_its_author(writable: Server) -> None:
    unknown = post(writable, "/saving", done(action=f"{ID}robot/Arm_A"))
    assert (unknown.status_code, "knows no saving action" in unknown.text) == (404, True)
    kept = post(writable, "/saving", done(by="Anna <b>"))
    assert (kept.status_code, kept.headers.get("location"), kept.text) == (303, "/#saving", "")
    page = writable.get("/").text
    assert "<strong>too few runs</strong><small>done 2026-03-02 by Anna &lt;b&gt;</small>" in page
    assert "0 runs before, 1 after" in page and '<form action="/saving" method="post"' in page
    table = writable.get("/tables/actions.csv").text
    assert 'switch off while waiting,,"done, too few runs",2026-03-02,Anna <b>' in table


@pytest.mark.slow
def test_who_has_no_token_says_nothing(writable: Server, plant: Server) -> None:
    wrong = post(writable, "/saving", done(token="wrong"), "*/*")
    assert (wrong.status_code, "needs the token" in wrong.text) == (401, True)
    closed = post(plant, "/saving", done(), "*/*")
    assert (closed.status_code, closed.text) == (403, "this endpoint is read-only\n")
    assert "with a token for updates" in plant.get("/").text


@pytest.mark.slow
def test_a_payload_and_a_limit_are_kept_and_shown(writable: Server) -> None:
    kept = say(writable)
    assert (kept.status_code, kept.headers.get("location")) == (303, "/robot/Arm_A#say")
    assert say(writable, what=STANDBY, value="0.7").status_code == 303
    shown = writable.get("/robot/Arm_A").text
    assert "fit_1: payload, kg: 5.5" in shown and "limit of the standby share: 0.7" in shown
    assert "by anna" in writable.get("/run/Arm_A.fit_1").text


@pytest.mark.slow
def test_a_refusal_says_why_on_the_page_and_leaves_the_form_as_it_was(writable: Server) -> None:
    refused = say(writable, value="-3", by='"><b>')
    assert refused.status_code == 400 and 'role="alert">refused, nothing changed' in refused.text
    assert "one number, 0 kg or more" in refused.text and "&#34;&gt;&lt;b&gt;" in refused.text
    assert f'value="{PAYLOAD}" selected' in refused.text
    assert "cannot be &#39;heavy&#39;; nothing changed." in say(writable, value="heavy").text


@pytest.mark.slow
def test_who_has_no_token_and_what_is_not_offered_is_turned_away(writable: Server, plant: Server) -> None:
    wrong = say(writable, token="guessed")
    assert wrong.status_code == 401 and 'role="alert">the token for updates is wrong; nothing changed' in wrong.text
    assert f'value="{PAYLOAD}" selected' in wrong.text and "guessed" not in wrong.text
    other = say(writable, what=f"{RUN} {IRT}Run_Time")
    assert (other.status_code, "has nothing to say of" in other.text) == (404, True)
    of_another = say(writable, what=f"{ID}run/Arm_B.pick_1 {IRT}Payload")
    assert of_another.status_code == 404
    assert say(plant).status_code == 403
    assert "with a token for updates" in plant.get("/robot/Arm_A").text
