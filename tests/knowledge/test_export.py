from pathlib import Path

import owlready2
import pytest
import rdflib
from rdflib.namespace import OWL, RDF, RDFS
from tests.knowledge.test_as_swrl import IN_SWRL

from irtwin.knowledge import owl_dl  # noqa: F401  tells owlready2 where Java is
from irtwin.knowledge.rules.files import all_rules
from irtwin.knowledge.store.export import export_owl
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.resources import shipped

pytestmark = pytest.mark.slow

IRT = rdflib.Namespace("https://w3id.org/irtwin#")


@pytest.fixture(scope="module")
def exported(concluded: KnowledgeGraph, tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("export") / "deep" / "irtwin.owl"
    export_owl(concluded, file)
    return file


@pytest.fixture(scope="module")
def written(exported: Path) -> rdflib.Graph:
    """What is in the file."""
    return rdflib.Graph().parse(exported, format="xml")


@pytest.mark.nightly
def test_owlready2_opens_it_and_hermit_finds_it_consistent(exported: Path) -> None:
    world = owlready2.World()
    ontology = world.get_ontology(exported.as_uri()).load()
    assert world["https://w3id.org/irtwin#Idle_Heavy_Run"].instances()[0].Run_Name == "idle_1"
    assert {"Arm_A.fit_1", "Arm_B.work_2"} <= {one.name.rpartition("/")[2] for one in ontology.individuals()}
    owlready2.sync_reasoner_hermit(world, debug=0)
    assert list(world.inconsistent_classes()) == []


def test_it_is_one_ontology_that_imports_nothing(exported: Path, written: rdflib.Graph) -> None:
    assert list(written.subjects(RDF.type, OWL.Ontology)) == [rdflib.URIRef("https://w3id.org/irtwin")]
    assert (None, OWL.imports, None) not in written
    assert "shacl" not in exported.read_text(encoding="utf-8")


def test_everything_that_is_asserted_or_inferred_is_in_it(written: rdflib.Graph) -> None:
    runs = set(written.subjects(RDF.type, IRT.IR_RunProcess))
    assert len(runs) == 5
    assert all((run, RDF.type, OWL.NamedIndividual) in written for run in runs)
    assert {str(joint) for joint in written.objects(None, IRT.dominant_Joint)} == {
        f"https://w3id.org/irtwin/id/joint/Arm_{robot}/j{number}" for robot in "AB" for number in "12"
    }
    assert len(set(written.subjects(RDF.type, IRT.Effect))) == 46 + 3  # and what bodies take, in three


def test_each_individual_has_a_label_and_each_rule_is_there_or_named(written: rdflib.Graph) -> None:
    individuals = set(written.subjects(RDF.type, OWL.NamedIndividual))
    assert individuals - set(written.subjects(RDFS.label)) == set()
    run = rdflib.URIRef("https://w3id.org/irtwin/id/run/Arm_A.idle_1")
    assert str(written.value(run, RDFS.label)) == "run Arm_A.idle_1"
    imp = rdflib.URIRef("http://www.w3.org/2003/11/swrl#Imp")
    labels = {str(written.value(rule, RDFS.label)) for rule in written.subjects(RDF.type, imp)}
    in_swrl = {label for label in labels if not label.startswith("definition of ")}
    assert in_swrl == IN_SWRL
    comments = list(map(str, written.objects(rdflib.URIRef("https://w3id.org/irtwin"), RDFS.comment)))
    (said,) = [each for each in comments if each.startswith('The rule "returned share beyond the limit"')]
    assert said.endswith("it reckons, and HermiT takes no built-ins. What irtwin concluded by it is.")
    assert sum(each.startswith("The rule ") for each in comments) + len(in_swrl) == len(all_rules(shipped()))


def test_no_class_names_an_individual_but_rules_do(written: rdflib.Graph) -> None:
    assert not any(isinstance(value, rdflib.URIRef) for value in written.objects(None, OWL.hasValue))
    imp = rdflib.URIRef("http://www.w3.org/2003/11/swrl#Imp")
    labels = [str(written.value(rule, RDFS.label)) for rule in written.subjects(RDF.type, imp)]
    assert labels.count("definition of idle-heavy run") == 2
    assert labels.count("definition of gear overhaul") == 2


def test_times_are_cut_to_what_hermit_reads(concluded: KnowledgeGraph, exported: Path) -> None:
    assert ".106403Z" in "".join(map(str, concluded.triples()))
    text = exported.read_text(encoding="utf-8")
    assert "2026-03-05T12:00:01.106Z" in text
    assert ".106403Z" not in text


def test_failed_export_leaves_the_former_file(
    concluded: KnowledgeGraph, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "irtwin.owl"
    file.write_text("former")
    monkeypatch.setattr(Path, "replace", lambda *_: (_ for _ in ()).throw(OSError("disk full")))
    with pytest.raises(OSError):
        export_owl(concluded, file)
    assert file.read_text() == "former"
