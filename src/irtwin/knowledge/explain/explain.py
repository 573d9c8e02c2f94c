"""From a triple back to what it was made of: rule, mapping or provider, facts, runs, files and checksums."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property, lru_cache
from typing import cast

from pyoxigraph import BlankNode, Literal, NamedNode, QueryTriples, Store, Triple

from irtwin.errors import InputError
from irtwin.knowledge.engines import HERMIT
from irtwin.knowledge.explain import provenance
from irtwin.knowledge.explain.explanation import LEFT_OUT, Explanation
from irtwin.knowledge.explain.mapping import says
from irtwin.knowledge.explain.rules import MOST_TAKEN, premises
from irtwin.knowledge.owl_rl.closure import Closure, Statement, say
from irtwin.knowledge.parts import Ontology
from irtwin.knowledge.reasoning import around, engine_of, not_closed
from irtwin.knowledge.rules.files import all_rules
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.named_graphs import in_graph
from irtwin.knowledge.store.ontology import ELECTRICITY, LIMIT_VALUE, SOURCE
from irtwin.knowledge.store.rdf_input import read_turtle
from irtwin.knowledge.store.table import Row
from irtwin.knowledge.vocabulary import (
    GRAPH_ACTIVITY,
    GRAPH_INFERRED,
    GRAPH_ONTOLOGY,
    GRAPH_OWL_RL,
    GRAPH_SOURCE,
    shorten,
)
from irtwin.resources import Files
from irtwin.storage.tariff import FILE

MOST_TRIPLES = 100
HOPS = 2  # from a statement's terms, before all of the graph is searched for its premises

_QUOTED = r"""(?P<quoted>"(?:[^"\\]|\\.)*"|'(?:[^'\\]|\\.)*')(?:\^\^(?P<datatype>\S+)|(?P<language>@[\w-]+))?"""
_LITERAL = re.compile(_QUOTED, re.DOTALL)
_TERM = re.compile(rf"{_QUOTED}|<[^<>\s]*>|\S+", re.DOTALL)
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_WILDCARDS = {"?", "*", "_"}
_ABOVE = "what is said above"
_RECORDED, _PLANNED = "what was recorded", "what was planned"


def explain(graph: KnowledgeGraph, pattern: str) -> tuple[Explanation, ...]:
    """Explain each triple that fits a pattern: subject, predicate, object.

    Terms are IRIs, prefixed names or literals as Turtle writes them; `?` or nothing stands for anything. InputError
    where the pattern is none, or fits no triple of the graph, or more than MOST_TRIPLES.
    """
    triples = _matching(graph, pattern)
    if not triples:
        raise InputError(f"the graph has no triple {pattern}; see what it has with `irtwin query`")
    if len(triples) > MOST_TRIPLES:
        raise InputError(f"more than {MOST_TRIPLES} triples fit {pattern}: be more specific")
    explainer = Explainer(graph)
    return tuple(map(explainer.anew, sorted(triples, key=str)))


