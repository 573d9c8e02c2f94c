"""What users assert: kept in the database with its author, followed by rows and graph, explained, refused whole."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from pyoxigraph import NamedNode, Quad, RdfFormat, Triple, parse, serialize
from sqlalchemy import select

from irtwin.asking import ask, explain, export
from irtwin.asserting import follow, keep
from irtwin.errors import InputError
from irtwin.knowledge import by_parts, parts
from irtwin.knowledge.owl_rl.beside import FactsClosure
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.named_graphs import in_graph
from irtwin.knowledge.store.snapshot import Snapshot
from irtwin.knowledge.vocabulary import (
    GRAPH_ASSERTED,
    GRAPH_CHANGED,
    GRAPH_MAPPED,
    GRAPH_ONTOLOGY,
    IRT,
    LIMIT,
    ONTOLOGY,
    OWL,
)
from irtwin.rewriting import conclude, fill, map_rows, rewriting
from irtwin.storage.asserted import AssertedFact
from irtwin.storage.database import Workspace
from irtwin.storage.schema import RunRow
from tests import small_fleet
from tests.data_sets import irtwin
from tests.mapped import said

pytestmark = pytest.mark.slow

RUN = "https://w3id.org/irtwin/id/run/Arm_A.check_1"
BY_LOT = (GRAPH_CHANGED, GRAPH_MAPPED)  # notes, and the name of the state of rows
PAYLOAD = f"SELECT ?kg {{ <{RUN}> irt:Payload ?kg }}"


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A workspace of four robots, with a graph that was reasoned over."""
    folder = tmp_path_factory.mktemp("made") / "place"
    with Workspace(folder) as place:
        small_fleet.fill(place)
        with KnowledgeGraph(place.graph_folder, folder, place.resources, place.base) as graph:
            graph.load_ontology()
            map_rows(place, graph)
            conclude(graph, lambda line: None)
    return folder


@pytest.fixture
def workspace(made: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(made, tmp_path / "place"))


@pytest.fixture(scope="module")
def opened(made: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Workspace, KnowledgeGraph]]:
    copy = shutil.copytree(made, tmp_path_factory.mktemp("opened") / "place")
    with Workspace.existing(copy) as place, rewriting(place) as graph:
        yield place, graph


def update(workspace: Path, text: str, author: str = "anna") -> None:
    """Do an update as `irtwin serve` does in a process of its own."""
    with Workspace.existing(workspace) as place, rewriting(place) as graph:
        follow(place, graph, keep(place, graph, *graph.difference(text), author))


def rows(workspace: Path, question: str) -> list[tuple[object, ...]]:
    return [tuple(row.values()) for row in ask(question, workspace).rows]


def test_a_payload_that_is_updated_is_a_row_and_a_fact_of_its_author(workspace: Path) -> None:
    payload = f"<{RUN}> irt:Payload"
    update(workspace, f"DELETE {{ {payload} ?o }} INSERT {{ {payload} 5.5 }} WHERE {{ {payload} ?o }}")
    assert rows(workspace, PAYLOAD) == [(5.5,)]
    with Workspace.existing(workspace) as place, place.reading() as session:
        assert session.get_one(RunRow, "Arm_A.check_1").payload_kg == 5.5
        fact = session.scalars(select(AssertedFact).where(AssertedFact.about_robot == "Arm_A")).one()
        assert (fact.author, fact.value, fact.replaced, fact.place) == ("anna", "5.5", "3.0", "run.payload_kg")
    (said,) = explain(f"<{RUN}> irt:Payload ?", workspace)
    assert said.by.startswith("asserted by anna, ") and ", in place of 3.0, id:asserted_fact/" in said.by
    assert ("payload", "5.5", "3.0", "anna") in [row[1:5] for row in rows(workspace, "asserted_facts")]


