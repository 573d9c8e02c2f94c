"""The ontology and the service's description, as clients that others wrote read them."""

from __future__ import annotations

import pytest
import rdflib
from rdflib.compare import isomorphic
from tests.endpoint import CLIENT

from irtwin.resources import folder

pytestmark = pytest.mark.slow

FORMATS = {
    "text/turtle": "turtle",
    "application/n-triples": "nt",
    "application/rdf+xml": "xml",
    "application/ld+json": "json-ld",
}
SD = rdflib.Namespace("http://www.w3.org/ns/sparql-service-description#")
MODULES = sorted(folder("ontology").glob("*.ttl"))


@pytest.mark.parametrize("file", MODULES, ids=lambda file: file.stem)
def test_each_module_is_at_its_iri_and_at_its_version_iri(server, file) -> None:
    module = rdflib.Graph().parse(file)
    iri = module.value(predicate=rdflib.RDF.type, object=rdflib.OWL.Ontology)
    for address in (iri, module.value(iri, rdflib.OWL.versionIRI)):
        response = server.get(str(address).removeprefix("https://w3id.org"))
        assert response.headers["content-type"] == "text/turtle; charset=utf-8"
        assert response.content == file.read_bytes()


@pytest.mark.parametrize("media_type", FORMATS)
def test_in_each_form_it_says_the_same(server, media_type: str) -> None:
    response = server.get("/irtwin/robot", Accept=f"{media_type}, */*;q=0.1")
    assert response.headers["content-type"].startswith(media_type)
    assert response.headers["vary"].partition(",")[0] == "Accept"  # and the packing, where it is packed
    received = rdflib.Graph().parse(data=response.content, format=FORMATS[media_type])
    assert isomorphic(received, rdflib.Graph().parse(folder("ontology") / "robot.ttl"))


def test_what_there_is_not(server) -> None:
    missing = server.get("/irtwin/nothing")
    assert missing.status_code == 404 and "there are /irtwin, " in missing.text
    assert server.get("/irtwin", Accept="image/png").status_code == 406
    assert CLIENT.post(f"{server.url}/irtwin").status_code == 405


@pytest.mark.parametrize("media_type", FORMATS)
def test_the_service_describes_itself(server, media_type: str) -> None:
    response = server.get("/sparql", Accept=media_type)
    description = rdflib.Graph().parse(data=response.content, format=FORMATS[media_type])
    service = description.value(predicate=rdflib.RDF.type, object=SD.Service)
    assert description.value(service, SD.endpoint) == rdflib.URIRef(server.sparql)
    assert set(description[service : SD.supportedLanguage]) == {SD.SPARQL11Query}
    assert len(set(description[service : SD.resultFormat])) == 8
    dataset = description.value(service, SD.defaultDataset)
    names = {str(description.value(graph, SD.name)) for graph in description[dataset : SD.namedGraph]}
    known = CLIENT.get(server.sparql, params={"query": "SELECT DISTINCT ?g { GRAPH ?g { ?s ?p ?o } }"}).json()
    assert names == {row["g"]["value"] for row in known["results"]["bindings"]}


def test_a_browser_gets_the_page_instead(server) -> None:
    accept = "text/html,application/xhtml+xml,application/xml;q=0.9,*/*;q=0.8"
    response = server.get("/sparql", Accept=accept)
    assert response.headers["content-type"] == "text/html; charset=utf-8"
    documentation = server.get("/irtwin", Accept=accept)
    assert documentation.headers["content-type"] == "text/html; charset=utf-8"
    assert "Industrial_Robot" in documentation.text and "Content-Security-Policy" in documentation.text
    assert server.get("/sparql", Accept="image/png").status_code == 406
    assert server.get("/sparql").headers["content-type"].startswith("text/turtle")


def test_the_competency_questions_are_a_page_that_every_page_leads_to(server) -> None:
    questions = server.get("/questions")
    assert (questions.status_code, questions.headers["content-type"]) == (200, "text/html; charset=utf-8")
    assert 'id="energy_per_joint"' in questions.text
    assert 'href="/questions"' in server.get("/query").text
