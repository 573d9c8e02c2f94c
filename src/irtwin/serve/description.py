"""What the endpoint says of itself: the SPARQL 1.1 Service Description."""

from __future__ import annotations

from collections.abc import Sequence

from pyoxigraph import NamedNode, RdfFormat, parse, serialize
from starlette.responses import Response

from irtwin.serve import negotiation

NAMED_GRAPHS = "SELECT ?graph WHERE { GRAPH ?graph { } } ORDER BY ?graph"
_PREFIXES = {"sd": "http://www.w3.org/ns/sparql-service-description#", "formats": "http://www.w3.org/ns/formats/"}
_SERVICE = """
[] a sd:Service ; sd:endpoint %s ; sd:supportedLanguage %s ; sd:feature sd:UnionDefaultGraph ;
  sd:resultFormat formats:SPARQL_Results_JSON, formats:SPARQL_Results_XML, formats:SPARQL_Results_CSV,
    formats:SPARQL_Results_TSV, formats:Turtle, formats:N-Triples, formats:RDF_XML, formats:JSON-LD ;
  sd:defaultDataset [ a sd:Dataset ; sd:defaultGraph [ a sd:Graph ] %s ] .
"""


def response(accept: str, address: str, graphs: Sequence[str], updates: bool) -> Response:
    """Describe the service at `address` with its named graphs, in the form that the client prefers."""
    media_type = negotiation.chosen(accept, negotiation.TRIPLES, "the description")
    languages = "sd:SPARQL11Query, sd:SPARQL11Update" if updates else "sd:SPARQL11Query"
    named = "".join(f"; sd:namedGraph [ a sd:NamedGraph ; sd:name {NamedNode(graph)} ]" for graph in graphs)
    prefixes = "".join(f"@prefix {name}: <{iri}> . " for name, iri in _PREFIXES.items())
    quads = parse(prefixes + _SERVICE % (NamedNode(address), languages, named), RdfFormat.TURTLE)
    form = RdfFormat.from_media_type(media_type)
    body = serialize((quad.triple for quad in quads), format=form, prefixes=_PREFIXES)
    return Response(body, media_type=media_type, headers={"Vary": "Accept"})
