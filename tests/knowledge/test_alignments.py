"""Alignments that a user may add: beside the model they contradict nothing, and they speak of terms that it has."""

from __future__ import annotations

from pathlib import Path

import pytest
from pyoxigraph import NamedNode, Quad, RdfFormat, Triple, parse

from irtwin.knowledge import owl_dl
from irtwin.knowledge.owl_rl.closure import Closure
from irtwin.knowledge.vocabulary import ONTOLOGY, OWL, RDF, RDFS
from irtwin.resources import folder, shipped

FILES = sorted((Path(folder("ontology")) / "alignments").glob("*.ttl"))
NAMES = [file.stem for file in FILES]
SAID = (RDFS + "subClassOf", RDFS + "subPropertyOf", "http://www.w3.org/2004/02/skos/core#")


def read(*files: Path) -> set[Triple]:
    return {quad.triple for file in files for quad in parse(path=str(file), format=RdfFormat.TURTLE)}


@pytest.fixture(scope="module")
def model() -> set[Triple]:
    return read(*folder("ontology").glob("*.ttl"))


@pytest.mark.parametrize("file", FILES, ids=NAMES)
def test_they_align_terms_of_the_model_with_declared_terms_of_others(file: Path, model: set[Triple]) -> None:
    said = read(file)
    declared = {one.subject.value for one in model | said if one.predicate.value == RDF + "type"}
    aligned = [
        one for one in said if one.subject.value.startswith(f"{ONTOLOGY}#") and one.predicate.value.startswith(SAID)
    ]
    assert len(aligned) >= 3
    for one in aligned:
        assert {one.subject.value, one.object.value} <= declared
        assert not one.object.value.startswith(ONTOLOGY)


def test_the_model_and_workspaces_go_without_them(model: set[Triple]) -> None:
    imported = {one.object.value for one in model if one.predicate.value == OWL + "imports"}
    assert not any("alignments/" in name for name in imported)
    assert not {file.name for file in shipped().of("ontology")} & {file.name for file in FILES}


def test_robots_and_runs_are_what_the_others_mean(model: set[Triple], two_robots: list[Quad]) -> None:
    """No Contradiction, and a robot has the types of the other vocabularies."""
    inferred = set(Closure(model | read(*FILES) | {quad.triple for quad in two_robots}).inferred())
    robot = NamedNode("https://w3id.org/irtwin/id/robot/Arm_A")
    types = {one.object.value for one in inferred if one.subject == robot and one.predicate.value == RDF + "type"}
    assert types >= {
        "http://purl.org/ieee1872-owl/cora-bare#Robot",
        "https://spec.industrialontologies.org/ontology/core/Core/MaterialArtifact",
        "https://saref.etsi.org/saref4inma/ProductionEquipment",
    }
    joint = NamedNode("https://w3id.org/irtwin/id/joint/Arm_A/j1")
    part = NamedNode("http://purl.org/ieee1872-owl/cora-bare#robotPart")
    assert Triple(joint, part, robot) in inferred


@pytest.mark.nightly
@pytest.mark.system
def test_hermit_finds_no_contradiction_and_no_class_empty(model: set[Triple]) -> None:
    owl_dl.classify(model | read(*FILES))  # or else it says which statements clash
