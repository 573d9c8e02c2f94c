"""What the graph shows of live runs: their rows by the shipped mapping, and the alarms that rules raise of them."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from typing import cast

from pyoxigraph import Literal, NamedNode, Quad, QuerySolutions, Triple

from irtwin.knowledge.mapping import RowMapper, refresh
from irtwin.knowledge.owl_rl.beside import Equality, FactsClosure
from irtwin.knowledge.owl_rl.closure import Contradiction
from irtwin.knowledge.parts import Ontology
from irtwin.knowledge.rules.files import read_rules
from irtwin.knowledge.rules.rule import Rule
from irtwin.knowledge.rules.running import conclusions
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.named_graphs import in_graph
from irtwin.knowledge.vocabulary import GRAPH_ACTIVITY, GRAPH_OWL_RL, GRAPH_SHACL, GRAPH_SOURCE, term
from irtwin.live.live_run import activities
from irtwin.providers.names import run_iri
from irtwin.storage.database import Workspace
from irtwin.storage.rows import Tables

_STATE, _REASON = term("Alarm_State"), term("Alarm_Reason")
_BESIDE = """CONSTRUCT { ?s ?p ?o } WHERE {
  { VALUES ?p { irt:Joint_Name qudt:symbol } ?s ?p ?o } UNION { ?s a irt:Limit ; ?p ?o } }"""


class ShownRuns:
    """Brings live runs into a workspace's graph and keeps them current there."""

    def __init__(self, place: Workspace, graph: KnowledgeGraph) -> None:
        self._place, self._graph = place, graph
        self._documents = graph.resources.paths("mappings")
        self.mapper = RowMapper(place.engine, self._documents, place.base)
        self._rules = read_rules(graph.resources.path("rules", "live_rules.ttl"))
        self._rules_of_runs = read_rules(graph.resources.path("rules", "rules.ttl"))  # of a run that is over
        self._beside: set[Triple] | None = None
        self._ontology: Ontology | None = None
        self._changed = False  # since the last flush

    def prepare(self) -> None:
        """Read and close the ontology, which stays as it is while robots are watched: no first state waits for that."""
        self._ontology = Ontology(self._graph)
        with suppress(Contradiction):
            _ = self._ontology.schema

    def flush(self) -> None:
        """Make what was shown quick to open, if something was."""
        if self._changed:
            self._changed = False
            self._graph.flush()

    def show(self, run_id: str, shown: set[Quad] | None, quads: set[Quad]) -> None:
        """Bring the graph from what it shows of a run, None where that is unknown, to the quads."""
        if shown is None:
            shown = self._quads_of(run_id)
        self._graph.change(shown - quads, quads - shown)
        self._changed = True

    def mapped(self, run_id: str, tables: Tables) -> set[Quad]:
        """Return the quads of the rows of a run that is over, and what follows from them."""
        quads = {quad for table in tables.items() for quad in self.mapper.quads(*table)}
        quads |= self._conclusions(quads, self._rules + self._rules_of_runs)
        return quads | self.kinds(run_id, quads)

    def kinds(self, run_id: str, quads: Iterable[Quad]) -> set[Quad]:
        """Return what OWL concludes of a run from quads about it: of which kinds it is, and what leads to it."""
        run = NamedNode(self._graph.iri(run_iri(run_id)))
        ontology = self._ontology or Ontology.of(self._graph)
        try:
            concluded = FactsClosure(ontology.schema, {quad.triple for quad in quads}).worth_keeping()
        except (Contradiction, Equality):  # told by `irtwin run`, which sets aside what clashes
            return set()
        return set(in_graph((triple for triple in concluded if run in (triple.subject, triple.object)), GRAPH_OWL_RL))

    def alarms(self, quads: Iterable[Quad]) -> set[Quad]:
        """Return what the rules of `rules/live_rules.ttl` conclude from a run's excursions or state among the quads."""
        return self._conclusions(quads, self._rules)

    def _conclusions(self, quads: Iterable[Quad], rules: tuple[Rule, ...]) -> set[Quad]:
        if self._beside is None:
            self._beside = self._graph.construct(_BESIDE)
        concluded = conclusions(self._beside | {quad.triple for quad in quads}, rules)
        return {quad for name, triples in concluded.items() for quad in in_graph(triples, name)}

    def refresh(self) -> None:
        """Bring the graph up to date with the database."""
        refresh(self._graph, self._place.engine, self._documents, self._place.mapped_rows)

    def _quads_of(self, run_id: str) -> set[Quad]:
        """Return what the graph says of a live run."""
        run = NamedNode(self._graph.iri(run_iri(run_id)))
        graphs = " ".join(f"<{GRAPH_ACTIVITY}{activity}>" for activity in activities(run_id))
        triples = self._graph.answer(
            f"""SELECT ?g ?s ?p ?o {{
              {{ VALUES ?g {{ {graphs} }} GRAPH ?g {{ ?s ?p ?o }} }} UNION
              {{ GRAPH ?g {{ {run} ?p ?o }} BIND({run} AS ?s)
                 FILTER(STRSTARTS(STR(?g), "{GRAPH_SOURCE}")) }} UNION
              {{ GRAPH ?g {{ ?s irt:alarm_of_Run {run} ; ?p ?o }}
                 FILTER(STRSTARTS(STR(?g), "{GRAPH_SHACL}")) }} }}"""
        )
        return {Quad(row["s"], row["p"], row["o"], row["g"]) for row in cast(QuerySolutions, triples)}


class AlarmNews:
    """Tells once of each alarm that was raised, and once that it is cleared."""

    def __init__(self) -> None:
        self._states: dict[str, str] = {}

    def news(self, quads: Iterable[Quad]) -> list[str]:
        """Return a line for each alarm among the quads whose state is new."""
        kinds_of: dict[str, dict[str, str]] = {}
        for quad in quads:
            if quad.predicate.value in (_STATE, _REASON) and isinstance(quad.object, Literal):
                kinds_of.setdefault(str(quad.subject), {})[quad.predicate.value] = quad.object.value
        lines = [
            f"alarm {of[_STATE]}: {of[_REASON]}"
            for alarm, of in kinds_of.items()
            if self._states.get(alarm) != of[_STATE]
        ]
        self._states = {alarm: of[_STATE] for alarm, of in kinds_of.items()}
        return lines
