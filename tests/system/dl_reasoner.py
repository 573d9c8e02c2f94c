"""What DL reasoners conclude by an ontology's SWRL rules: python dl_reasoner.py JARS ONTOLOGY     (JARS: 'folder/*')

Loads the ontology through the OWL API, as Protégé does, and asks HermiT and Openllet for all individuals and links of
the classes and properties that its rules conclude. Prints a JSON object: the labels of the `rules`, what breaks
OWL 2 DL (`violations`), the `concluded` classes and properties, and by reasoner the triples found, in IRIs.
"""

from __future__ import annotations

import importlib
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jpype
from owl_api import start_java

TYPE = "http://www.w3.org/1999/02/22-rdf-syntax-ns#type"


def check(file: Path) -> dict[str, Any]:
    from org.semanticweb.owlapi.apibinding import OWLManager
    from org.semanticweb.owlapi.model import AxiomType
    from org.semanticweb.owlapi.profiles import OWL2DLProfile

    ontology = OWLManager.createOWLOntologyManager().loadOntologyFromOntologyDocument(jpype.java.io.File(str(file)))
    rules = list(ontology.getAxioms(AxiomType.SWRL_RULE))
    heads = {atom.getPredicate() for rule in rules for atom in rule.head().iterator()}
    found = {"HermiT": importlib.import_module("org.semanticweb.HermiT").ReasonerFactory()}
    found["Openllet"] = importlib.import_module("openllet.owlapi").OpenlletReasonerFactory.getInstance()
    return {
        "rules": sorted(str(one.getValue().getLiteral()) for rule in rules for one in _labels(rule)),
        "violations": sorted(map(str, OWL2DLProfile().checkOntology(ontology).getViolations())),
        "concluded": sorted(map(_iri, heads)),
        **{name: sorted(set(_concluded(ontology, by.createReasoner(ontology), heads))) for name, by in found.items()},
    }


def _labels(rule: Any) -> list[Any]:
    return [one for one in rule.getAnnotations() if one.getProperty().isLabel()]


def _concluded(ontology: Any, reasoner: Any, heads: set[Any]) -> Iterator[tuple[str, str, str]]:
    for predicate in heads:
        if predicate.isOWLClass():
            for one in reasoner.getInstances(predicate, False).getFlattened():
                yield _iri(one), TYPE, _iri(predicate)
            continue
        domains = [axiom.getDomain() for axiom in ontology.getObjectPropertyDomainAxioms(predicate)]
        for one in {each for kind in domains for each in reasoner.getInstances(kind, False).getFlattened()}:
            for other in reasoner.getObjectPropertyValues(one, predicate).getFlattened():
                yield _iri(one), _iri(predicate), _iri(other)


def _iri(entity: Any) -> str:
    return str(entity.getIRI().toString())


if __name__ == "__main__":
    start_java(sys.argv[1])
    print(json.dumps(check(Path(sys.argv[2])), indent=1))
