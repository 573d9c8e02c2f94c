"""Clients that others wrote get the answers that the graph gives in this process."""

from __future__ import annotations

import pytest
import rdflib
from rdflib.plugins.stores.sparqlstore import SPARQLStore
from SPARQLWrapper import CSV, JSON, POST, RDFXML, TSV, TURTLE, XML, SPARQLWrapper
from SPARQLWrapper.SPARQLExceptions import QueryBadFormed

from irtwin.knowledge.questions.queries import named_questions
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import IRT, PREFIXES

pytestmark = pytest.mark.slow

ROBOTS = f"SELECT ?robot WHERE {{ ?robot a <{IRT}Industrial_Robot> }} ORDER BY ?robot"


def wrapper(server, query: str, form: str, method: str = "GET") -> SPARQLWrapper:
    client = SPARQLWrapper(server.sparql)
    client.setQuery(query)
    client.setReturnFormat(form)
    client.setMethod(method)
    return client


@pytest.mark.parametrize("method", ["GET", POST])
def test_sparqlwrapper_reads_every_form(server, method: str) -> None:
    by_json = wrapper(server, ROBOTS, JSON, method).queryAndConvert()["results"]["bindings"]
    robots = [row["robot"]["value"] for row in by_json]
    assert len(robots) == 2
    by_xml = wrapper(server, ROBOTS, XML, method).queryAndConvert()
    assert [node.firstChild.data for node in by_xml.getElementsByTagName("uri")] == robots
    assert wrapper(server, ROBOTS, CSV, method).queryAndConvert().decode().split() == ["robot", *robots]
    tsv = wrapper(server, ROBOTS, TSV, method).queryAndConvert().decode().split()
    assert tsv == ["?robot", *(f"<{robot}>" for robot in robots)]
    construct = f"CONSTRUCT WHERE {{ ?robot a <{IRT}Industrial_Robot> }}"
    assert len(wrapper(server, construct, RDFXML, method).queryAndConvert()) == 2
    turtle = wrapper(server, construct, TURTLE, method).queryAndConvert()
    assert len(rdflib.Graph().parse(data=turtle, format="turtle")) == 2


def test_sparqlwrapper_takes_a_refusal_for_one(server) -> None:
    with pytest.raises(QueryBadFormed, match="error at 1:"):
        wrapper(server, "SELECT nothing", JSON).query()


def test_rdflib_walks_the_graph(server) -> None:
    remote = rdflib.Graph(SPARQLStore(server.sparql, context_aware=False, method="POST"))
    with KnowledgeGraph(server.graph, read_only=True) as graph:
        assert len(remote) == len(graph.triples())
        (count,) = graph.query("SELECT (COUNT(*) AS ?n) { ?joint a irt:Robot_Joint }")
    joints = list(remote.subjects(rdflib.RDF.type, rdflib.URIRef(f"{IRT}Robot_Joint")))
    assert len(joints) == count["n"] > 0


def test_every_named_question_is_answered_as_in_this_process_with_prefixes_or_without(server) -> None:
    prologue = "".join(f"PREFIX {prefix}: <{space}>\n" for prefix, space in PREFIXES.items())
    with KnowledgeGraph(server.graph, read_only=True) as graph:
        for number, (name, question) in enumerate(named_questions().items()):
            expected = graph.query(question.text)
            answer = server.ask(prologue + question.text if number % 2 else question.text).json()
            assert answer["head"]["vars"] == list(expected.columns), name
            assert len(answer["results"]["bindings"]) == len(expected), name
