"""What an R2RML mapping document says (W3C R2RML, sections 4 to 9).

`where` names a part in messages: the file, the triples map and the term map.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from pyoxigraph import Literal, NamedNode

from irtwin.knowledge.mapping.identifiers import Identifier
from irtwin.knowledge.store.by_subject import Node

RR = "http://www.w3.org/ns/r2rml#"

Template = tuple[str | Identifier, ...]  # fixed text and columns


class TermType(Enum):
    """The kind of term that a map makes; the value is its local name in R2RML."""

    IRI = "IRI"
    BLANK_NODE = "BlankNode"
    LITERAL = "Literal"


@dataclass(frozen=True)
class LogicalTable:
    """A table or view by its name, or a query; just one of them is given."""

    where: str
    table: tuple[Identifier, ...] = ()
    query: str | None = None


@dataclass(frozen=True)
class TermMap:
    """How a term is made of a row: a constant, a column or a template; `where` names it in messages."""

    where: str
    term_type: TermType
    constant: NamedNode | Literal | None = None
    column: Identifier | None = None
    template: Template = ()
    datatype: NamedNode | None = None
    language: str | None = None

    @property
    def columns(self) -> tuple[Identifier, ...]:
        """The columns that the term is made of."""
        named = tuple(part for part in self.template if isinstance(part, Identifier))
        return named if self.column is None else (self.column,)


@dataclass(frozen=True)
class Join:
    """The subject of another triples map, of rows where child and parent columns are equal."""

    where: str
    parent: Node
    conditions: tuple[tuple[Identifier, Identifier], ...]


@dataclass(frozen=True)
class PredicateObjectMap:
    """Predicates and objects to combine, in the graphs given here beside the subject's."""

    predicates: tuple[TermMap, ...]
    objects: tuple[TermMap | Join, ...]
    graphs: tuple[TermMap, ...]


@dataclass(frozen=True)
class TriplesMap:
    """What the rows of one logical table become."""

    where: str
    table: LogicalTable
    subject: TermMap
    classes: tuple[NamedNode, ...]
    graphs: tuple[TermMap, ...]
    properties: tuple[PredicateObjectMap, ...]


@dataclass(frozen=True)
class MappingDocument:
    """A mapping document; `base_iri` is the one it declares, if any."""

    base_iri: str | None
    triples_maps: dict[Node, TriplesMap]
