"""What rules and OWL 2 RL conclude of some parts of the graph, and what that was made of."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache

from pyoxigraph import NamedNode, Quad, Store, Triple

from irtwin.knowledge import parts
from irtwin.knowledge.engines import NATIVE
from irtwin.knowledge.java import java
from irtwin.knowledge.parts import Ontology
from irtwin.knowledge.shacl import rules as shacl_rules
from irtwin.knowledge.store.changes import DERIVED_FROM
from irtwin.knowledge.store.graph import in_graph
from irtwin.knowledge.vocabulary import GRAPH_REASONED, GRAPH_SWRL
from irtwin.resources import Files, Resources, folder


@dataclass
class Conclusions:
    """What was concluded, by the IRIs of named graphs; what it was made of; by whom; what makes the graph one part."""

    contents: dict[str, set[Triple]] = field(default_factory=dict)
    made_of: dict[object, NamedNode] = field(default_factory=dict)
    made_by: set[Triple] = field(default_factory=set)
    joined_by: str | None = None

    def concluded(self) -> set[Triple]:
        """Return the triples of all the named graphs."""
        return set().union(*self.contents.values())

    def quads(self) -> set[Quad]:
        """Return all of it as the store gives it back: 1.0 and 1.00 are one double."""
        store = Store()
        derivations = {Triple(node, DERIVED_FROM, name) for node, name in self.made_of.items()}  # type: ignore[arg-type]
        for name, triples in {**self.contents, GRAPH_REASONED: derivations | self.made_by}.items():
            store.extend(in_graph(triples, name))
        return set(store)


def by_rules(ontology: Ontology, known: set[Triple], before: set[Quad], joined: bool) -> Conclusions:
    """Return what the SWRL and SHACL rules conclude."""
    facts = facts_of_swrl(ontology, known, joined)
    swrl = by_swrl(ontology, facts, before)
    return Conclusions({GRAPH_SWRL: swrl, **by_shacl(ontology, known | swrl)}, names_of(facts, ontology.resources))


def by_shacl(ontology: Ontology, known: set[Triple]) -> dict[str, set[Triple]]:
    """Return what the SHACL rules conclude, by the IRIs of their named graphs."""
    made = shacl_rules.conclusions(known, shacl_rules.all_rules(ontology.resources))
    return {shacl_rules.graph_of(name): triples for name, triples in made.items()}


def names_of(facts: Mapping[parts.Name, set[Triple]], resources: Resources) -> dict[object, NamedNode]:
    """Return the names that the facts of SWRL rules have by their content, part by part."""
    return {node: content_name(some, resources) for node, some in facts.items()}


def facts_of_swrl(ontology: Ontology, known: set[Triple], joined: bool) -> dict[parts.Name, set[Triple]]:
    """Return what the SWRL rules speak of, part by part, each by the first node that it speaks of."""
    from irtwin.knowledge import owl_dl  # owlready2 takes a while to import

    facts = owl_dl.facts_of_rules(known, ontology.resources.of("rules", ".swrl.ttl"))
    if joined:
        return {NamedNode(GRAPH_SWRL): facts}
    part_of = parts.parted(ontology, known)
    common, of_parts = set[Triple](), dict[parts.Name, set[Triple]]()
    for fact in facts:
        nodes = ontology.nodes(fact)
        (of_parts.setdefault(part_of(nodes[0]), set()) if nodes else common).add(fact)
    return {
        min((node for fact in some for node in ontology.nodes(fact)), key=str): some | common
        for some in of_parts.values()
    }


def by_swrl(ontology: Ontology, facts: Mapping[parts.Name, set[Triple]], before: set[Quad]) -> set[Triple]:
    """Return what the SWRL rules conclude: by Pellet where facts are not those of before; nothing without Java."""
    from irtwin.knowledge import owl_dl

    if java() is None:
        return set()

    old = {quad.triple for quad in before if graph_of(quad) == GRAPH_SWRL}
    noted = {(quad.subject, quad.object) for quad in before if graph_of(quad) == GRAPH_REASONED}
    changed = {node for node, some in facts.items() if (node, content_name(some, ontology.resources)) not in noted}
    if not changed and NamedNode(GRAPH_SWRL) in facts:
        return old
    new = set[Triple]()
    if changed:
        files = ontology.resources.of("rules", ".swrl.ttl")
        new = owl_dl.swrl_conclusions(set().union(*(facts[node] for node in changed)), files)
    spoken_of = {node for some in facts.keys() - changed for fact in facts[some] for node in ontology.nodes(fact)}
    return new | {triple for triple in old if spoken_of.intersection(ontology.nodes(triple))}


def content_name(triples: Iterable[Triple], resources: Resources, engine: str = NATIVE) -> NamedNode:
    """Return the name that triples, the rules and those who run them have by their content."""
    digest = hashlib.sha256(
        _rules(resources.of("rules") + resources.of("shapes")) + engine.encode() + (b"" if java() else b" without Java")
    )
    for line in sorted(map(str, triples)):
        digest.update(line.encode())
    return NamedNode("ni:///sha-256;" + base64.urlsafe_b64encode(digest.digest()).decode().rstrip("="))


@lru_cache(maxsize=16)
def _rules(files: Files) -> bytes:
    """Return rules and shapes as they are written, and those of OWL 2 RL."""
    paths = [*sorted(folder("rules").glob("owl2_rl*")), *(file.path for file in files)]
    return b"".join(path.read_bytes() for path in paths)


def graph_of(quad: Quad) -> str:
    """Return the IRI of a quad's named graph."""
    return quad.graph_name.value if isinstance(quad.graph_name, NamedNode) else ""
