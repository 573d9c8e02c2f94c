"""The mapping of a diagnosis is what its fields tell, and the ontology declares all of it."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from pyoxigraph import RdfFormat, Store

from irtwin.document.r2rml import r2rml
from irtwin.document.tables import TABLES, Table
from irtwin.resources import folder

INDIVIDUALS = {one.individual.name.lower(): one.individual.name for one in TABLES if one.individual}
DATATYPES = {str: "string", float: "double", int: "integer", bool: "boolean"}
PREFIXES = """
PREFIX irt: <https://w3id.org/irtwin#> PREFIX owl: <http://www.w3.org/2002/07/owl#>
PREFIX qudt: <http://qudt.org/schema/qudt/> PREFIX skos: <http://www.w3.org/2004/02/skos/core#>
PREFIX rdfs: <http://www.w3.org/2000/01/rdf-schema#> PREFIX xsd: <http://www.w3.org/2001/XMLSchema#>
PREFIX rdf: <http://www.w3.org/1999/02/22-rdf-syntax-ns#>
"""


@pytest.fixture(scope="module")
def ontology() -> Store:
    store = Store()
    for file in folder("ontology").glob("*.ttl"):
        store.load(path=str(file), format=RdfFormat.TURTLE)
    return store


def test_the_shipped_mapping_is_what_the_fields_tell() -> None:
    assert (folder("mappings") / "gap.r2rml.ttl").read_text() == r2rml(), "run `make mappings`"


def properties() -> Iterator[tuple[str, str, str]]:
    """Yield each property that a diagnosis has: of which class, and what its range must be or its type."""
    for table in TABLES:
        owner, whole = _individual(table), table.whole and _individual(table.whole)
        for column in table.columns:
            wanted = "owl:ObjectProperty" if column.names else f"xsd:{DATATYPES[column.kind]}"
            if column.term and owner:
                yield column.term, owner, wanted
        if table.individual and whole:
            yield table.individual.of, owner, f"irt:{whole}"
            yield from ((term, owner, "xsd:string") for term, _ in table.individual.constants)


def _individual(table: Table) -> str:
    if table.individual is None:
        assert table.whole is not None
        return _individual(table.whole)
    return table.individual.name


def test_the_ontology_declares_each_property(ontology: Store) -> None:
    missing = [one for one in sorted(set(properties())) if not declared(ontology, *one)]
    assert missing == [], "declare these, of their class and with their range, in ontology/gap.ttl"


def declared(ontology: Store, term: str, owner: str, wanted: str) -> bool:
    """With a definition, a domain that the individual is in, the range that the mapping gives; numbers with a unit."""
    range_ = f"a {wanted} ; rdfs:range ?any" if wanted.startswith("owl:") else f"rdfs:range {wanted}"
    unit = f"irt:{term} qudt:hasUnit|irt:unit_given_by ?unit ." if wanted in ("xsd:double", "xsd:integer") else ""
    asked = f"""{PREFIXES} ASK {{
        irt:{term} skos:definition ?said ; rdfs:domain ?domain ; {range_} . {unit}
        irt:{owner} a owl:Class ; rdfs:subClassOf* ?class .
        FILTER (?domain = ?class || EXISTS {{ ?domain owl:unionOf/rdf:rest*/rdf:first ?class }})
    }}"""
    return bool(ontology.query(asked))
