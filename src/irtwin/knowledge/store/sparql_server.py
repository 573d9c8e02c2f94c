"""A graph that a SPARQL 1.1 server keeps, asked and changed over HTTP.

Two parts of the standard are used, which every server has: query by POST with its parameters in the body (Virtuoso
never answers a body of `application/sparql-query`) and update by POST (`application/sparql-update`). The Graph Store
Protocol is not: it replaces one graph at a time, and a change of several graphs and their union is to happen whole or
not at all.
"""

from __future__ import annotations

import base64
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, cast
from urllib.parse import SplitResult, quote, unquote, urlencode, urlsplit

from pyoxigraph import (
    BlankNode,
    DefaultGraph,
    NamedNode,
    Quad,
    QueryBoolean,
    QueryResultsFormat,
    QuerySolutions,
    QueryTriples,
    RdfFormat,
    Triple,
    parse,
    parse_query_results,
)

from irtwin.errors import InputError, WorkspaceFault

if TYPE_CHECKING:
    from http.client import HTTPResponse

TOKEN = "IRTWIN_GRAPH_TOKEN"  # environment variable: sent as a bearer token
TIMEOUT = 300.0  # s without a byte from the server
_ACCEPT = "application/sparql-results+json, application/n-triples;q=0.9"
_FORM, _UPDATE = "application/x-www-form-urlencoded", "application/sparql-update"
_AT_ONCE = 500  # triples looked up by one query


class ServerFault(WorkspaceFault):
    """A server that cannot be reached, or does not do what it is asked for."""


class SparqlServer:
    """The part of pyoxigraph's Store that the knowledge graph uses, on a server.

    `url` is the address of queries. Updates go to its sibling `update` where it ends in `/query` (Oxigraph, Fuseki), to
    `/statements` below it where it is `/repositories/NAME` (GraphDB, RDF4J), else to the same address. `user:password@`
    in it is sent as basic authentication, the environment's IRTWIN_GRAPH_TOKEN as a bearer token.
    """

    def __init__(self, url: str) -> None:
        """Ask the server whether it is there. Raises InputError, which never shows a password, where it is not."""
        address = _address(url)
        self.headers = {"User-Agent": "irtwin", **_credentials(address)}
        host = address.netloc.rpartition("@")[2]
        self.query_url = address._replace(netloc=host).geturl()
        self.shown = address._replace(netloc=host, query="", fragment="").geturl()
        self.update_url = _update_url(self.query_url)
        if not isinstance(self.query("ASK {}"), QueryBoolean):
            raise ServerFault(
                f"{self.shown}: answers ASK by a table, as Virtuoso does: it departs from SPARQL 1.1 too far to keep a "
                "graph; docs/findings/knowledge-graph.md says how, and which servers do not"
            )

    def query(
        self,
        text: str,
        *,
        base_iri: str | None = None,
        prefixes: Mapping[str, str] | None = None,
        default_graph: Sequence[NamedNode | DefaultGraph] | None = None,
        named_graphs: Sequence[NamedNode] | None = None,
        custom_functions: Mapping[NamedNode, Any] | None = None,
    ) -> QuerySolutions | QueryBoolean | QueryTriples:
        """Answer a query. SyntaxError where the server refuses its text; functions are those that the server has."""
        asked = [("query", _with_prologue(text, base_iri, prefixes))]
        asked += [("default-graph-uri", name.value) for name in default_graph or () if isinstance(name, NamedNode)]
        asked += [("named-graph-uri", name.value) for name in named_graphs or ()]
        response = self._post(self.query_url, "query", urlencode(asked), _FORM, _ACCEPT)
        if response.headers.get_content_type() == "application/sparql-results+json":
            return parse_query_results(response, QueryResultsFormat.JSON)
        triples = (quad.triple for quad in parse(response, RdfFormat.N_TRIPLES))
        return cast(QueryTriples, triples)  # an iterator, which is all that one makes of those

    def update(self, text: str) -> None:
        """Do an update that irtwin wrote, in the one transaction that the server makes of a request.

        Raises ServerFault where the server does not know SPARQL 1.1 well enough.
        """
        try:
            self._post(self.update_url, "update", text, _UPDATE, "*/*").read()
        except SyntaxError as error:
            raise ServerFault(
                f"{self.shown}: the server takes no SPARQL 1.1 Update on its default graph and named ones ({error}); "
                "nothing was changed; docs/findings/knowledge-graph.md says which servers do"
            ) from None

    def named_graphs(self) -> Iterator[NamedNode]:
        """Yield the names of graphs that hold something."""
        rows = cast(QuerySolutions, self.query("SELECT DISTINCT ?graph { GRAPH ?graph { ?s ?p ?o } }"))
        return (cast(NamedNode, row["graph"]) for row in rows)

    def contains_named_graph(self, name: NamedNode) -> bool:
        """Whether a graph holds something."""
        return bool(self.query(f"ASK {{ GRAPH {name} {{ ?s ?p ?o }} }}"))

    def quads_for_pattern(
        self, subject: None, predicate: None, object: None, graph: NamedNode | DefaultGraph
    ) -> Iterator[Quad]:
        """Yield the quads of one graph."""
        pattern = f"GRAPH {graph} {{ ?s ?p ?o }}" if isinstance(graph, NamedNode) else "?s ?p ?o"
        rows = cast(QuerySolutions, self.query(f"SELECT ?s ?p ?o {{ {pattern} }}"))
        return (Quad(row["s"], row["p"], row["o"], graph) for row in rows)

    def holding(self, triples: Iterable[Triple]) -> Iterator[Quad]:
        """Yield the quads of named graphs that say one of the triples; a blank node is any, as a server has its own."""
        every = list(triples)
        blank = [triple for triple in every if any(isinstance(term, BlankNode) for term in triple)]
        wanted = [triple for triple in every if triple not in blank]
        for triple in blank:
            for row in cast(QuerySolutions, self.query(f"SELECT DISTINCT ?g {{ GRAPH ?g {{ {triple} }} }}")):
                yield Quad(triple.subject, triple.predicate, triple.object, row["g"])
        for start in range(0, len(wanted), _AT_ONCE):
            values = " ".join(f"({t.subject} {t.predicate} {t.object})" for t in wanted[start : start + _AT_ONCE])
            query = f"SELECT ?s ?p ?o ?g {{ VALUES (?s ?p ?o) {{ {values} }} GRAPH ?g {{ ?s ?p ?o }} }}"
            for row in cast(QuerySolutions, self.query(query)):
                yield Quad(row["s"], row["p"], row["o"], row["g"])

    def flush(self) -> None:
        """Do nothing: what a server answered is committed."""

    def _post(self, url: str, kind: str, text: str, media_type: str, accept: str) -> HTTPResponse:
        # a quarter of the imports of a command that asks a folder
        from http.client import HTTPException
        from urllib.error import HTTPError, URLError
        from urllib.request import Request, urlopen

        headers = {**self.headers, "Content-Type": f"{media_type}; charset=utf-8", "Accept": accept}
        try:
            request = Request(url, text.encode(), headers, method="POST")
            return cast("HTTPResponse", urlopen(request, timeout=TIMEOUT))
        except HTTPError as error:
            reply = " ".join(error.read(1000).decode(errors="replace").split())[:300]
            if error.code == 400:
                raise SyntaxError(reply) from None
            refused = f"{error.code} {error.reason}. {reply}"
            raise ServerFault(f"{self.shown}: the server refuses the {kind}: {refused}") from None
        except (URLError, HTTPException, OSError) as error:
            reason = error.reason if isinstance(error, URLError) else error
            raise ServerFault(f"{self.shown}: no SPARQL server answers: {reason}") from None


