"""A contradiction, contained: the statements that clash are set aside, and all else is concluded from.

Of the statements that clash none is known to be the wrong one, so all of them are set aside: two payloads of one run,
and not its robot. What rules conclude into a clash is set aside likewise.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from typing import TypeVar

from pyoxigraph import Literal, NamedNode, Triple

from irtwin.knowledge.owl_rl.closure import Contradiction, say
from irtwin.knowledge.vocabulary import term

T = TypeVar("T")
CONTRADICTION = NamedNode(term("Contradiction"))
_MOST_LOOKS = 30  # each finds many clashes of one kind
_MOST_NAMED = 3  # statements, in words


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
