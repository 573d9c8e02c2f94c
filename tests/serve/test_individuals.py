"""Individuals by the paths of their IRIs, in each form, as clients that others wrote read them."""

from __future__ import annotations

import httpx
import pytest
import rdflib
from rdflib.compare import isomorphic
from tests import plants
from tests.endpoint import Server

pytestmark = pytest.mark.slow

CLIENT = httpx.Client(timeout=60)
ARM_A = "https://w3id.org/irtwin/id/robot/Arm_A"
FORMATS = {
    "text/turtle": ("turtle", "ttl"), "application/n-triples": ("nt", "nt"),
    "application/rdf+xml": ("xml", "rdf"), "application/ld+json": ("json-ld", "jsonld"),
}  # fmt: skip


def here(server: Server, iri: str) -> str:
    return iri.replace("https://w3id.org", server.url)


@pytest.mark.parametrize("media_type", FORMATS)
def test_in_each_form_it_says_what_the_graph_says(plant: Server, media_type: str) -> None:
    form, ending = FORMATS[media_type]
    known = rdflib.Graph().parse(data=plant.ask(f"DESCRIBE <{ARM_A}>", Accept="text/turtle").content, format="turtle")
    assert len(known) > 5
    accepted = CLIENT.get(here(plant, ARM_A), headers={"Accept": f"{media_type}, */*;q=0.1"})
    asked = CLIENT.get(f"{here(plant, ARM_A)}?as={ending}", headers={"Accept": "text/html"})
    for response in (accepted, asked):
        assert response.headers["content-type"].startswith(media_type) and response.headers["vary"].startswith("Accept")
        assert isomorphic(rdflib.Graph().parse(data=response.content, format=form), known)


def test_a_browser_gets_a_page(plant: Server) -> None:
    response = CLIENT.get(here(plant, ARM_A), headers={"Accept": "text/html"})
    assert response.headers["content-type"] == "text/html; charset=utf-8" and response.headers["vary"].startswith(
        "Accept"
    )
    assert 'href="/irtwin#has_Joint"' in response.text and 'href="/irtwin/id/joint/Arm_A/j1"' in response.text
    assert CLIENT.get(here(plant, ARM_A)).headers["content-type"].startswith("text/turtle")


@pytest.mark.parametrize("path", ["id/robot/nobody", "id/", "effect/none", "id/robot/a%3Eb", "id/%FF"])
def test_what_nobody_knows(plant: Server, path: str) -> None:
    response = CLIENT.get(f"{plant.url}/irtwin/{path}")
    assert response.status_code == 404 and response.text.count("\n") == 1


def test_a_form_that_there_is_not(plant: Server) -> None:
    assert CLIENT.get(here(plant, ARM_A), headers={"Accept": "image/png"}).status_code == 406


def test_letters_beyond_ascii(plant: Server) -> None:
    response = CLIENT.get(here(plant, plants.PLACE), headers={"Accept": "text/html"})
    assert response.status_code == 200 and plants.PLACE in response.text


def test_individuals_of_the_ontology_have_pages_too(plant: Server) -> None:
    page = CLIENT.get(f"{plant.url}/irtwin/effect/coulomb_friction", headers={"Accept": "text/html"})
    assert page.status_code == 200 and "Coulomb friction" in page.text and "the ontology" in page.text
