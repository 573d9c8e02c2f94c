"""What follows from the graph: OWL 2 RL, SWRL and SHACL rules, each into a named graph of its own.

Beside what was inferred stands what it was inferred from, as the name that the premises' content has (RFC 6920). Where
that is still the same nothing is done; else it is inferred again, and only what differs is taken out or put in.
"""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from pyoxigraph import BlankNode, NamedNode, Quad, Store, Triple

from irtwin.knowledge import shacl_rules
from irtwin.knowledge.graph import KnowledgeGraph, in_graph
from irtwin.knowledge.owl_rl import Closure
from irtwin.knowledge.vocabulary import (
    GRAPH_INFERRED,
    GRAPH_OWL_RL,
    GRAPH_REASONED,
    GRAPH_SHACL,
    GRAPH_SWRL,
    GRAPH_VALIDATION,
    PROV,
)
from irtwin.resources import folder

_NOT_ASSERTED = (GRAPH_INFERRED, GRAPH_REASONED, GRAPH_VALIDATION)
_DERIVED_FROM = NamedNode(PROV + "wasDerivedFrom")

_AROUND = f"""
CONSTRUCT {{ ?s ?p ?o }}
WHERE {{
  {{ VALUES ?s {{ ?nodes }} GRAPH ?g {{ ?s ?p ?o }} }} UNION {{ VALUES ?o {{ ?nodes }} GRAPH ?g {{ ?s ?p ?o }} }}
  FILTER(?g NOT IN (<{GRAPH_OWL_RL}>, <{GRAPH_REASONED}>, <{GRAPH_VALIDATION}>))
}}"""

Contents = Mapping[str, set[Triple]]  # of named graphs, by their IRIs


@dataclass(frozen=True)
class Inferences:
    """How many triples each kind of reasoning holds, and the IRIs of the named graphs that changed."""

    owl_rl: int
    swrl: int
    shacl: int
    changed: tuple[str, ...]


def reason(graph: KnowledgeGraph) -> Inferences:
    """Bring what is inferred up to date with what is asserted.

    The closure comes first, so that rules see types and inverses that nobody wrote; then the rules; then the
    closure of what they concluded. InputError names a contradiction, and what was inferred before is dropped.
    """
    premises = asserted(graph)
    made_of = _content_name(premises)
    if _derivations(graph).get(GRAPH_OWL_RL) == made_of:
        return _count(_inferred(graph), [])
    try:
        contents, sources = _infer(graph, premises)
    except Exception:
        graph.replace([], GRAPH_INFERRED, GRAPH_REASONED)
        raise
    return _count(contents, _write(graph, contents, {GRAPH_OWL_RL: made_of, **sources}))


def asserted(graph: KnowledgeGraph) -> set[Triple]:
    """Return what nobody inferred: ontology, mapped sources, activities, and what SPARQL updates wrote."""
    names = [name for name in graph.graphs() if not name.startswith(_NOT_ASSERTED)]
    return graph.triples(*names) if names else set()


def not_closed(graph: KnowledgeGraph) -> set[Triple]:
    """Return what the closure was made of: what is asserted, and what rules concluded."""
    names = [name for name in graph.graphs() if not name.startswith((GRAPH_OWL_RL, GRAPH_REASONED, GRAPH_VALIDATION))]
    return graph.triples(*names) if names else set()


def around(graph: KnowledgeGraph, nodes: Iterable[NamedNode]) -> set[Triple]:
    """Return that part of `not_closed` that has one of the nodes for subject or object."""
    values = " ".join(map(str, nodes))
    return graph.construct(_AROUND.replace("?nodes", values))


def check_consistency(graph: KnowledgeGraph) -> None:
    """Let HermiT look for a contradiction in what is asserted; InputError where there is one."""
    from irtwin.knowledge import owl_dl  # starts Java: only where it is needed

    owl_dl.check_consistency(asserted(graph))


def _infer(graph: KnowledgeGraph, premises: set[Triple]) -> tuple[Contents, dict[str, NamedNode]]:
    from irtwin.knowledge import owl_dl

    closure = Closure(premises)
    known = premises | closure.worth_keeping()
    facts = owl_dl.facts_of_rules(known)
    facts_name = _content_name(facts)
    if _derivations(graph).get(GRAPH_SWRL) == facts_name:
        swrl = graph.triples(GRAPH_SWRL)
    else:
        swrl = owl_dl.swrl_conclusions(facts)
    made = shacl_rules.conclusions(known | swrl, shacl_rules.shipped_rules())
    shacl = {shacl_rules.graph_of(name): found for name, found in made.items()}
    closure.add(swrl.union(*shacl.values()))
    return {GRAPH_OWL_RL: closure.worth_keeping(), GRAPH_SWRL: swrl, **shacl}, {GRAPH_SWRL: facts_name}


def _write(graph: KnowledgeGraph, contents: Contents, sources: Mapping[str, NamedNode]) -> list[str]:
    """Make `contents` what is inferred, and say of what it was made; return the IRIs of the graphs that changed."""
    derivations = {Triple(NamedNode(name), _DERIVED_FROM, source) for name, source in sources.items()}
    new = _as_stored({**contents, GRAPH_REASONED: derivations})
    old = {
        quad for name in graph.graphs(GRAPH_INFERRED, GRAPH_REASONED) for quad in in_graph(graph.triples(name), name)
    }
    differing = new ^ old
    if any(isinstance(term, BlankNode) for quad in differing for term in (quad.subject, quad.object)):
        return graph.replace(new, GRAPH_INFERRED, GRAPH_REASONED)
    graph.change(old - new, new - old)
    names = {quad.graph_name.value for quad in differing if isinstance(quad.graph_name, NamedNode)}
    return sorted(names - {GRAPH_REASONED})


def _as_stored(contents: Contents) -> set[Quad]:
    """Return the contents as quads, their literals in the form that the store gives back."""
    store = Store()
    for name, triples in contents.items():
        store.extend(in_graph(triples, name))
    return set(store)


def _inferred(graph: KnowledgeGraph) -> Contents:
    return {name: graph.triples(name) for name in graph.graphs(GRAPH_INFERRED)}


def _derivations(graph: KnowledgeGraph) -> dict[str, object]:
    return {
        str(it.subject.value): it.object for it in graph.triples(GRAPH_REASONED) if isinstance(it.subject, NamedNode)
    }


def _content_name(triples: Iterable[Triple]) -> NamedNode:
    """Return the name that triples and the rules have by their content."""
    digest = hashlib.sha256()
    for file in sorted(folder("rules").glob("*.*")):
        digest.update(file.read_bytes())
    for line in sorted(map(str, triples)):
        digest.update(line.encode())
    return NamedNode("ni:///sha-256;" + base64.urlsafe_b64encode(digest.digest()).decode().rstrip("="))


def _count(contents: Contents, changed: Iterable[str]) -> Inferences:
    shacl = [triples for name, triples in contents.items() if name.startswith(GRAPH_SHACL)]
    return Inferences(
        owl_rl=len(contents.get(GRAPH_OWL_RL, ())),
        swrl=len(contents.get(GRAPH_SWRL, ())),
        shacl=len(set().union(*shacl)),
        changed=tuple(changed),
    )
