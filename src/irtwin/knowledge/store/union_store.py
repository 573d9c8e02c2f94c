"""Named graphs and their union, which the default graph holds: in a folder, on a SPARQL server, or in memory.

Each triple stands in the union once: Oxigraph's own union repeats a triple that several graphs hold, and a sum would
count it twice.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import chain, islice
from pathlib import Path
from typing import Any, cast

from pyoxigraph import (
    BlankNode,
    DefaultGraph,
    NamedNode,
    Quad,
    QueryBoolean,
    QuerySolutions,
    QueryTriples,
    Store,
    Triple,
)

from irtwin.knowledge.store import store_files
from irtwin.knowledge.store.blank_nodes import by_name
from irtwin.knowledge.store.damage import check_files, telling, told
from irtwin.knowledge.store.named_graphs import is_below, is_of_many, names_in, triples_in
from irtwin.knowledge.store.sparql_server import SparqlServer, is_url

Subject = NamedNode | BlankNode | Triple
_MANY = 10_000  # new quads: from there on a file of their own is quicker than the store's log, and takes no memory
_AT_ONCE = 200_000  # quads of a bulk load, which holds all of them: 0.6 GB in place of 1.8 of 900,000, as fast


class UnionStore:
    """A store's named graphs, each change of which changes their union in the same transaction.

    `embedded` is Oxigraph's own store; None on a server, which cannot be looked up by patterns.
    """

    def __init__(self, place: Path | str | None, *, read_only: bool = False) -> None:
        self._read_only = read_only
        self._loads = 0  # bulk loads since their files were merged
        self._alone = set[Quad]()  # written last, which no other graph says: a live robot takes them out next
        self.folder = None if place is None or is_url(place) else Path(place)
        self._store: Store | SparqlServer
        if self.folder is None:
            self._store = Store() if place is None else SparqlServer(str(place))
        elif read_only:
            self._store = Store.read_only(str(self.folder))
        else:
            check_files(self.folder)
            with told(self.folder):
                self._store = Store(str(self.folder))
            for old in self.folder.glob("LOG.old.*"):  # the store keeps one of each opening, and never reads them
                old.unlink(missing_ok=True)

    @telling
    def close(self) -> None:
        """Let go of the folder, which is locked while its store is open to be written to."""
        written = self.embedded is not None and not self._read_only
        if written:
            self.flush()
        self._store = Store()
        if written and self.folder is not None:
            store_files.note_sums(self.folder)

    @property
    def embedded(self) -> Store | None:
        """Oxigraph's store, for what a server's graph cannot do."""
        return self._store if isinstance(self._store, Store) else None

    @property
    def shown(self) -> str:
        """Where it is, as messages may say it: never with a password."""
        return self._store.shown if isinstance(self._store, SparqlServer) else str(self.folder or "memory")

    def query(self, text: str, **how: Any) -> QuerySolutions | QueryBoolean | QueryTriples:
        """Answer a query over the union, or over the graphs that are given, as `pyoxigraph.Store.query` does."""
        return self._store.query(text, **how)

    def graphs(self, *below: str) -> list[str]:
        """Return the IRIs of the named graphs: of all, or of those that are `below`, as `named_graphs` says."""
        if below and not any(map(is_of_many, below)):  # a fleet has too many to look through
            return sorted(name for name in set(below) if self._store.contains_named_graph(NamedNode(name)))
        return sorted(name for name in names_in(self._store) if not below or is_below(name, below))

    def triples(self, *below: str) -> set[Triple]:
        """Return the triples of the named graphs `below`, of all without it."""
        if not below:
            return {quad.triple for quad in self._store.quads_for_pattern(None, None, None, DefaultGraph())}
        return {triple for name in self.graphs(*below) for triple in triples_in(self._store, name)}

    def quads_in(self, name: str) -> Iterator[Quad]:
        """Yield the quads of one named graph, by its whole IRI, as the store gives them."""
        return self._store.quads_for_pattern(None, None, None, NamedNode(name))

    def holding(self, triples: Iterable[Triple]) -> Iterator[Quad]:
        """Yield the quads of named graphs that say one of the triples."""
        if isinstance(self._store, SparqlServer):
            return self._store.holding(triples)
        matches = (
            self._store.quads_for_pattern(triple.subject, triple.predicate, triple.object, None) for triple in triples
        )
        return (quad for quads in matches for quad in quads if not isinstance(quad.graph_name, DefaultGraph))

    def load(self, quads: Iterator[Quad], below: tuple[str, ...]) -> None:
        """Put quads into graphs of an embedded store that are not there yet; take them out again where that fails."""
        self._alone.clear()
        try:
            for first in quads:
                self._load(chain([first], islice(quads, _AT_ONCE - 1)))
            self.merge_loads()
        except BaseException:
            self.replace({name: set() for name in self.graphs(*below)})
            raise

    def _load(self, quads: Iterable[Quad]) -> None:
        assert isinstance(self._store, Store)
        self._store.bulk_extend(with_union(quads))
        self._loads += 1

    def merge_loads(self) -> None:
        """Merge the files of several bulk loads: they are read slower by a third, and by who opens them next merged."""
        if self._loads > 1 and isinstance(self._store, Store):
            self._store.optimize()
        self._loads = 0

    def replace(self, contents: dict[str, set[Triple]]) -> None:
        """Make triples the whole content of named graphs, in one transaction."""
        self._alone.clear()
        self._store.update(";\n".join(_replacement(name, triples) for name, triples in contents.items()))

    def exchange(self, taken: set[Quad], given: set[Quad]) -> None:
        """Take quads out of their named graphs and put others in, none of both, in one transaction."""
        if not taken and isinstance(self._store, Store):
            self._alone.clear()
            if len(given) < _MANY:
                self._store.extend(with_union(given))
            else:
                self._load(given)
        elif taken or given:
            triples, new = ({quad.triple for quad in quads} for quads in (taken, given))
            lost = self._said_no_more(triples - new, taken)
            self._note_alone(taken, given)
            self._store.update(
                f"DELETE DATA {{ {_triple_data(lost)}\n{_quad_data(taken)} }} ;\n"
                f"INSERT DATA {{ {_triple_data(new)}\n{_quad_data(given)} }}"
            )

    def _said_no_more(self, triples: set[Triple], taken: set[Quad]) -> set[Triple]:
        """Return which triples no graph says once quads are taken out."""
        unsure = triples - {quad.triple for quad in taken & self._alone}
        return triples - {quad.triple for quad in self.holding(unsure) if quad not in taken}

    def _note_alone(self, taken: set[Quad], given: set[Quad]) -> None:
        """Note quads about to be written that no other graph says: looking that up later takes six times as long."""
        if not isinstance(self._store, Store) or len(self._alone) > _MANY:
            self._alone.clear()
            return
        self._alone -= taken
        union = [Quad(*triple) for triple in {quad.triple for quad in given}]
        if len(union) < len(given) or any(quad in self._store for quad in union):
            self._alone.clear()
        else:
            self._alone |= given

    def flush(self) -> None:
        """Put what was written into the store's files: who opens them to read replays the store's log."""
        self._store.flush()

    def about(self, node: NamedNode | BlankNode) -> list[Quad]:
        """Return the quads of named graphs that have a node for subject or object; not on a server."""
        assert isinstance(self._store, Store)
        return [
            quad
            for ends in ((node, None), (None, node))
            for quad in self._store.quads_for_pattern(ends[0], None, ends[1], None)
            if not isinstance(quad.graph_name, DefaultGraph)
        ]

    def said(self, subject: Subject, predicate: NamedNode) -> set[Quad]:
        """Return the quads of named graphs that say a property of a subject."""
        rows = self._rows(f"SELECT ?o ?g {{ GRAPH ?g {{ {subject} {predicate} ?o }} }}")
        return {Quad(subject, predicate, row["o"], row["g"]) for row in rows}

    def said_of(self, nodes: Iterable[NamedNode | BlankNode]) -> Iterator[tuple[Any, Any, Any, NamedNode]]:
        """Yield subject, predicate, object and named graph of what has one of some nodes for subject; as `about`."""
        named, others = by_name(nodes)
        for some in named:
            rows = self._rows(f"SELECT ?s ?p ?o ?g {{ VALUES ?s {{ {some} }} GRAPH ?g {{ ?s ?p ?o }} }}")
            yield from map(tuple, cast(Any, rows))
        yield from (cast(Any, tuple(quad)) for node in others for quad in self.about(node) if quad.subject == node)

    @telling
    def leading_to(self, nodes: Iterable[NamedNode | BlankNode], apart: Iterable[str]) -> set[NamedNode | BlankNode]:
        """Return the subjects of which named graphs, but for some, say something with one of some nodes for object."""
        named, others = by_name(nodes)
        without = ", ".join(f"<{name}>" for name in apart)
        form = "SELECT DISTINCT ?s {{ VALUES ?o {{ {} }} GRAPH ?g {{ ?s ?p ?o }} FILTER(?g NOT IN ({})) }}"
        linked = {row[0] for some in named for row in self._rows(form.format(some, without))}
        apart = set(apart)
        quads = (quad for node in others for quad in self.about(node) if quad.object == node)
        linked.update(quad.subject for quad in quads if getattr(quad.graph_name, "value", "") not in apart)
        return linked

    @telling
    def subjects(self, predicate: NamedNode, object: NamedNode) -> set[NamedNode | BlankNode]:
        """Return the subjects of the triples that end so; as `about`."""
        assert isinstance(self._store, Store)
        quads = self._store.quads_for_pattern(None, predicate, object, DefaultGraph())
        return {quad.subject for quad in quads}  # type: ignore[misc]

    def speakers(self, apart: Iterable[str]) -> Iterator[NamedNode | BlankNode]:
        """Yield the subjects of all named graphs but for some, each once."""
        without = ", ".join(f"<{name}>" for name in apart)
        rows = self._rows(f"SELECT DISTINCT ?s {{ GRAPH ?g {{ ?s ?p ?o }} FILTER(?g NOT IN ({without})) }}")
        return (row[0] for row in rows)

    def _rows(self, text: str) -> QuerySolutions:
        return cast(QuerySolutions, self._store.query(text))


def with_union(quads: Iterable[Quad]) -> Iterator[Quad]:
    """Yield each quad, and its triple for the default graph."""
    for quad in quads:
        yield quad
        yield Quad(*quad.triple)


def _replacement(name: str, triples: set[Triple]) -> str:
    """Return the SPARQL Update that swaps a named graph's content, and keeps the default graph the union."""
    text = "\n".join(f"{triple} ." for triple in triples)
    return f"""
    DELETE {{ ?s ?p ?o }} WHERE {{
      GRAPH <{name}> {{ ?s ?p ?o }}
      FILTER NOT EXISTS {{ GRAPH ?other {{ ?s ?p ?o }} FILTER(?other != <{name}>) }}
    }} ;
    DROP SILENT GRAPH <{name}> ;
    INSERT DATA {{ {text} GRAPH <{name}> {{ {text} }} }}"""


def _quad_data(quads: Iterable[Quad]) -> str:
    """Write quads of named graphs as SPARQL's QuadData, the triples of each graph together."""
    by_graph: dict[Any, list[Triple]] = {}
    for quad in quads:
        by_graph.setdefault(quad.graph_name, []).append(quad.triple)
    return "\n".join(f"GRAPH {name} {{ {_triple_data(triples)} }}" for name, triples in by_graph.items())


def _triple_data(triples: Iterable[Triple]) -> str:
    """Write triples as SPARQL's TriplesTemplate."""
    return " .\n".join(map(str, triples))
