"""The names that the graph is written in: namespaces, named graphs, and IRIs of individuals.

What the terms mean stands in `ontology/`; a test holds every term that the code uses against it.
"""

from __future__ import annotations

from pyoxigraph import NamedNode

from irtwin.document.words import ONTOLOGY as ONTOLOGY
from irtwin.storage.base_iri import DEFAULT

IRT = f"{ONTOLOGY}#"
EFFECT = f"{ONTOLOGY}/effect/"
PROVIDER = f"{ONTOLOGY}/provider/"
REASONER = f"{ONTOLOGY}/reasoner/"
LIMIT = f"{ONTOLOGY}/limit/"
TARIFF = f"{ONTOLOGY}/tariff/"
SERIES = f"{ONTOLOGY}/series/"  # functions of SPARQL
ID = DEFAULT  # individuals of a workspace that has no base of its own

RDF = "http://www.w3.org/1999/02/22-rdf-syntax-ns#"
RDFS = "http://www.w3.org/2000/01/rdf-schema#"
OWL = "http://www.w3.org/2002/07/owl#"
XSD = "http://www.w3.org/2001/XMLSchema#"
PROV = "http://www.w3.org/ns/prov#"
SKOS = "http://www.w3.org/2004/02/skos/core#"
QUDT = "http://qudt.org/schema/qudt/"
UNIT = "http://qudt.org/vocab/unit/"
SH = "http://www.w3.org/ns/shacl#"
DCTERMS = "http://purl.org/dc/terms/"
VOID = "http://rdfs.org/ns/void#"
TYPE = NamedNode(f"{RDF}type")

PREFIXES = {
    "irt": IRT,
    "effect": EFFECT,
    "limit": LIMIT,
    "provider": PROVIDER,
    "reasoner": REASONER,
    "series": SERIES,
    "tariff": TARIFF,
    "id": ID,
    "rdf": RDF,
    "rdfs": RDFS,
    "owl": OWL,
    "xsd": XSD,
    "prov": PROV,
    "skos": SKOS,
    "qudt": QUDT,
    "unit": UNIT,
}

GRAPH = f"{ONTOLOGY}/graph/"
GRAPH_ONTOLOGY = f"{GRAPH}ontology"
GRAPH_SOURCE = f"{GRAPH}source/"  # one for each mapping file
GRAPH_MAPPED = f"{GRAPH_SOURCE}version"  # of which rows those were made; nothing follows from it
GRAPH_ACTIVITY = f"{GRAPH}activity/"  # one for each execution of a provider
GRAPH_ASSERTED = f"{GRAPH}asserted"  # what users assert, but for what they put into a graph of their own
GRAPH_INFERRED = f"{GRAPH}inferred/"
GRAPH_OWL_RL = f"{GRAPH_INFERRED}owl_rl"
GRAPH_SWRL = f"{GRAPH_INFERRED}swrl/"  # one for each rule
GRAPH_SHACL = f"{GRAPH_INFERRED}shacl/"
GRAPH_REASONED = f"{GRAPH}reasoned"  # of what the inferred graphs were made
GRAPH_VALIDATION = f"{GRAPH}validation"
GRAPH_CHANGED = f"{GRAPH}changed"  # individuals that are to be reasoned over or validated again


def term(name: str) -> str:
    """Return the IRI of a class or property of the model: `term("Industrial_Robot")`."""
    return IRT + name


# Where robots stand together: a place says nothing of them, so that they stay parts of their own.
PLACES = {NamedNode(term(name)) for name in ("Robot_Cell", "Production_Line", "Plant")}
INTO_PLACES = {NamedNode(term(name)) for name in ("stands_in", "cell_of_Line", "line_of_Plant", "part_of")}


def prefixes(base: str) -> dict[str, str]:
    """Return the prefixes of a graph whose individuals lie below a base."""
    return {**PREFIXES, "id": base}


def shorten(iri: str, base: str = ID) -> str:
    """Return the IRI with its prefix, `irt:Run_Time`, or as it is where no prefix fits."""
    prefix, namespace = max(
        ((name, space) for name, space in prefixes(base).items() if iri.startswith(space)),
        key=lambda pair: len(pair[1]),
        default=("", ""),
    )
    return f"{prefix}:{iri[len(namespace) :]}" if prefix else iri
