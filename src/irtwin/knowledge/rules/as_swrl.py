"""Rules written in SWRL, for Protégé and the reasoners of OWL 2 DL: without built-ins, as HermiT takes none.

`FILTER(?share > ?limit)` becomes the class of all that has some share above the limit, with the limit's value in the
graph, as a class holds no variable. What SWRL has no words for is told with its reason: OPTIONAL, BIND, sums, absence,
arithmetic.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from decimal import Decimal
from itertools import product
from typing import Any, cast

import rdflib
from pyoxigraph import NamedNode, QuerySolutions, RdfFormat, Triple, parse
from rdflib.namespace import OWL, RDF, RDFS, XSD
from rdflib.paths import MulPath, SequencePath

from irtwin.knowledge.rdflib_terms import from_rdflib, to_rdflib
from irtwin.knowledge.rules.conjunction import TURNED, Comparison, NoConjunction, Pattern, conjunction, joined_to
from irtwin.knowledge.rules.rule import Rule
from irtwin.knowledge.rules.swrl import FACETS, NAMESPACE
from irtwin.knowledge.store.by_subject import BySubject
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_ONTOLOGY, PREFIXES, shorten

MOST_VALUES = 10  # of what a rule looks up in all of the graph: each makes a SWRL rule of its own

VARIABLE = "urn:swrl:var#"  # as Protégé calls them

_DOUBLES = (XSD.double, XSD.float)
_WHOLE = (XSD.integer, XSD.int, XSD.long, XSD.nonNegativeInteger, XSD.positiveInteger)
_FACET_OF = {sign: name for name, sign in FACETS.items()}
_PROLOGUE = "".join(f"PREFIX {name}: <{iri}> " for name, iri in (PREFIXES | {"swrl": NAMESPACE}).items())


@dataclass
class Written:
    """Rules in SWRL: `triples`; and those that are none, each with the reason."""

    triples: set[Triple] = field(default_factory=set)
    left_out: list[tuple[Rule, str]] = field(default_factory=list)


def as_swrl(graph: KnowledgeGraph, rules: Iterable[Rule]) -> Written:
    """Write the rules of a graph in SWRL, with the limits that the graph holds."""
    written, model = Written(), _Model(graph)
    for rule in rules:
        try:
            for text in _imps(rule, model):
                written.triples |= triples_of(text)
        except NoConjunction as why:
            written.left_out.append((rule, str(why)))
    return written


class _Model:
    """What the ontology says of properties, and the values that the graph holds."""

    def __init__(self, graph: KnowledgeGraph):
        self._graph = graph
        self._said = BySubject(graph.triples(GRAPH_ONTOLOGY), str(RDFS))

    def is_a(self, term: Any, kind: rdflib.URIRef) -> bool:
        return from_rdflib(kind) in self._said.values(from_rdflib(term), str(RDF.type))

    def range_of(self, predicate: Any) -> rdflib.URIRef:
        named = self._said.value(from_rdflib(predicate), "range")
        return rdflib.URIRef(named.value if isinstance(named, NamedNode) else "")

    def values(self, patterns: list[Pattern]) -> list[dict[str, Any]]:
        """Return what patterns of no individual of the rule match; an empty row where there are no patterns."""
        if not patterns:
            return [{}]
        text = " . ".join(" ".join(term.n3() for term in pattern) for pattern in patterns)
        answer = cast(
            QuerySolutions, self._graph.answer(f"SELECT DISTINCT * WHERE {{ {text} }} LIMIT {MOST_VALUES + 1}")
        )
        names = [variable.value for variable in answer.variables]
        return [dict(zip(names, map(to_rdflib, row), strict=True)) for row in answer]


def _imps(rule: Rule, model: _Model) -> Iterator[str]:
    """Yield a rule in Turtle, once for each value that it looks up in all of the graph and each conclusion.

    SWRL lets a rule conclude several things, but Openllet then draws one of them.
    """
    patterns, comparisons, template = conjunction(rule.construct)
    joined = joined_to(rdflib.Variable("this"), patterns)
    rows = model.values([pattern for pattern in patterns if pattern not in joined])
    own = _without_repeats(joined, [*comparisons, *template])
    if not rows or len(rows) > MOST_VALUES:
        raise NoConjunction(f"what it looks up has {f'more than {MOST_VALUES}' if rows else 'no'} values in the graph")
    for row, conclusion in product(rows, template):
        written = _Imp(model)
        body = written.body(_bound(own, row), _bound(comparisons, row))
        yield written.written(rule, body, written.head(*_bound([conclusion], row)))


def _without_repeats(patterns: list[Pattern], elsewhere: list[Pattern]) -> list[Pattern]:
    """Leave out what asks for any value of a property where another pattern asks for one: it says nothing more.

    Openllet draws nothing from a rule that asks for two unnamed classes of one individual.
    """
    kept = list(patterns)
    for pattern in patterns:
        rest = [other for other in kept if other is not pattern]
        value = pattern[2]
        is_any = isinstance(value, rdflib.Variable) and not any(value in other for other in (*rest, *elsewhere))
        if is_any and any(other[:2] == pattern[:2] for other in rest):
            kept = rest
    return kept


def _bound(patterns: Iterable[Pattern], row: dict[str, Any]) -> list[Pattern]:
    """Put values in the place of variables."""

    def value(term: Any) -> Any:
        return row.get(str(term), term) if isinstance(term, rdflib.Variable) else term

    return [(value(subject), value(predicate), value(object)) for subject, predicate, object in patterns]


class _Imp:
    """One SWRL rule in the making, in Turtle."""

    def __init__(self, model: _Model):
        self._model = model
        self._variables = set[str]()

    def body(self, patterns: list[Pattern], comparisons: list[Comparison]) -> list[str]:
        """Return the atoms of patterns, each with what its value is compared to."""
        values = [object for _, predicate, object in patterns if self._model.is_a(predicate, OWL.DatatypeProperty)]
        limits: dict[Any, list[tuple[str, rdflib.Literal]]] = {}
        for left, sign, right in comparisons:
            value, sign, limit = (
                (right, TURNED[sign], left) if isinstance(left, rdflib.Literal) else (left, sign, right)
            )
            if value not in values or not isinstance(limit, rdflib.Literal):
                raise NoConjunction("it compares two values, and HermiT takes no built-ins")
            limits.setdefault(value, []).append((sign, limit))
        for value in values:
            if isinstance(value, rdflib.Variable) and sum(value in pattern for pattern in patterns) > 1:
                raise NoConjunction("it looks for one value twice, and no class does")
        return [self._atom(pattern, limits) for pattern in patterns]

    def head(self, pattern: Pattern) -> str:
        """Return the atom of what a rule concludes: a class or link of individuals that it knows."""
        subject, predicate, object = pattern
        variables = {str(term) for term in (subject, object) if isinstance(term, rdflib.Variable)}
        is_link = predicate == RDF.type or self._model.is_a(predicate, OWL.ObjectProperty)
        if not (is_link and variables <= self._variables):
            raise NoConjunction("it concludes values, or what has no name before")
        return self._atom(pattern, {})

    def written(self, rule: Rule, body: list[str], head: str) -> str:
        """Return the rule with its label and comment."""
        comment = f"rdfs:comment {rdflib.Literal(rule.comment, lang='en').n3()} ; " if rule.comment else ""
        return imp(rule.label, self._variables, body, head, comment)

    def _atom(self, pattern: Pattern, limits: dict[Any, list[tuple[str, rdflib.Literal]]]) -> str:
        subject, predicate, object = pattern
        if _is_type(predicate) and isinstance(object, rdflib.URIRef):
            return class_atom(self._term(subject), object.n3())
        if self._model.is_a(predicate, OWL.ObjectProperty):
            return link_atom(self._term(subject), predicate.n3(), self._term(object))
        if not self._model.is_a(predicate, OWL.DatatypeProperty):
            name = shorten(str(predicate)) if isinstance(predicate, rdflib.URIRef) else "a path"
            raise NoConjunction(f"{name} is no property of individuals or of data in OWL")
        if isinstance(object, rdflib.Literal):
            values = f"owl:hasValue {object.n3()}"
        else:
            values = f"owl:someValuesFrom {self._range(predicate, limits.get(object, []))}"
        return class_atom(self._term(subject), f"[ a owl:Restriction ; owl:onProperty {predicate.n3()} ; {values} ]")

    def _range(self, predicate: Any, limits: list[tuple[str, rdflib.Literal]]) -> str:
        """Return the values of a property's datatype within limits."""
        if not limits:
            return "rdfs:Literal"
        datatype, facets = self._model.range_of(predicate), ""
        for sign, limit in limits:
            datatype, value = _comparable(datatype, limit)
            facets += f"[ xsd:{_FACET_OF[sign]} {value.n3()} ] "
        return f"[ a rdfs:Datatype ; owl:onDatatype {datatype.n3()} ; owl:withRestrictions ( {facets}) ]"

    def _term(self, term: Any) -> str:
        if isinstance(term, rdflib.Variable):
            self._variables.add(str(term))
            return f"<{VARIABLE}{term}>"
        if isinstance(term, rdflib.URIRef):
            return term.n3()
        raise NoConjunction("it speaks of an individual without a name")


