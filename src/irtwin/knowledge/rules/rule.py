"""A rule: what it concludes of all individuals, as one CONSTRUCT, in whatever language it is written."""

from __future__ import annotations

import re
from dataclasses import dataclass
from decimal import Decimal
from urllib.parse import quote

from irtwin.knowledge.store.sparql_text import masked
from irtwin.knowledge.vocabulary import GRAPH_INFERRED

SHACL, SWRL = "SHACL", "SWRL"

_HEAD = re.compile(r"\bCONSTRUCT\s*\{[^}]*\}\s*(?:WHERE\s*)?\{", re.IGNORECASE)


@dataclass(frozen=True)
class Rule:
    """A rule for all individuals: the IRI it is known by, what people call it, when its turn is, and its CONSTRUCT.

    A rule without an IRI is known by its label. `language` is the one that it is written in, SHACL or SWRL.
    """

    name: str
    label: str
    comment: str
    order: tuple[Decimal, Decimal]
    construct: str
    language: str = SHACL

    @property
    def graph(self) -> str:
        """The IRI of the named graph that holds what it concludes."""
        return f"{GRAPH_INFERRED}{self.language.lower()}/{quote(re.split('[/#]', self.name)[-1], safe='')}"


def head_of(construct: str) -> re.Match[str] | None:
    """Return the match of a CONSTRUCT up to what stands within its WHERE { }; None where it is no CONSTRUCT."""
    return _HEAD.search(masked(construct))


def group_of(rule: Rule) -> tuple[str, str]:
    """Return the prologue of a rule's CONSTRUCT, and what stands within its WHERE { }."""
    body = head_of(rule.construct)
    assert body is not None
    return rule.construct[: body.start()], rule.construct[body.end() : masked(rule.construct).rindex("}")]
