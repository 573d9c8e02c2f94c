"""Individuals by the paths of their IRIs, in each form, as clients that others wrote read them."""

from __future__ import annotations

import pytest
import rdflib
from rdflib.compare import isomorphic
from tests import plants
from tests.endpoint import Server

pytestmark = pytest.mark.slow

ARM_A = "/irtwin/id/robot/Arm_A"
FORMATS = {
    "text/turtle": ("turtle", "ttl"), "application/n-triples": ("nt", "nt"),
    "application/rdf+xml": ("xml", "rdf"), "application/ld+json": ("json-ld", "jsonld"),
}  # fmt: skip


@pytest.mark.parametrize("media_type", FORMATS)
def test_in_each_form_it_says_what_the_graph_says(plant: Server, media_type: str) -> None:
    form, ending = FORMATS[media_type]
    known = rdflib.Graph().parse(
        data=plant.ask(f"DESCRIBE <https://w3id.org{ARM_A}>", Accept="text/turtle").content, format="turtle"
    )
    assert len(known) > 5
    accepted = plant.get(ARM_A, Accept=f"{media_type}, */*;q=0.1")
    asked = plant.get(f"{ARM_A}?as={ending}", Accept="text/html")
    for response in (accepted, asked):
        assert response.headers["content-type"].startswith(media_type) and response.headers["vary"].startswith("Accept")
        assert isomorphic(rdflib.Graph().parse(data=response.content, format=form), known)


def test_a_browser_gets_a_page(plant: Server) -> None:
    response = plant.get(ARM_A, Accept="text/html")
    assert response.headers["content-type"] == "text/html; charset=utf-8"
    assert response.headers["vary"].startswith("Accept")
    assert 'href="/irtwin#has_Joint"' in response.text and 'href="/irtwin/id/joint/Arm_A/j1"' in response.text
    assert plant.get(ARM_A).headers["content-type"].startswith("text/turtle")


@pytest.mark.parametrize("path", ["id/robot/nobody", "id/", "effect/none", "id/robot/a%3Eb", "id/%FF"])
def test_what_nobody_knows(plant: Server, path: str) -> None:
    response = plant.get(f"/irtwin/{path}")
    assert response.status_code == 404 and response.text.count("\n") == 1


def test_a_form_that_there_is_not(plant: Server) -> None:
    assert plant.get(ARM_A, Accept="image/png").status_code == 406


def test_letters_beyond_ascii(plant: Server) -> None:
    response = plant.get(plants.PLACE.removeprefix("https://w3id.org"), Accept="text/html")
    assert response.status_code == 200 and plants.PLACE in response.text


def test_individuals_of_the_ontology_have_pages_too(plant: Server) -> None:
    page = plant.get("/irtwin/effect/coulomb_friction", Accept="text/html")
    assert page.status_code == 200 and "Coulomb friction" in page.text and "the ontology" in page.text