def is_url(place: object) -> bool:
    """Whether a place is a server's, not a folder."""
    return isinstance(place, str) and "://" in place


def _address(url: str) -> SplitResult:
    try:
        address = urlsplit(url)
        _ = address.port
    except ValueError:
        raise InputError("the graph's URL cannot be read; write it like http://localhost:7878/query") from None
    if address.scheme not in ("http", "https") or not address.hostname:
        raise InputError(f"a graph's URL begins with http:// or https:// and names a host, not {address.scheme}://")
    return address


def _update_url(query_url: str) -> str:
    address = urlsplit(query_url)
    path = address.path.rstrip("/")
    *_, above, last = ["", "", *path.split("/")]
    if last == "query":
        return address._replace(path=f"{path.removesuffix('query')}update").geturl()
    if above == "repositories":
        return address._replace(path=f"{path}/statements").geturl()
    return query_url


def _credentials(address: SplitResult) -> dict[str, str]:
    if address.username is not None:
        pair = f"{unquote(address.username)}:{unquote(address.password or '')}"
        return {"Authorization": f"Basic {base64.b64encode(pair.encode()).decode()}"}
    token = os.environ.get(TOKEN)
    return {"Authorization": f"Bearer {quote(token, safe='~+/=')}"} if token else {}


def _with_prologue(text: str, base: str | None, prefixes: Mapping[str, str] | None) -> str:
    lines = [f"BASE <{base}> "] if base else []
    return "".join([*lines, *(f"PREFIX {name}: <{iri}> " for name, iri in (prefixes or {}).items()), text])