def test_it_is_reasoned_over_once_and_the_graph_is_that_of_rows_read_anew(
    workspace: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    closed: list[int] = []

    class Counted(FactsClosure):
        def __init__(self, *given: Any) -> None:
            closed.append(1)
            super().__init__(*given)

    monkeypatch.setattr(by_parts, "FactsClosure", Counted)
    told = f'<{RUN}> irt:Product "bolts" ; a <urn:plant/Night_Shift> . <urn:a> rdfs:label "elsewhere"'
    update(workspace, f"INSERT DATA {{ {told} }}")
    assert closed == [1]
    changed = f"DELETE {{ ?r irt:Payload 3.0e0 }} INSERT {{ ?r irt:Payload 2 }} WHERE {{ BIND(<{RUN}> AS ?r) }}"
    update(workspace, changed)
    with Snapshot(workspace / "graph") as snapshot:
        followed = said(snapshot.graph, *BY_LOT)
    assert followed == made_anew(workspace)


def test_a_graph_of_an_older_ontology_is_brought_up_to_date_before_it_is_updated(workspace: Path) -> None:
    lacking = NamedNode(f"{IRT}Regenerating_Run")
    with Workspace.existing(workspace) as place, KnowledgeGraph.of_workspace(place) as graph:
        older = {it for it in graph.triples(GRAPH_ONTOLOGY) if lacking not in it and it.subject.value != ONTOLOGY}
        graph.replace(in_graph(older, GRAPH_ONTOLOGY), GRAPH_ONTOLOGY)
        assert not graph.has_ontology
    told: list[str] = []
    with Workspace.existing(workspace) as place, rewriting(place, told.append) as graph:
        assert told[0] == "Catching up: the graph is of another ontology or tariff than hold now"
        assert graph.has_ontology and not graph.is_behind
    assert rows(workspace, "SELECT ?label { irt:Regenerating_Run rdfs:label ?label }") == [("regenerating run",)]


def made_anew(workspace: Path) -> set[Quad]:
    """Return what a graph says that is made of the same database in one go."""
    with Workspace.existing(workspace) as place, KnowledgeGraph(None, workspace, base=place.base) as graph:
        place.mapped_rows.unlink()
        fill(place, graph, lambda line: None)
        return said(graph, *BY_LOT)


def test_what_no_table_holds_stays_a_triple_and_can_be_taken_back(workspace: Path) -> None:
    told = (
        f'<{RUN}> a <urn:plant/Night_Shift> ; rdfs:comment "leise"@de . GRAPH <urn:mine> {{ <urn:a> <urn:b> <urn:c> }}'
        "<https://w3id.org/irtwin/tariff/electricity> irt:Energy_Price 0.25e0 ; irt:Currency 'EUR' ."
    )
    update(workspace, f"INSERT DATA {{ {told} }}")
    with Workspace.existing(workspace) as place, KnowledgeGraph(None, workspace) as anew:
        map_rows(place, anew)
        assert len(anew.triples(GRAPH_ASSERTED)) == 4
    night = f"SELECT ?t {{ <{RUN}> a ?t FILTER(STRSTARTS(STR(?t), 'urn:')) }}"
    assert rows(workspace, night) == [("urn:plant/Night_Shift",)]
    priced = f"<{RUN}> irt:Energy_Cost ?cost ; irt:Energy_Consumption ?energy"
    price = f"SELECT (?cost / ?energy * 3.6e6 AS ?price) {{ {priced} }}"
    assert rows(workspace, price) == [(pytest.approx(0.25),)]
    (why,) = explain(f"<{RUN}> rdfs:comment ?", workspace)
    assert why.by.startswith("asserted by anna, ")
    update(workspace, f"DELETE DATA {{ {told} }}")
    assert rows(workspace, night) == rows(workspace, "SELECT ?o { GRAPH <urn:mine> { ?s ?p ?o } }") == []
    assert rows(workspace, price) == []
    with Workspace.existing(workspace) as place, place.reading() as session:
        of_no_table = select(AssertedFact).where(AssertedFact.author == "anna", AssertedFact.place.is_(None))
        assert session.scalars(of_no_table).all() == []


def test_a_limit_that_is_set_is_followed_by_classes_until_it_is_taken_back(workspace: Path) -> None:
    value = (
        "SELECT ?value ?source { limit:idle_share irt:Limit_Value ?value ; <http://purl.org/dc/terms/source> ?source }"
    )
    heavy = "SELECT ?run { ?run a irt:Idle_Heavy_Run } ORDER BY ?run"
    shipped = rows(workspace, value), rows(workspace, heavy)
    assert shipped[0][0][0] == 0.5 and len(shipped[1]) == 1
    update(workspace, "INSERT DATA { limit:idle_share irt:Limit_Value 0.85 }")
    closed = parts._schema.cache_info().misses
    update(workspace, "INSERT DATA { limit:idle_share irt:Limit_Value 0.95 }", "bert")
    assert parts._schema.cache_info().misses == closed + 1  # what was tried is what holds
    ((now, source),) = rows(workspace, value)
    assert now == 0.95 and source.startswith("bert, ") and source.endswith(", in place of 0.85")
    assert rows(workspace, heavy) == []
    (why,) = explain("limit:idle_share irt:Limit_Value ?", workspace)
    assert why.by.startswith("asserted by bert, ") and ", in place of 0.85, " in why.by
    (of_source,) = explain("limit:idle_share <http://purl.org/dc/terms/source> ?", workspace)
    assert of_source.because == (why,)
    anew = made_anew(workspace)  # as after a repair, or with the ontology of another version
    with Snapshot(workspace / "graph") as snapshot:
        kept = said(snapshot.graph, *BY_LOT)
        assert {quad for quad in kept if str(quad.subject).startswith(f"<{LIMIT}")} <= anew
    update(workspace, "DELETE WHERE { limit:idle_share irt:Limit_Value ?value }")
    assert (rows(workspace, value), rows(workspace, heavy)) == shipped
    assert "limit value" not in [row[1] for row in rows(workspace, "asserted_facts")]


def test_the_tariff_of_plant_toml_is_changed_there(workspace: Path) -> None:
    (workspace / "plant.toml").write_text('price_per_kwh = 0.2\ncurrency = "EUR"\n', encoding="utf-8")
    for text in ("DELETE WHERE { TARIFF irt:Energy_Price ?p }", "INSERT DATA { TARIFF irt:Energy_Price 0.3 }"):
        with pytest.raises(
            InputError, match=r"irt:Energy_Price: stands in the workspace's plant.toml; change it there"
        ):
            update(workspace, text.replace("TARIFF", "tariff:electricity"))


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("DELETE WHERE { limit:idle_share irt:Limit_Value ?v }", "irt:Limit_Value: needs a value"),
        ("INSERT DATA { limit:idle_share irt:Limit_Value 0.1, 0.2 }", "has one value, not 2"),
        ("INSERT DATA { limit:idle_share irt:Limit_Value 'INF'^^xsd:double }", "cannot be inf"),
        ("INSERT DATA { limit:idle_share irt:Limit_Value 'half' }", "is a number, not"),
        ("DELETE DATA { <RUN> irt:Payload 3.0e0 }", "irt:Payload: needs a value"),
        ("INSERT DATA { <RUN> irt:Payload 1, 2 }", "has one value, not 2"),
        ("INSERT DATA { <RUN> irt:Payload 'much' }", "is a number, not"),
        ("INSERT DATA { <RUN> irt:Payload 'INF'^^xsd:double }", "payload_kg 'inf' is none that irtwin writes"),
        ("INSERT DATA { <RUN> irt:Payload -1 }", "refused, nothing changed: .*payload is one number, 0 kg or more"),
        ("INSERT DATA { <RUN> irt:Product 5 }", "is a text, not"),
        ("INSERT DATA { <RUN> }", "not a SPARQL update"),
        ("INSERT DATA { id:run\\/Arm_A.none irt:Payload 5 }", "the database has no such run"),
        ("INSERT DATA { <RUN> irt:Run_Time 5.0e0 }", "irtwin takes it from logs and files, or works it out"),
        ("DELETE WHERE { <RUN> irt:Run_Time ?s }", "cannot be taken out: it was taken in with a data set"),
        ("DELETE WHERE { <RUN> irt:Energy_Consumption ?s }", "cannot be taken out: a provider worked it out"),
        ("INSERT DATA { <RUN> irt:Paylod 5 }", r"the ontology has no irt:Paylod: did you mean irt:Payload\?"),
        ("INSERT DATA { <RUN> a irt:Overloaded_Run }", "irt:Overloaded_Run is concluded; change what it is concluded"),
        ("INSERT DATA { <RUN> a irt:Industrial_Robot }", r"refused, nothing changed: .*\(OWL 2 RL rule cax-adc\)"),
        ("DELETE WHERE { irt:Payload rdfs:label ?l }", "it stands in the ontology"),
        ("INSERT DATA { GRAPH <https://w3id.org/irtwin/graph/source/x> { <RUN> <urn:p> 1 } }", "is irtwin's own"),
        ("DROP ALL", "blank nodes cannot be asserted or taken out"),
        ("LOAD <file:///etc/passwd>", "LOAD and SERVICE read from elsewhere"),
    ],
)
def test_what_nobody_can_assert_is_refused_whole(opened: tuple[Workspace, KnowledgeGraph], text: str, why: str) -> None:
    place, graph = opened
    with pytest.raises(InputError, match=why):
        keep(place, graph, *graph.difference(text.replace("<RUN>", f"<{RUN}>")), "anna")
    assert place.facts_about("Arm_A") == []
    assert [row["kg"] for row in graph.query(PAYLOAD).rows] == [3.0]
    assert not graph.is_behind


