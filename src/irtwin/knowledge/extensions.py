"""What extends a workspace is looked through before it is used: each fault is one line with file and line."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import rdflib
from pyoxigraph import NamedNode, Store
from pyshacl.entrypoints import meta_validate
from rdflib.namespace import SH
from sqlalchemy import Engine

from irtwin.errors import InputError
from irtwin.input_file import read_text
from irtwin.knowledge.mapping.document import TermMap, TriplesMap
from irtwin.knowledge.mapping.processor import planned
from irtwin.knowledge.mapping.reader import read_document
from irtwin.knowledge.questions.queries import read_question
from irtwin.knowledge.rules import swrl
from irtwin.knowledge.rules.conjunction import algebra
from irtwin.knowledge.rules.files import read_rules
from irtwin.knowledge.rules.rule import SHACL, Rule
from irtwin.knowledge.store.keywords import refuse_service
from irtwin.knowledge.store.rdf_input import read_turtle
from irtwin.knowledge.store.readable import NOT_READABLE, is_readable
from irtwin.knowledge.store.syntax_error import in_words
from irtwin.knowledge.vocabulary import GRAPH_ACTIVITY, GRAPH_SOURCE, ID, OWL, PREFIXES, shorten
from irtwin.knowledge.vocabulary import SH as SHACL_TERMS
from irtwin.resources import MOST_BYTES, Files, Resource, Resources

_TEXTS = (SH.select, SH.ask, SH.construct)
_NAMES_A_TERM = [swrl.NAMESPACE + name for name in ("classPredicate", "propertyPredicate")]
_LONGEST = 60.0  # s that a look at the columns of a mapping's SQL may take
_AT = re.compile(r"error at (\d+):(\d+): (.*)", re.DOTALL)


@lru_cache(maxsize=16)
def check(resources: Resources) -> None:
    """Raise InputError for the first fault of a file that does not ship; mappings are held to tables elsewhere."""
    for file in resources.extensions:
        if file.kind in _CHECKS:
            _CHECKS[file.kind](file)
    if any(file.is_extension for file in resources.of("rules")):
        _check_names(resources.of("rules"))
        _check_terms(resources)


def check_mappings(resources: Resources, engine: Engine) -> None:
    """Raise InputError for a mapping that does not ship and is no R2RML, or does not fit the tables."""
    for file in resources.of("mappings"):
        if file.is_extension:
            _check_mapping(file, engine)


def sparql_fault(text: str) -> tuple[int, str] | None:
    """Return line and words of what is wrong with a query, which may read this graph alone; None where nothing is."""
    if not is_readable(text, ID):
        return 1, f"column 1: the query {NOT_READABLE}"
    try:
        Store().query(text, base_iri=ID, prefixes=PREFIXES)
    except SyntaxError as error:
        match = _AT.fullmatch(in_words(error, text))
        return (int(match[1]), f"column {match[2]}: {match[3]}") if match else (1, str(error))
    except RuntimeError:
        pass  # a function that only the workspace's store has
    try:
        refuse_service(text, ID)
    except InputError:
        lines = enumerate(text.splitlines(), 1)
        matches = ((line, match) for line, content in lines if (match := re.search("service", content, re.IGNORECASE)))
        line, match = next(matches)
        return line, f"column {match.start() + 1}: SERVICE asks another server, which is not allowed here"
    return None


def _check_ontology(file: Resource) -> None:
    for _ in read_turtle(file.path):
        pass


def _check_rules(file: Resource) -> None:
    try:
        rules = read_rules(file.path)
    except InputError as error:
        raise InputError(_with_line(file, str(error))) from error
    if not rules:
        is_swrl = file.name.endswith(".swrl.ttl")
        lacking = "swrl:Imp; a rule is one" if is_swrl else "sh:rule; constraints belong into shapes/"
        raise InputError(f"{file.path}: has no {lacking}")
    for rule in rules:
        _check_rule(file, rule)


def _check_rule(file: Resource, rule: Rule) -> None:
    if rule.language == SHACL and not rule.name.startswith(("http:", "https:", "urn:")):
        raise InputError(f"{file.path}: a rule has no IRI; give its shape one, for conclusions to name it")

    def fault(problem: str) -> InputError:
        return _fault_at(file, _end(rule.name), f"the rule {rule.label!r} {problem}")

    wrong = sparql_fault(rule.construct)
    if wrong is not None:
        raise fault(f"is no SPARQL: {wrong[1].partition(': ')[2]}")
    query = algebra(rule.construct)
    made = {term for pattern in query.template for term in pattern}
    if any(isinstance(term, rdflib.BNode) for term in made):
        raise fault("concludes blank nodes, anew each time: use IRIs")
    free = sorted(str(term) for term in made if isinstance(term, rdflib.Variable) and term not in query.p["_vars"])
    if free:
        raise fault(f"concludes ?{free[0]}, which its WHERE does not bind")


def _check_names(files: Files) -> None:
    """What a rule concludes is kept in a graph that has the end of its name."""
    known: dict[str, tuple[Resource, str]] = {}
    for file in files:
        for rule in read_rules(file.path):
            other, name = known.setdefault(rule.graph, (file, rule.name))
            if (other, name) != (file, rule.name):
                extension = file if file.is_extension else other
                both = f"{other} and {file} both have a rule called {_end(name)}; call it otherwise"
                raise _fault_at(extension, _end(name), both)


def _check_terms(resources: Resources) -> None:
    """A name in SWRL that no module declares is misspelt: no tool of OWL knows what it is."""
    declared: set[Any] = set()
    kinds = {NamedNode(OWL + kind) for kind in ("Class", "ObjectProperty", "DatatypeProperty")}
    for module in resources.of("ontology"):
        declared |= {triple.subject for triple in read_turtle(module.path) if triple.object in kinds}
    for file in resources.of("rules", ".swrl.ttl"):
        for triple in read_turtle(file.path) if file.is_extension else ():
            names = triple.predicate.value in _NAMES_A_TERM
            if names and isinstance(triple.object, NamedNode) and triple.object not in declared:
                iri = triple.object.value
                raise _fault_at(file, _end(iri), f"no module of the ontology declares {shorten(iri)}")


def _check_shapes(file: Resource) -> None:
    for _ in read_turtle(file.path):  # says the line, where rdflib does not
        pass
    shapes = rdflib.Graph().parse(file.path)
    if not {SH.NodeShape, SH.PropertyShape} & set(shapes.objects(None, rdflib.RDF.type)):
        raise InputError(f"{file.path}: has no sh:NodeShape; a constraint is one")
    for term in sorted(map(str, {*shapes.predicates(), *shapes.objects(None, rdflib.RDF.type)})):
        if term.startswith(SHACL_TERMS) and _end(term) not in SH:
            raise _fault_at(file, f"sh:{_end(term)}", f"sh:{_end(term)} is no term of SHACL; correct it")
    for kind in _TEXTS:
        for text in map(str, shapes.objects(None, kind)):
            fault = sparql_fault(_prefixed(shapes, text).replace("$PATH", "rdf:type"))
            if fault is not None:
                raise _fault_at(file, text, f"its SPARQL is none: {fault[1]}")
    conforms, report, _ = meta_validate(shapes)
    if not conforms:
        raise _shape_fault(file, shapes, report)


def _shape_fault(file: Resource, shapes: rdflib.Graph, report: rdflib.Graph) -> InputError:
    """Return which rule of SHACL's own a shape breaks, and on which line."""
    faults = [
        tuple(report.value(result, SH[name]) for name in ("resultPath", "value", "resultMessage", "focusNode"))
        for result in report.objects(None, SH.result)
    ]
    path, value, message, node = min(faults, key=lambda fault: (fault[0] is None, str(fault)))
    while isinstance(node, rdflib.BNode) and (above := next(shapes.subjects(None, node), None)) is not None:
        node = above
    written = f"sh:{_end(str(path))}" if isinstance(value, rdflib.Literal) else _end(str(node))
    words = str(message).split("[")[0].strip() if path is not None else "is no node shape and no property shape"
    return _fault_at(file, written, f"not well-formed SHACL: {f'sh:{_end(str(path))}: ' if path else ''}{words}")