class Explainer:
    """Explains triples of one graph. What it has explained once it refers to after that, unless it begins anew."""

    def __init__(self, graph: KnowledgeGraph):
        self._graph = graph
        self._told: set[object] = set()
        self._near: set[Triple] = set()
        self._has_whole = False

    def of_iris(self, subject: str, predicate: str, object: str) -> Explanation | None:
        """Explain a triple of IRIs anew; None where the graph does not hold it."""
        triple = Triple(NamedNode(subject), NamedNode(predicate), NamedNode(object))
        return self.anew(triple) if self._graph.holds(triple) else None

    def anew(self, triple: Triple) -> Explanation:
        """Explain a triple without reference to what was explained before."""
        self._told.clear()
        return self.triple(triple)

    def triple(self, triple: Triple) -> Explanation:
        """Explain a triple that the graph holds."""
        statement = self._say(triple)
        if triple in self._told:
            return Explanation(statement, _ABOVE)
        self._told.add(triple)
        graphs = sorted(self._graph.graphs_with(triple))
        stated = [name for name in graphs if not name.startswith(GRAPH_INFERRED)]
        if stated:
            return self._stated(triple, stated[0])
        for rule in all_rules(self._graph.resources):
            grounds = premises(self._graph, rule, triple) if rule.graph in graphs else None
            if grounds is not None:
                facts, are_all = grounds
                by = f'the rule "{rule.label}", in {rule.language}'
                return Explanation(statement, by, self._each(facts, are_all), rule.comment or None)
        return self._inferred(tuple(triple))

    def individual(self, iri: str) -> Explanation:
        """Explain an individual: the activities that made it, what they used, and the file that it is."""
        name = shorten(iri, self._graph.base)
        if iri in self._told:
            return Explanation(name, _ABOVE)
        self._told.add(iri)
        makers = provenance.makers(self._graph, iri)
        used = [thing for maker in makers for thing in provenance.used_by(self._graph, maker["activity"])]
        return Explanation(
            name,
            " and ".join(map(_maker, makers)) or self._known_from(iri),
            (*map(self.individual, dict.fromkeys(used)), *self._runs_recorded_as(iri)),
            **provenance.file_of(self._graph, iri),
        )

    def _runs_recorded_as(self, series: str) -> Iterator[Explanation]:
        """Name the run that samples were read from, and its own file."""
        for run in provenance.recorded_of(self._graph, series):
            if run in self._told:
                continue
            name, file = shorten(run, self._graph.base), provenance.file_of(self._graph, run)
            yield Explanation(name, self._known_from(run), **file)

    def _known_from(self, run: str) -> str:
        return _PLANNED if provenance.is_planned(self._graph, run) else _RECORDED

    def _stated(self, triple: Triple, name: str) -> Explanation:
        statement = self._say(triple)
        if name.startswith(GRAPH_ACTIVITY):
            activity = self._graph.iri(f"activity/{name.removeprefix(GRAPH_ACTIVITY)}")
            used = tuple(map(self.individual, provenance.used_by(self._graph, activity)))
            return Explanation(statement, _maker(provenance.activity(self._graph, activity)), used)
        fact = provenance.asserted(self._graph, triple)
        if fact is not None:
            return Explanation(statement, fact)
        if name.startswith(GRAPH_SOURCE):
            near = self._file_near(triple)
            maker = says(triple, self._graph.resources.of("mappings"), self._graph.base) or "a mapping"
            if parts := provenance.parts_of_total(self._graph, triple, MOST_TAKEN + 1):
                return Explanation(statement, maker, self._each(parts[:MOST_TAKEN], len(parts) <= MOST_TAKEN))
            subject = triple.subject.value if isinstance(triple.subject, NamedNode) else None
            behind = provenance.behind(self._graph, subject) if not near and subject is not None else []
            return Explanation(statement, maker, tuple(map(self.individual, behind)), **near)
        if name == GRAPH_ONTOLOGY:
            module = _module(triple, self._graph.resources.of("ontology"))
            unnamed = triple.subject if isinstance(triple.subject, BlankNode) else None
            if module is None and triple.subject == ELECTRICITY:
                return Explanation(statement, "the plant's tariff", file=FILE)
            if module is None and str(triple.subject).startswith(f"<{self._graph.iri('plant/')}"):
                return Explanation(statement, "the plant", file=FILE)
            if module is None and unnamed is None and triple.predicate == SOURCE:
                values = self._graph.store.said(triple.subject, LIMIT_VALUE)
                return Explanation(statement, "who set the limit", tuple(self.triple(quad.triple) for quad in values))
            leading = [axiom for axiom in Ontology.of(self._graph).triples if unnamed and axiom.object == unnamed]
            return Explanation(statement, "the ontology", tuple(map(self.triple, leading)), file=module)
        return Explanation(statement, f"what was written into {shorten(name)}")

    def _each(self, facts: list[Triple], are_all: bool) -> tuple[Explanation, ...]:
        rest = () if are_all else (Explanation(f"more than {MOST_TAKEN} that were summed or compared", LEFT_OUT),)
        return (*map(self.triple, facts), *rest)

    def _inferred(self, statement: Statement) -> Explanation:
        """Explain what OWL 2 RL inferred; steps that are the rules' own way to walk a list are left out."""
        for closure in self._growing(statement):
            derivation = closure.why(statement)
            if derivation is not None:
                premises = _without_helpers(closure, derivation.premises)
                return Explanation(
                    self._say(statement),
                    f"OWL 2 RL, rule {derivation.rule}",
                    tuple(map(self._premise, premises)),
                )
        if self._is_of_hermit(statement):
            return Explanation(self._say(statement), "OWL 2 DL, by HermiT: no rule of OWL 2 RL concludes it")
        return Explanation(self._say(statement), "OWL 2 RL: so it is with everything")

    def _is_of_hermit(self, statement: Statement) -> bool:
        subject, predicate, object = statement
        if isinstance(subject, Literal) or not isinstance(predicate, NamedNode):
            return False
        kept_in = self._graph.graphs_with(Triple(subject, predicate, object))
        return GRAPH_OWL_RL in kept_in and engine_of(self._graph) == HERMIT

    @cached_property
    def _closure(self) -> Closure:
        return Ontology.of(self._graph).schema.closure.copy()

    def _growing(self, statement: Statement) -> Iterator[Closure]:
        """Yield the closure: as it is, with more and more of the graph around a statement's terms, then with all."""
        yield self._closure
        nodes = {term for term in statement if isinstance(term, NamedNode)}
        for _ in range(0 if self._has_whole else HOPS):
            near = around(self._graph, nodes)
            if near - self._near:
                self._near |= near
                self._closure.add(near)
                yield self._closure
            terms = (term for triple in near for term in triple if isinstance(term, NamedNode))
            nodes = {term for term in terms if term.value.startswith(self._graph.base)}
        if not self._has_whole:
            self._closure.add(not_closed(self._graph))
            self._has_whole = True
            yield self._closure

    def _premise(self, statement: Statement) -> Explanation:
        if statement in self._told:
            return Explanation(self._say(statement), _ABOVE)
        subject, predicate, object = statement
        if not isinstance(subject, Literal) and isinstance(predicate, NamedNode):
            triple = Triple(subject, predicate, object)
            if self._graph.holds(triple):
                return self.triple(triple)
        self._told.add(statement)
        return self._inferred(statement)

    def _say(self, statement: Triple | Statement) -> str:
        return say(statement, self._graph.base)

    def _file_near(self, triple: Triple) -> Row:
        """Return the file that says a triple: a data set's, or else that of the subject, or of the object."""
        told: Row = {}
        if isinstance(triple.subject, NamedNode):
            told = provenance.told_in(self._graph, triple.subject.value, triple.predicate.value)
        ends = (term.value for term in (triple.subject, triple.object) if isinstance(term, NamedNode))
        return told or next(filter(None, (provenance.file_of(self._graph, end) for end in ends)), {})