def imp(label: str, variables: Iterable[str], body: list[str], head: str, more: str = "") -> str:
    """Return a rule in Turtle, as all below."""
    declared = "".join(f"<{VARIABLE}{name}> a swrl:Variable . " for name in variables)
    words = f"rdfs:label {rdflib.Literal(label, lang='en').n3()} ; {more}"
    return f"{declared}[] a swrl:Imp ; {words}swrl:body {_atoms(body)} ; swrl:head {_atoms([head])} ."


def class_atom(subject: str, kind: str) -> str:
    """Return the atom of a member of a class."""
    return f"[ a swrl:ClassAtom ; swrl:classPredicate {kind} ; swrl:argument1 {subject} ]"


def link_atom(subject: str, predicate: str, object: str) -> str:
    """Return the atom of two individuals that a property joins."""
    ends = f"swrl:argument1 {subject} ; swrl:argument2 {object}"
    return f"[ a swrl:IndividualPropertyAtom ; swrl:propertyPredicate {predicate} ; {ends} ]"


def triples_of(text: str) -> set[Triple]:
    """Return a rule's triples."""
    return {quad.triple for quad in parse(_PROLOGUE + text, format=RdfFormat.TURTLE)}


def _atoms(atoms: list[str]) -> str:
    """Return a list of atoms, each cell of which says that it is one."""
    if not atoms:
        return "rdf:nil"
    return f"[ a swrl:AtomList ; rdf:first {atoms[0]} ; rdf:rest {_atoms(atoms[1:])} ]"


def _is_type(predicate: Any) -> bool:
    """Whether a predicate is rdf:type, or that of a class or one below it, as SHACL's targets are written."""
    if isinstance(predicate, SequencePath):
        first, *rest = predicate.args
        return first == RDF.type and all(isinstance(step, MulPath) and step.path == RDFS.subClassOf for step in rest)
    return bool(predicate == RDF.type)


def _comparable(datatype: rdflib.URIRef, limit: rdflib.Literal) -> tuple[rdflib.URIRef, rdflib.Literal]:
    """Return the datatype and limit that OWL compares as SPARQL does: of numbers, doubles are apart from the others."""
    if datatype in _DOUBLES:
        return datatype, rdflib.Literal(str(float(limit)), datatype=datatype, normalize=False)
    if datatype in (*_WHOLE, XSD.decimal):
        return XSD.decimal, rdflib.Literal(f"{Decimal(str(limit)):f}", datatype=XSD.decimal, normalize=False)
    if datatype == XSD.dateTime == limit.datatype:
        return datatype, limit
    raise NoConjunction(f"no data range compares {shorten(str(datatype)) or 'values of no datatype'} with {limit.n3()}")
