"""What follows from the graph: OWL 2 RL, SWRL and SHACL rules, each into a named graph of its own."""

from __future__ import annotations

from dataclasses import dataclass

from irtwin.knowledge import owl_rl, shacl_rules
from irtwin.knowledge.graph import KnowledgeGraph, in_graph
from irtwin.knowledge.vocabulary import (
    GRAPH_ACTIVITY,
    GRAPH_INFERRED,
    GRAPH_ONTOLOGY,
    GRAPH_OWL_RL,
    GRAPH_SOURCE,
    GRAPH_SWRL,
)

_ASSERTED = (GRAPH_ONTOLOGY, GRAPH_SOURCE, GRAPH_ACTIVITY)


@dataclass(frozen=True)
class Inferences:
    """How many triples each kind of reasoning added."""

    owl_rl: int
    swrl: int
    shacl: int


def reason(graph: KnowledgeGraph) -> Inferences:
    """Drop what was inferred and infer it anew from what is asserted.

    The closure comes first, so that rules see types and inverses that nobody wrote; then the rules; then the
    closure of what they concluded. InputError names a contradiction.
    """
    from irtwin.knowledge import owl_dl  # starts Java: only where it is needed

    graph.replace([], GRAPH_INFERRED)
    _close(graph)
    swrl = owl_dl.swrl_conclusions(graph.triples())
    graph.replace(in_graph(swrl, GRAPH_SWRL), GRAPH_SWRL)
    shacl = shacl_rules.infer(graph)
    return Inferences(owl_rl=_close(graph), swrl=len(swrl), shacl=shacl)


def check_consistency(graph: KnowledgeGraph) -> None:
    """Let HermiT look for a contradiction in what is asserted; InputError where there is one."""
    from irtwin.knowledge import owl_dl

    owl_dl.check_consistency(graph.triples(*_ASSERTED))


def _close(graph: KnowledgeGraph) -> int:
    rules = [name for name in graph.graphs(GRAPH_INFERRED) if name != GRAPH_OWL_RL]
    inferred = owl_rl.closure(graph.triples(*_ASSERTED, *rules))
    graph.replace(in_graph(inferred, GRAPH_OWL_RL), GRAPH_OWL_RL)
    return len(inferred)
