"""What follows from the graph: OWL 2 RL and rules, each into a named graph of its own.

What is concluded of one robot bears on no other (see `parts`), so after a change only those parts of the graph that it
touched are reasoned over again, beside the ontology. Where that cannot be, the whole graph is. What the conclusions
were made of stands beside them, as the name that the premises' content has (RFC 6920): the ontology and the rules, or
everything where the graph is one part.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from functools import partial

from pyoxigraph import Literal, NamedNode, Quad, Triple

from irtwin.knowledge import by_parts, engines, parts
from irtwin.knowledge.conclusions import CONTRADICTION, Conclusions, by_rules, contain, content_name, graph_of, infer
from irtwin.knowledge.engines import NATIVE
from irtwin.knowledge.garbage import seldom_collected
from irtwin.knowledge.owl_rl.closure import Contradiction
from irtwin.knowledge.parts import Joined, Ontology
from irtwin.knowledge.store.blank_nodes import has_blank_node
from irtwin.knowledge.store.changes import DERIVED_FROM, NOT_ASSERTED, nodes_of
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.named_graphs import in_graph
from irtwin.knowledge.vocabulary import (
    GRAPH_CHANGED,
    GRAPH_INFERRED,
    GRAPH_OWL_RL,
    GRAPH_REASONED,
    GRAPH_SHACL,
    GRAPH_SWRL,
    GRAPH_VALIDATION,
    PROV,
    term,
)

_SET_ASIDE = f"""
SELECT ?robot ?why WHERE {{ GRAPH <{GRAPH_REASONED}> {{ ?robot <{term("Contradiction")}> ?why }} }} ORDER BY ?robot"""

_OWL_RL = NamedNode(GRAPH_OWL_RL)
_ATTRIBUTED_TO = NamedNode(PROV + "wasAttributedTo")

_NOT_CLOSED = (GRAPH_OWL_RL, GRAPH_REASONED, GRAPH_VALIDATION, GRAPH_CHANGED)

_AROUND = f"""
CONSTRUCT {{ ?s ?p ?o }}
WHERE {{
  {{ VALUES ?s {{ ?nodes }} GRAPH ?g {{ ?s ?p ?o }} }} UNION {{ VALUES ?o {{ ?nodes }} GRAPH ?g {{ ?s ?p ?o }} }}
  FILTER(?g NOT IN ({", ".join(f"<{name}>" for name in _NOT_CLOSED)}))
}}"""


@dataclass(frozen=True)
class Inferences:
    """How many triples OWL 2 RL and the rules concluded that were not there before.

    `joined_by` says what makes the graph one part, so that all of it was reasoned over; None where nothing does.
    `set_aside` are the IRIs of whom statements are about that contradict each other, and of their robots, and which
    these are.
    """

    owl_rl: int
    by_rules: int
    joined_by: str | None = None
    set_aside: tuple[tuple[str, str], ...] = ()

    @property
    def contradictions(self) -> dict[str, list[str]]:
        """Return each contradiction in words, and whom it is about."""
        contradictions: dict[str, list[str]] = {}
        for node, why in self.set_aside:
            contradictions.setdefault(why, []).append(node)
        return contradictions


@seldom_collected()
def reason(graph: KnowledgeGraph, engine: str = NATIVE) -> Inferences:
    """Bring what is inferred up to date with what is asserted.

    The closure comes first, so that rules see types and inverses that nobody wrote; then rules and closure in turn,
    until neither finds anything new. Statements that contradict each other are set aside, and all else is concluded.
    Contradiction names one of the ontology's own: what was inferred before stays, with a note of it. Engines other than
    the native one close
    the graph as one part, take no contradiction, and leave what was inferred before as it is where they fail.
    """
    ontology = Ontology.of(graph)
    changed = graph.changed(GRAPH_INFERRED)
    if engine != NATIVE:
        return _reason_over_all(graph, ontology, changed, engine)
    try:
        if changed is None:
            return _reason_over_all(graph, ontology, changed)
        try:
            return _by_parts(graph, ontology, changed)
        except Joined as joined:
            return _reason_over_all(graph, ontology, changed, joined_by=str(joined))
    except Contradiction as clash:
        graph.replace([Quad(_OWL_RL, CONTRADICTION, Literal(str(clash)), NamedNode(GRAPH_REASONED))], GRAPH_REASONED)
        raise
    except Exception:
        graph.replace([], GRAPH_INFERRED, GRAPH_REASONED)
        raise


def asserted(graph: KnowledgeGraph) -> set[Triple]:
    """Return what nobody inferred: ontology, mapped sources, activities, and what SPARQL updates wrote."""
    return _but_for(graph, NOT_ASSERTED)


def not_closed(graph: KnowledgeGraph) -> set[Triple]:
    """Return what the closure was made of: what is asserted, and what rules concluded."""
    return _but_for(graph, _NOT_CLOSED)


def _but_for(graph: KnowledgeGraph, apart: tuple[str, ...]) -> set[Triple]:
    """Return what all named graphs say but for those whose IRIs begin so."""
    names = [name for name in graph.graphs() if not name.startswith(apart)]
    return graph.triples(*names) if names else set()


def around(graph: KnowledgeGraph, nodes: Iterable[NamedNode]) -> set[Triple]:
    """Return that part of `not_closed` that has one of the nodes for subject or object."""
    values = " ".join(map(str, nodes))
    return graph.construct(_AROUND.replace("?nodes", values))


def _by_parts(graph: KnowledgeGraph, ontology: Ontology, changed: set[Quad]) -> Inferences:
    """Reason over the parts that changed, or over all parts where ontology or rules did. Raises Joined."""
    name = content_name(ontology.triples, ontology.resources)
    if made_of(graph) != name:
        notes = set(in_graph(graph.triples(GRAPH_REASONED), GRAPH_REASONED))
        changes = by_parts.conclude(graph, ontology)
        base = Conclusions(made_of={_OWL_RL: name}, made_by={_made_by(NATIVE)}).quads()
        changes.write(changed | notes - changes.noted - base, base - notes)
        graph.store.merge_loads()
    elif changed:
        changes = by_parts.conclude(graph, ontology, nodes_of(changed))
        changes.write(changed)
    else:
        return _count(graph, Counter())
    return _count(graph, changes.new)


def _reason_over_all(
    graph: KnowledgeGraph,
    ontology: Ontology,
    changed: set[Quad] | None,
    engine: str = NATIVE,
    joined_by: str | None = None,
) -> Inferences:
    premises = asserted(graph)
    everything = content_name(premises, ontology.resources, engine)
    if made_of(graph) == everything:
        return _count(graph, Counter())
    engines.check(engine, len(premises))
    old = {
        quad for name in graph.graphs(GRAPH_INFERRED, GRAPH_REASONED) for quad in in_graph(graph.triples(name), name)
    }
    if engine == NATIVE:
        inferred = _infer_without_contradiction(ontology, premises - ontology.triples)
    else:
        inferred = _infer_by(engine, ontology, premises)
    inferred.made_of[_OWL_RL] = everything
    inferred.made_by.add(_made_by(engine))
    new = inferred.quads()
    if has_blank_node(new ^ old):
        graph.replace(new, GRAPH_INFERRED, GRAPH_REASONED)
        graph.change(changed or (), ())
    else:
        graph.change((old - new) | (changed or set()), new - old)
    return _count(graph, Counter(map(graph_of, new - old)), joined_by)


def _made_by(engine: str) -> Triple:
    return Triple(_OWL_RL, _ATTRIBUTED_TO, engines.reasoner(engine))


def _infer_without_contradiction(ontology: Ontology, premises: set[Triple]) -> Conclusions:
    """Conclude from the ontology and all parts but the statements that contradict each other; note which these are."""
    aside, inferred = contain(ontology.triples, premises, partial(infer, ontology, premises))
    if aside.statements:
        inferred.made_by = aside.notes(parts.robots_about(ontology, premises, aside.statements))
    return inferred


def _infer_by(engine: str, ontology: Ontology, premises: set[Triple]) -> Conclusions:
    """Conclude from all of the graph by an engine that is not the native one."""
    known = premises | engines.worth_keeping(engine, premises)
    conclusions = by_rules(ontology, known)
    conclusions.contents[GRAPH_OWL_RL] = engines.worth_keeping(engine, premises | conclusions.concluded())
    return conclusions


def made_of(graph: KnowledgeGraph) -> object:
    """Return the name of what the closure was made of, or None."""
    return next(iter(_of_closure(graph, DERIVED_FROM)), None)


def engine_of(graph: KnowledgeGraph) -> str:
    """Return the engine that drew the conclusions in a graph; the native one where none are."""
    made_by = _of_closure(graph, _ATTRIBUTED_TO)
    return next((engine for engine in engines.ENGINES if engines.reasoner(engine) in made_by), NATIVE)


def _of_closure(graph: KnowledgeGraph, predicate: NamedNode) -> set[object]:
    """Return what was noted of the closure."""
    noted = graph.triples(GRAPH_REASONED)
    return {triple.object for triple in noted if (triple.subject, triple.predicate) == (_OWL_RL, predicate)}


def _count(graph: KnowledgeGraph, new: Counter[str], joined_by: str | None = None) -> Inferences:
    aside = [(str(row["robot"]), str(row["why"])) for row in graph.query(_SET_ASIDE)]
    by_rules = sum(count for name, count in new.items() if name.startswith((GRAPH_SHACL, GRAPH_SWRL)))
    return Inferences(new[GRAPH_OWL_RL], by_rules, joined_by, tuple(aside))
