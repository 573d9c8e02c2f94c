"""A graph as a whole: SPARQL 1.1 Graph Store HTTP Protocol. What is sent is an update, as any other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from pyoxigraph import NamedNode, RdfFormat, parse, serialize

from irtwin.serve.protocol import Operation, Refusal, named

_ALL = "CONSTRUCT { ?s ?p ?o } WHERE { ?s ?p ?o }"
Parameters = Mapping[str, Sequence[str]]


def names_graph(parameters: Parameters) -> bool:
    """Return whether the parameters of a request name a graph, and not a query."""
    return bool({"graph", "default"} & parameters.keys()) and "query" not in parameters


def read(parameters: Parameters) -> Operation:
    """Return the query for a graph, by its IRI or all together (section 5.2)."""
    graphs = parameters.get("graph", ())
    if len(graphs) > 1 or (graphs and "default" in parameters):
        raise Refusal(400, "ask for one graph: `graph=IRI` or `default`")
    return Operation("query", _ALL, tuple(_iri(name).value for name in graphs))


def replaced(parameters: Parameters, content_type: str, body: bytes, base: str) -> Operation:
    """Return the update that puts what is sent in place of a graph (section 5.3)."""
    added = merged(parameters, content_type, body, base).text
    return Operation("update", f"DROP SILENT GRAPH {_own(parameters)} ;\n{added}")


def merged(parameters: Parameters, content_type: str, body: bytes, base: str) -> Operation:
    """Return the update that adds what is sent to a graph (section 5.5); relative IRIs are below `base`."""
    kind = content_type.partition(";")[0].strip().lower()
    form = RdfFormat.from_media_type(kind)
    if form is None or form.supports_datasets:
        raise Refusal(415, f"a graph is sent as text/turtle, application/n-triples or RDF/XML, not {kind or 'nothing'}")
    try:
        triples = serialize((quad.triple for quad in parse(body, form, base_iri=base)), format=RdfFormat.N_TRIPLES)
    except (SyntaxError, ValueError) as error:
        raise Refusal(400, f"the graph cannot be read: {' '.join(str(error).split())}") from None
    assert triples is not None
    return Operation("update", f"INSERT DATA {{ GRAPH {_own(parameters)} {{\n{triples.decode()}}} }}")


def dropped(parameters: Parameters) -> Operation:
    """Return the update that drops a graph (section 5.4)."""
    return Operation("update", f"DROP GRAPH {_own(parameters)}")


def _own(parameters: Parameters) -> NamedNode:
    graphs = parameters.get("graph", ())
    if len(graphs) != 1 or "default" in parameters:
        raise Refusal(400, "name the one graph that is changed: `graph=IRI`")
    return _iri(graphs[0])


def _iri(name: str) -> NamedNode:
    return named(name, 400, f"{name!r} is no absolute IRI")
