"""What rules and OWL 2 RL conclude of some parts of the graph, and what that was made of.

A contradiction is contained: the statements that clash are set aside, and all else is concluded from. Of these none is
known to be the wrong one, so all of them are set aside: two payloads of one run, and not its robot. What rules conclude
into a clash is set aside likewise.
"""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Callable, Iterable
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import chain
from typing import Self, TypeVar

from pyoxigraph import Literal, NamedNode, Quad, Store, Triple

from irtwin.knowledge.engines import NATIVE
from irtwin.knowledge.owl_rl.closure import Closure, Contradiction, say
from irtwin.knowledge.parts import Ontology
from irtwin.knowledge.rules import running
from irtwin.knowledge.rules.files import all_rules
from irtwin.knowledge.store.changes import DERIVED_FROM
from irtwin.knowledge.store.named_graphs import in_graph
from irtwin.knowledge.vocabulary import GRAPH_OWL_RL, GRAPH_REASONED, term
from irtwin.resources import Files, Resources, folder

T = TypeVar("T")
CONTRADICTION = NamedNode(term("Contradiction"))
_MOST_LOOKS = 30  # each finds many clashes of one kind
_MOST_NAMED = 3  # statements, in words


@dataclass
class Conclusions:
    """What was concluded, by the IRIs of named graphs; what it was made of; by whom."""

    contents: dict[str, set[Triple]] = field(default_factory=dict)
    made_of: dict[object, NamedNode] = field(default_factory=dict)
    made_by: set[Triple] = field(default_factory=set)

    def concluded(self) -> set[Triple]:
        """Return the triples of all the named graphs."""
        return set().union(*self.contents.values())

    def without(self, aside: AbstractSet[Triple]) -> Self:
        """Return the same without some triples."""
        return replace(self, contents={name: triples - aside for name, triples in self.contents.items()})

    def quads(self) -> set[Quad]:
        """Return all of it as the store gives it back: 1.0 and 1.00 are one double."""
        derivations = {Triple(node, DERIVED_FROM, name) for node, name in self.made_of.items()}  # type: ignore[arg-type]
        contents = {**self.contents, GRAPH_REASONED: derivations | self.made_by}
        quads = {quad for name, triples in contents.items() for quad in in_graph(triples, name)}
        written = [quad for quad in quads if isinstance(quad.object, Literal)]
        store = Store()
        store.extend(written)
        return quads.difference(written).union(store)


def by_rules(
    ontology: Ontology,
    known: Iterable[Triple],
    closure: Closure | None = None,
    aside: AbstractSet[Triple] = frozenset(),
) -> Conclusions:
    """Return what the rules conclude of what is known, each into a named graph of its own.

    With a closure of it, rules and closure conclude in turn; what is set aside is concluded by neither.
    """

    def close(concluded: set[Triple]) -> Iterable[Triple]:
        if closure is None:
            return ()
        return closure.worth_keeping(after=closure.add(concluded - aside))

    seen = chain(known, closure.worth_keeping() if closure else ())
    concluded = Conclusions(running.conclusions(seen, all_rules(ontology.resources), close)).without(aside)
    if closure is not None:
        concluded.contents[GRAPH_OWL_RL] = closure.worth_keeping()
    return concluded


def infer(ontology: Ontology, premises: set[Triple], aside: AbstractSet[Triple] = frozenset()) -> Conclusions:
    """Conclude from the ontology and some parts of the graph, without what is set aside, whoever says it."""
    asserted = premises - aside
    closure = Closure(ontology.triples | asserted)
    return by_rules(ontology, ontology.triples | asserted, closure, aside)


@dataclass(frozen=True)
class Aside:
    """The asserted statements that nothing is concluded from, and why; none where nothing clashes."""

    statements: frozenset[Triple] = frozenset()
    why: str = ""

    def notes(self, nodes: Iterable[object] = ()) -> set[Triple]:
        """Return what is to be said of whom the statements are about, and of other nodes that stand for these."""
        about = {*nodes, *(triple.subject for triple in self.statements)} if self.statements else ()
        return {Triple(node, CONTRADICTION, Literal(self.why)) for node in about if isinstance(node, NamedNode)}


def contain(
    common: AbstractSet[Triple], premises: AbstractSet[Triple], infer: Callable[[AbstractSet[Triple]], T]
) -> tuple[Aside, T]:
    """Return the statements that clash, and what `infer` concludes without them; it is told what to leave out.

    common: what is not to be doubted, the ontology. Raises Contradiction where nothing else clashes, or where there is
    no end of clashes.
    """
    aside, first = set[Triple](), None
    for _ in range(1 + _MOST_LOOKS):
        try:
            inferred = infer(aside)
        except Contradiction as clash:
            first = first or clash
            clashing = clash.given - common - aside
            if not clashing:
                raise
            aside |= clashing
        else:
            statements = frozenset(aside & premises)
            return (Aside() if first is None else Aside(statements, _in_words(str(first), statements))), inferred
    assert first is not None
    raise first


def _in_words(reason: str, statements: AbstractSet[Triple]) -> str:
    shown = sorted(map(say, statements))
    more = f" and {len(shown) - _MOST_NAMED} more" if len(shown) > _MOST_NAMED else ""
    return f"{reason.partition(': ')[0]}: {'; '.join(shown[:_MOST_NAMED])}{more}; nothing is concluded from these"


def content_name(triples: Iterable[Triple], resources: Resources, engine: str = NATIVE) -> NamedNode:
    """Return the name that triples, the rules and those who run them have by their content."""
    digest = hashlib.sha256(_rules(resources.of("rules") + resources.of("shapes")) + engine.encode())
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