def _check_mapping(file: Resource, engine: Engine) -> None:
    try:
        for triples_map in read_document(file.path).triples_maps.values():
            _check_graphs(file, triples_map)
            _check_base(triples_map)
        with planned(engine, [file.path], seconds=_LONGEST):
            pass
    except InputError as error:
        raise InputError(_with_line(file, str(error))) from error


def _check_graphs(file: Resource, triples_map: TriplesMap) -> None:
    """Only graphs of sources and of activities are the mapping's: others would be written over."""
    for graph in (*triples_map.graphs, *(graph for own in triples_map.properties for graph in own.graphs)):
        if not _start(graph).startswith((GRAPH_SOURCE, GRAPH_ACTIVITY)):
            raise InputError(
                f"{triples_map.where}: its graph is none of a mapping; begin its IRI with {GRAPH_SOURCE} "
                f"or {GRAPH_ACTIVITY}"
            )
    if not triples_map.graphs:
        raise InputError(
            f"{triples_map.where}: has no rr:graphMap; name {GRAPH_SOURCE}{file.path.name.partition('.')[0]}, "
            f"or {GRAPH_ACTIVITY}{{activity_id}} for rows that a provider made"
        )


def _check_base(triples_map: TriplesMap) -> None:
    """Individuals lie below the workspace's base, whatever it is."""
    for term in (triples_map.subject, *(value for pair in triples_map.properties for value in pair.objects)):
        if isinstance(term, TermMap) and _start(term).startswith(ID):
            raise InputError(
                f"{term.where}: individuals lie below the workspace's base, which may be another: leave out {ID}"
            )