def test_an_edited_export_comes_back_as_a_difference(workspace: Path, tmp_path: Path) -> None:
    owl = tmp_path / "edited.owl"
    export(owl, workspace)
    assert irtwin("import", workspace, "--owl", owl).err.strip().endswith("Nothing was taken.")
    text = owl.read_text(encoding="utf-8")
    payload = '<irt:Payload rdf:datatype="http://www.w3.org/2001/XMLSchema#double">3'
    place = text.index(payload)
    text = text[:place] + text[place:].replace(">3", ">5.5", 1)
    owl.write_text(text, encoding="utf-8")
    shown = irtwin("import", workspace, "--owl", owl)
    assert shown.status == 2 and "say --yes" in shown.err
    assert "- id:run/Arm_A.check_1 irt:Payload" in shown.out and "+ id:run/Arm_A.check_1 irt:Payload" in shown.out
    taken = irtwin("import", workspace, "--owl", owl, "--yes", "--author", "bert")
    assert (taken.status, taken.err.strip().splitlines()[-1]) == (0, TAKEN), taken.err
    assert rows(workspace, PAYLOAD) == [(5.5,)]
    with Workspace.existing(workspace) as again, again.reading() as session:
        assert {fact.author for fact in session.scalars(select(AssertedFact))} == {"anna", "bert"}


