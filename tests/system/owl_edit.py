"""Change a number in an ontology, as Protégé does: python owl_edit.py JARS FILE SUBJECT PROPERTY VALUE."""

from __future__ import annotations

import sys

import jpype
from owl_api import start_java


def edit(file: str, subject: str, predicate: str, value: float) -> None:
    from org.semanticweb.owlapi.apibinding import OWLManager
    from org.semanticweb.owlapi.model import IRI

    manager = OWLManager.createOWLOntologyManager()
    factory = manager.getOWLDataFactory()
    ontology = manager.loadOntologyFromOntologyDocument(jpype.java.io.File(file))
    individual = factory.getOWLNamedIndividual(IRI.create(subject))
    of = factory.getOWLDataProperty(IRI.create(predicate))
    for axiom in list(ontology.getDataPropertyAssertionAxioms(individual)):
        if axiom.getProperty().equals(of):
            manager.removeAxiom(ontology, axiom)
    manager.addAxiom(ontology, factory.getOWLDataPropertyAssertionAxiom(of, individual, jpype.JDouble(value)))
    manager.saveOntology(ontology)


if __name__ == "__main__":
    start_java(sys.argv[1])
    edit(*sys.argv[2:5], float(sys.argv[5]))