def _start(graph: TermMap) -> str:
    if graph.constant is not None:
        return graph.constant.value
    first = graph.template[0] if graph.template else ""
    return first if isinstance(first, str) else ""


def _check_question(file: Resource) -> None:
    question = read_question(file.path)
    fault = sparql_fault(question.text)
    if fault is not None:
        raise InputError(f"{file.path}, line {fault[0]}, {fault[1]}")
    if question.of_robot and not re.search(r"[?$]arm\b", question.text):
        raise InputError(f"{file.path}: says `# of: robot`, and has no variable ?arm for the robot")


_CHECKS: dict[str, Callable[[Resource], None]] = {
    "ontology": _check_ontology,
    "rules": _check_rules,
    "shapes": _check_shapes,
    "questions": _check_question,
}


def _prefixed(shapes: rdflib.Graph, text: str) -> str:
    undeclared = [
        (shapes.value(declaration, SH.prefix), shapes.value(declaration, SH.namespace))
        for declaration in shapes.objects(None, SH.declare)
    ]
    return "".join(f"PREFIX {prefix}: <{space}>\n" for prefix, space in undeclared) + text


def _with_line(file: Resource, message: str) -> str:
    """Put a line beside the file that a message begins with: that where the node it names first stands."""
    rest = message.removeprefix(str(file.path))
    if not rest.startswith((":", " ")) or re.match(r", line ", rest):
        return message if message.startswith(str(file.path)) else f"{file.path}: {message}"
    named = re.match(r": the rule '(.+?)' ", rest) or re.search(r"[#/:<]([\w-]+)>?(?=[:, ])", rest)
    line = _line_of(file, named[1]) if named else 1
    return f"{file.path}, line {line}{rest}"


def _fault_at(file: Resource, near: str, problem: str) -> InputError:
    """Return the error of what stands near a text."""
    return InputError(f"{file.path}, line {_line_of(file, near)}: {problem}")


def _line_of(file: Resource, text: str) -> int:
    """Return the line on which a text first stands, by its own first line; 1 where it does not."""
    wanted = next((line.strip() for line in text.splitlines() if line.strip()), "")
    lines = list(enumerate(read_text(file.path, MOST_BYTES).splitlines(), 1))
    as_name = re.compile(rf"[:#/]{re.escape(wanted)}\b") if re.fullmatch(r"[\w-]+", wanted) else re.compile("$^")
    numbers = [number for number, line in lines if as_name.search(line)] or [n for n, line in lines if wanted in line]
    return numbers[0] if wanted and numbers else 1


def _end(iri: str) -> str:
    return re.split("[/#]", iri.strip("<>"))[-1]