def test_an_axiom_that_an_editor_writes_from_its_other_end_is_no_difference(workspace: Path, tmp_path: Path) -> None:
    owl, turned, disjoint = tmp_path / "edited.owl", tmp_path / "edited.ttl", NamedNode(f"{OWL}disjointWith")
    export(owl, workspace)
    said = [quad.triple for quad in parse(path=str(owl), format=RdfFormat.RDF_XML)]
    kept = [it for it in said if it.predicate != disjoint]
    assert len(kept) < len(said)
    kept += [Triple(it.object, disjoint, it.subject) for it in said if it.predicate == disjoint]
    serialize(kept, str(turned), RdfFormat.TURTLE)
    assert irtwin("import", workspace, "--owl", turned).err.strip().endswith("Nothing was taken.")


TAKEN = "Taken. Run the data set again, by `irtwin run`, to have the twin follow."


def test_a_file_that_says_nothing_of_the_workspace_is_refused(workspace: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.ttl"
    other.write_text("<urn:a> <urn:b> <urn:c> .")
    said = irtwin("import", workspace, "--owl", other, "--yes")
    assert said.status == 2 and "says nothing that this workspace says" in said.err
    assert irtwin("import", workspace, "--owl", tmp_path / "x.doc").err.count("no RDF format has this suffix") == 1
