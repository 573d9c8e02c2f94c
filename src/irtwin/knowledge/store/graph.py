"""The knowledge graph: an Oxigraph store of named graphs, asked as one."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, cast

from pyoxigraph import Literal, NamedNode, Quad, QueryBoolean, QuerySolutions, QueryTriples, Store, Triple

from irtwin.errors import InputError
from irtwin.knowledge.store import changes, ontology
from irtwin.knowledge.store.blank_nodes import has_blank_node, named_below, same
from irtwin.knowledge.store.damage import telling
from irtwin.knowledge.store.keywords import refuse_service
from irtwin.knowledge.store.named_graphs import belonging, graph_name, names_in, triples_in
from irtwin.knowledge.store.reading import answers_of
from irtwin.knowledge.store.series_functions import Functions, series_functions
from irtwin.knowledge.store.sparql_text import bound
from irtwin.knowledge.store.syntax_error import in_words
from irtwin.knowledge.store.table import AnswerTable, table_of
from irtwin.knowledge.store.union_store import UnionStore
from irtwin.knowledge.store.update_dataset import using
from irtwin.knowledge.store.updates import by_asking, by_doing, check
from irtwin.knowledge.vocabulary import GRAPH_ONTOLOGY, GRAPH_SOURCE, ID, VOID, prefixes
from irtwin.resources import Resources, resources_of

if TYPE_CHECKING:
    from irtwin.storage.database import Workspace

_MOST_KEPT = 2_000  # values of an answer that is kept
URI_SPACE = f"{VOID}uriSpace"  # says of the graphs of sources what their individuals lie below
_ASK_BASE = f"SELECT ?base {{ GRAPH ?any {{ <{GRAPH_SOURCE}> <{URI_SPACE}> ?base }} }} LIMIT 1"


class KnowledgeGraph:
    """Ontology, individuals and inferences in named graphs: in a folder, on a SPARQL server by its URL, or in memory.

    `store` holds the quads, for who looks these up one by one.

    Queries reach the samples of series by the functions of `series_functions`, where the series' files are known:
    in `workspace`, which a folder's parent is if none is given. Its individuals lie below `base`, else below what the
    graph says of itself. `read` is what others made of asserted quads, by a word of theirs: gone once this object
    writes to such. `answers` hold until the graph is written to: who keeps one takes them before the question is asked.
    """

    def __init__(
        self,
        place: Path | str | None = None,
        workspace: Path | None = None,
        resources: Resources | None = None,
        base: str | None = None,
        *,
        read_only: bool = False,
    ):
        """Open a graph; with `read_only` what is on disk now, without a lock.

        Where another process may write meanwhile: see `snapshot`; if it changed the files just now, OSError or
        RuntimeError is raised.
        """
        self.store = UnionStore(place, read_only=read_only)
        self.folder = self.store.folder
        self._workspace = place.parent if workspace is None and isinstance(place, Path) else workspace
        self._resources = resources
        self._base = base
        self._says_first = False  # whether the next change has it say first that it is behind
        self.read: dict[str, Any] = {}
        self.seen: str | None = None  # what names the state of the files that a view of a folder shows
        self.answers = answers_of(self.store)

    @classmethod
    def of_workspace(cls, place: Workspace) -> Self:
        """Open a workspace's graph: in its folder, or on a SPARQL server. InputError where it is damaged or lost."""
        if place.location.graph_url is None:
            place.check_graph()
        return cls(place.location.graph_url or place.graph_folder, place.folder, place.resources, place.base)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def close(self) -> None:
        """Let go of the folder, so that it can be opened again: it is locked while a graph is open on it."""
        self.store.close()
        self.answers = answers_of(self.store)

    @property
    def resources(self) -> Resources:
        """The ontology, rules, shapes, mappings, questions and reports that hold for it: its workspace's too."""
        if self._resources is None:
            self._resources = resources_of(self._workspace)
        return self._resources

    @property
    def base(self) -> str:
        """What the IRIs of its individuals begin with."""
        if self._base is None:
            solutions = cast(QuerySolutions, self.store.query(_ASK_BASE))
            self._base = next((row["base"].value for row in solutions), ID)
        return self._base

    @property
    def prefixes(self) -> dict[str, str]:
        """The prefixes that queries need not declare."""
        return prefixes(self.base)

    def iri(self, name: str) -> str:
        """Return the IRI of an individual by its name below the base, \"robot/UR10\"; a whole IRI stays as it is."""
        return name if "://" in name or name.startswith("urn:") else self.base + name

    @property
    def has_ontology(self) -> bool:
        """Whether the ontology's graph is made of the modules, plant and tariff that hold for the workspace now."""
        return self.holds(ontology.version(self.resources, self._workspace, self.base))

    def load_ontology(self) -> None:
        """Put the modules of `ontology/` into the ontology's graph, and the plant and tariff that the workspace says.

        With them goes a name of their content, by which a graph that is made of these already is left alone.
        """
        if not self.has_ontology:
            self.replace(ontology.quads(self.resources, self._workspace, self.base), GRAPH_ONTOLOGY)

    @property
    @telling
    def is_behind(self) -> bool:
        """Whether somebody began to change the graph, or the rows that it is made of, and has not ended that."""
        return changes.BEHIND in self.store.holding([changes.BEHIND.triple])

    @contextmanager
    def rewritten(self) -> Iterator[None]:
        """Have the graph say that it is behind, from its first change in the block on, until the block ends well.

        It goes on to say so where the block fails, or the process is killed.
        """
        self._says_first = True
        try:
            yield
        finally:
            self._says_first = False
        if self.is_behind:
            self.change([changes.BEHIND], ())

    def rows_change(self) -> None:
        """Have a graph that is `rewritten` say, on the disk, that it is behind: rows are about to change."""
        if self._says_first:
            self._say_behind()
            self.flush()

    def _say_behind(self) -> None:
        if self._says_first:
            self._says_first = False
            self.change((), [changes.BEHIND])

    @contextmanager
    def _writing(self) -> Iterator[UnionStore]:
        """Give the store to write to, and forget what was read of it: all writing goes this way."""
        self._say_behind()
        try:
            yield self.store
        finally:
            self.answers = answers_of(self.store)

    @telling
    def replace(self, quads: Iterable[Quad], *below: str) -> list[str]:
        """Make the quads the whole content of some named graphs, `below` as in `graphs`.

        Happens whole or not at all: in one transaction or, where there is no such graph yet, by bulk loads, of whose
        many a process that is killed leaves the first. Graphs that stay as they are are left alone; returns the IRIs
        of those that changed.
        """
        quads = belonging(quads, below)
        old = self.graphs(*below)
        if self.store.embedded is not None and not old:
            first = next(quads, None)
            if first is None:  # nothing in the place of nothing
                return []
            self._forget_what_was_inferred(below)
            with self._writing() as store:
                store.load(chain([first], quads), below)
            return self.graphs(*below)
        new = Store()  # turns literals into the form that the store gives back: 1.0 and 1.00 are one double
        new.extend(quads)
        names = {*names_in(new), *old}
        changed = sorted(name for name in names if not same(triples_in(new, name), self.store.triples(name)))
        if changed:
            self._forget_what_was_inferred(changed)
            with self._writing() as store:
                store.replace({name: triples_in(new, name) for name in changed})
            self.flush()
        return changed

    @telling
    def change(self, removed: Iterable[Quad], added: Iterable[Quad]) -> None:
        """Take quads out of their named graphs and put others in, in one transaction; the rest stays untouched.

        ValueError for blank nodes: they have no name to find them by.
        """
        taken, given = set(removed), set(added)
        taken -= given
        both = taken | given
        if has_blank_node(both):
            raise ValueError("quads with blank nodes cannot be changed one by one; replace their graph")
        if any(map(changes.is_asserted, both)):
            self.read = {}
        if (embedded := self.store.embedded) is not None:
            notes = changes.notes(embedded, both)
            taken -= notes
            given |= {note for note in notes if note not in embedded}  # those of a live robot are there already
        with self._writing() as store:
            store.exchange(taken, given)

    def flush(self) -> None:
        """Put what `change` wrote into the store's files: who opens the graph to read replays the store's log."""
        self.store.flush()

    def quads(self) -> Iterator[Quad]:
        """Yield the quads of all named graphs, as one query sees them."""
        for row in cast(QuerySolutions, self.answer("SELECT ?g ?s ?p ?o { GRAPH ?g { ?s ?p ?o } }")):
            yield Quad(row["s"], row["p"], row["o"], row["g"])

    @telling
    def graphs_with(self, triple: Triple) -> list[str]:
        """Return the IRIs of the named graphs that hold a triple."""
        return [
            quad.graph_name.value for quad in self.store.holding([triple]) if isinstance(quad.graph_name, NamedNode)
        ]

    @telling
    def holds(self, triple: Triple) -> bool:
        """Whether some named graph holds a triple."""
        return next(iter(self.store.holding([triple])), None) is not None

    @telling
    def graphs(self, *below: str) -> list[str]:
        """Return the IRIs of the named graphs: of all, or of those that are `below`.

        below: whole IRIs; one that ends in / stands for all graphs whose IRIs begin with it, and "" for all.
        """
        return self.store.graphs(*below)

    @telling
    def triples(self, *below: str) -> set[Triple]:
        """Return the triples of the named graphs `below`, as in `graphs`, of all without it."""
        return self.store.triples(*below)

    @telling
    def query(self, text: str, bindings: Mapping[str, str | Literal] | None = None) -> AnswerTable:
        """Answer a SELECT, ASK, CONSTRUCT or DESCRIBE over the union of all named graphs.

        `bindings` gives variables the IRI that they stand for, whole or below the base. The usual prefixes need no
        PREFIX. InputError where the text is no such query, asks another server, or has too many answers.
        """
        given = (bindings or {}).items()
        text = bound(text, {name: self.iri(value) if isinstance(value, str) else value for name, value in given})
        answers = self.answers
        kept = answers.get(text)
        if kept is None:
            faults: dict[str, None] = {}
            kept = table_of(self.answer(text, faults=faults), faults)
            if len(kept) * len(kept.columns) <= _MOST_KEPT:
                answers.keep(kept, text)
        return AnswerTable(kept.columns, tuple(map(dict, kept.rows)), kept.faults)  # rows that may be written to

    @telling
    def construct(self, text: str) -> set[Triple]:
        """Return the triples that a CONSTRUCT makes of the union of all named graphs."""
        triples = self.answer(text)
        assert not isinstance(triples, QuerySolutions | QueryBoolean)
        return set(triples)

    @telling
    def answer(
        self,
        text: str,
        default_graphs: Sequence[str] = (),
        named_graphs: Sequence[str] = (),
        faults: dict[str, None] | None = None,
        base: str | None = None,
        services: Collection[str] = (),
    ) -> QuerySolutions | QueryBoolean | QueryTriples:
        """Answer a query row by row as they are found; InputError where it is none or asks a server not of `services`.

        Graphs that are given are the query's dataset, as in the SPARQL 1.1 Protocol; else all of them are.
        `faults` is told why functions had no answer, while the rows are found. Relative IRIs are below `base`,
        else below the graph's.
        """
        base = base or self.base
        refuse_service(text, base, self.store.embedded is None, services)
        whole = not (default_graphs or named_graphs)
        try:
            return self.store.query(
                text,
                base_iri=base,
                prefixes=self.prefixes,
                default_graph=None if whole else [graph_name(iri) for iri in default_graphs],
                named_graphs=None if whole else [graph_name(iri) for iri in named_graphs],
                custom_functions=self._functions({} if faults is None else faults),
            )
        except SyntaxError as error:
            raise InputError(f"not a SPARQL query: {in_words(error, text)}") from error
        except RuntimeError as error:
            if "function" in str(error):
                raise InputError(f"{error}: see the functions of ontology/providers.ttl and of SPARQL 1.1") from None
            raise

    @telling
    def update(
        self, text: str, default_graphs: Sequence[str] = (), named_graphs: Sequence[str] = (), base: str | None = None
    ) -> None:
        """Do a SPARQL update in one transaction; raises InputError as `difference`."""
        removed, added = self.difference(text, default_graphs, named_graphs, base)
        if has_blank_node(removed):  # which have no name to find them by
            names = {quad.graph_name.value for quad in removed | added}  # type: ignore[union-attr]
            concerned = names | set(self.graphs(*names))
            held = {quad for quad in self.quads() if quad.graph_name.value in concerned}  # type: ignore[union-attr]
            self.replace(held - removed | added, *concerned)
        else:
            self.change(removed, added)
        self.flush()

    @telling
    def difference(
        self, text: str, default_graphs: Sequence[str] = (), named_graphs: Sequence[str] = (), base: str | None = None
    ) -> tuple[set[Quad], set[Quad]]:
        """Return the quads of named graphs that a SPARQL update would take out and put in: see `updates`.

        Graphs and base are those of `answer`. InputError where the text is no update, reads from elsewhere, or fails.
        """
        base = base or self.base
        check(text, base, self.store.embedded is None)
        if default_graphs or named_graphs:
            text = using(text, default_graphs, named_graphs, base)

        def construct(asked: str) -> set[Triple]:
            return set(cast(QueryTriples, self.store.query(asked, base_iri=base, prefixes=self.prefixes)))

        try:
            change = by_asking(text, self.store.holding, construct, base, self.prefixes)
            removed, added = change or by_doing(text, self.quads(), base, self.prefixes)
        except (SyntaxError, RuntimeError) as error:
            raise InputError(f"the update failed, nothing changed: {error}") from error
        return removed, named_below(added, self.iri("genid/"))

    @telling
    def changed(self, reader: str) -> set[Quad] | None:
        """Return the notes of `changes` for GRAPH_INFERRED or GRAPH_VALIDATION; None on a server, where none are."""
        return None if self.store.embedded is None else changes.noted(self.store.embedded, reader)

    def made_of(self) -> set[Quad]:
        """Return what `changes` says of the inferred graphs and the report as a whole; nothing of a server's graph."""
        return set() if self.store.embedded is None else changes.made_of(self.store.embedded)

    def _forget_what_was_inferred(self, written: Iterable[str]) -> None:
        """Before graphs are written whole: have everything inferred and validated anew, if they are asserted."""
        if all(name.startswith(changes.NOT_ASSERTED) for name in written):
            return
        self.read = {}
        self.change(self.made_of(), ())

    def _functions(self, faults: dict[str, None]) -> Functions:
        """Return the functions that reach the samples of runs, where their files are known."""
        if self.store.embedded is None or self._workspace is None:
            return {}
        return series_functions(self.store.embedded, self._workspace, faults)