def _without_helpers(closure: Closure, statements: Iterable[Statement]) -> list[Statement]:
    """Return the statements, and for those that rules make for themselves what they were made of."""
    kept: dict[Statement, None] = {}
    for statement in statements:
        if closure.is_helper(statement):
            derivation = closure.why(statement)
            kept |= dict.fromkeys(_without_helpers(closure, derivation.premises) if derivation else ())
        else:
            kept[statement] = None
    return list(kept)


def _matching(graph: KnowledgeGraph, pattern: str) -> list[Triple]:
    parts = [match[0] for match in _TERM.finditer(pattern.removesuffix(" ."))]
    if len(parts) > 3:
        raise InputError(f"{pattern}: is more than subject, predicate and object; put text in quotation marks")
    numbers = {place: term for place, term in enumerate(parts) if _NUMBER.fullmatch(term)}
    terms = [
        f"?_{place}" if place in numbers else _sparql(term, f"?_{place}", graph.prefixes)
        for place, term in enumerate(parts)
    ]
    terms += [f"?_{place}" for place in range(len(terms), 3)]
    text = " ".join(terms)
    equal = " ".join(f"FILTER(?_{place} = {number})" for place, number in numbers.items())  # whatever its datatype
    unnamed = {place: term for place, term in enumerate(parts) if term.startswith("_:")}
    equal += "".join(f" FILTER(isBlank(?_{place}))" for place in unnamed)  # SPARQL has no way to say which
    limit = "" if unnamed else f"LIMIT {MOST_TRIPLES + 1}"
    matching = list(cast(QueryTriples, graph.answer(f"CONSTRUCT {{ {text} }} WHERE {{ {text} {equal} }} {limit}")))
    named_so = [
        triple for triple in matching if all(str(tuple(triple)[place]) == term for place, term in unnamed.items())
    ]
    return named_so or matching


def _sparql(term: str, variable: str, prefixes: Mapping[str, str]) -> str:
    if term in _WILDCARDS or term.startswith(("?", "_:")):
        return variable
    literal = _LITERAL.fullmatch(term)
    if literal is not None:
        quoted = literal["quoted"].replace("\n", "\\n").replace("\r", "\\r")
        datatype = literal["datatype"]
        return (
            f"{quoted}^^{_sparql(datatype, variable, prefixes)}" if datatype else f"{quoted}{literal['language'] or ''}"
        )
    prefix, colon, name = term.partition(":")
    if colon and prefix in prefixes:
        return f"<{prefixes[prefix]}{name}>"
    return f"<{term}>" if name.startswith("//") and not term.startswith("<") else term


def _maker(maker: dict[str, object]) -> str:
    """Return a provider's activity in words."""
    when = f", finished {maker['finished']:%Y-%m-%d %H:%M:%S %Z}".rstrip() if maker.get("finished") else ""
    software = f" of {maker['software']}" if maker.get("software") else ""
    return f"{shorten(str(maker.get('provider') or maker['activity']))}{software}{when}"


def _module(triple: Triple, files: Files) -> str | None:
    """Return the module of the ontology that says a triple; None of a subject without a name."""
    if isinstance(triple.subject, BlankNode):
        return None
    object = None if isinstance(triple.object, BlankNode) else triple.object
    matches = (
        (name, module.quads_for_pattern(triple.subject, triple.predicate, object)) for name, module in _modules(files)
    )
    return next((name for name, quads in matches if any(quads)), None)


@lru_cache(maxsize=16)
def _modules(files: Files) -> tuple[tuple[str, Store], ...]:
    """Return the modules of the ontology, their literals in the form that the graph gives back."""
    modules = []
    for file in files:
        module = Store()
        module.extend(in_graph(read_turtle(file.path)))
        modules.append((str(file), module))
    return tuple(modules)
