"""What is not suspected, pySHACL does not find either."""

import pyshacl
import pytest
import rdflib
from pyoxigraph import Quad, Store
from tests.knowledge.graphs import TURTLE, turtle
from tests.mapped import ontology_graph

from irtwin.knowledge.shacl.of_ontology import with_ontology
from irtwin.knowledge.shacl.suspects import any_suspect, queries
from irtwin.knowledge.store.rdf_input import read_turtle

SHAPES = {  # what a shape says of ex:C and the shapes it names
    "class": "sh:property [ sh:path ex:p ; sh:class ex:C ] .",
    "datatype": "sh:property [ sh:path ex:p ; sh:datatype xsd:integer ] .",
    "counts": "sh:property [ sh:path ex:p ; sh:minCount 1 ; sh:maxCount 1 ] .",
    "none": "sh:property [ sh:path ex:p ; sh:maxCount 0 ] .",
    "two": "sh:property [ sh:path ex:p ; sh:minCount 2 ] .",
    "inverse": "sh:property [ sh:path [ sh:inversePath ex:p ] ; sh:minCount 1 ] .",
    "either way": "sh:property [ sh:path [ sh:alternativePath ( ex:p ex:q ) ] ; sh:minCount 1 ; sh:maxCount 1 ] .",
    "a way of two steps, which is not known": "sh:property [ sh:path ( ex:p ex:q ) ; sh:minCount 1 ] .",
    "list": 'sh:property [ sh:path ex:p ; sh:in ( "a" ex:x ) ] .',
    "list of numbers": "sh:property [ sh:path ex:p ; sh:in ( 1 2 ) ] .",
    "between": "sh:property [ sh:path ex:p ; sh:minInclusive 1 ; sh:maxExclusive 3 ] .",
    "length": "sh:property [ sh:path ex:p ; sh:minLength 2 ] .",
    "node": "sh:property [ sh:path ex:p ; sh:node ex:small ] . ex:small a sh:NodeShape ; sh:maxInclusive 1 .",
    "beside": "sh:property [ sh:path ex:p ; sh:lessThan ex:q ] .",
    "either": "sh:or ( [ sh:class ex:E ] [ sh:property [ sh:path ex:p ; sh:minExclusive 1 ] ] ) .",
    "pattern": 'sh:property [ sh:path ex:p ; sh:pattern "^a" ] .',
    "flags, which are not known": 'sh:property [ sh:path ex:p ; sh:pattern "^A" ; sh:flags "i" ] .',
    "query": """sh:sparql [ sh:message "no p" ;
        sh:select "SELECT $this WHERE { $this a ?kind FILTER NOT EXISTS { $this <https://example.org/p> ?v } }" ] .""",
}
UNKNOWN = [said for name, said in SHAPES.items() if name.endswith("not known")]
DATA = [
    "",
    "ex:x ex:p 1 .",
    "ex:x ex:p 1 , 2 .",
    "ex:x ex:p 5 ; ex:q 4 .",
    "ex:x ex:p 5 ; ex:q 5 .",
    "ex:x ex:q 4 .",
    "ex:x ex:p 1.0 ; ex:q 4 .",
    "ex:x ex:p 'a' .",
    "ex:x ex:p 'abc'@en .",
    "ex:x ex:p ex:x .",
    "ex:x ex:p ex:y . ex:y a ex:D .",
    "ex:x ex:p ex:y . ex:y a ex:E .",
    "ex:x ex:p 'seven'^^xsd:integer .",
    "ex:x ex:p 'NaN'^^xsd:double .",
    "ex:x a ex:E .",
]


@pytest.mark.parametrize("said", SHAPES.values(), ids=SHAPES)
def test_what_breaks_a_constraint_is_suspected(said: str) -> None:
    shapes = f"ex:shape a sh:NodeShape ; sh:targetClass ex:C ; {said}"
    asked = list(queries(turtle(shapes), turtle("ex:D rdfs:subClassOf ex:C .")))
    kept = 0
    for some in DATA:
        data = f"ex:D rdfs:subClassOf ex:C . ex:x a ex:D . {some}"
        store = Store()
        store.extend(Quad(*triple) for triple in turtle(data))
        graph, shacl = (rdflib.Graph().parse(data=TURTLE + text) for text in (data, shapes))
        conforms, *_ = pyshacl.validate(graph, shacl_graph=shacl)
        if not any_suspect(store, asked):
            assert conforms, some
            kept += 1
    assert kept or said in (SHAPES["two"], SHAPES["list of numbers"], *UNKNOWN)


def test_each_shape_that_ships_is_known():
    graph = ontology_graph()
    by_hand = [triple for file in graph.resources.of("shapes") for triple in read_turtle(file.path)]
    asked = list(queries(with_ontology(by_hand, graph.triples()), ()))
    assert len(asked) > 200
    assert not any("FILTER(!COALESCE(false, false))" in text for text in asked), "it would show each graph to pySHACL"
