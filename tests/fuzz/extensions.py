"""What extends a workspace, as somebody who means ill or knows no better may have written it."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
from tests.fuzz.values import some

_TURTLE = """@prefix irt: <https://w3id.org/irtwin#> . @prefix sh: <http://www.w3.org/ns/shacl#> .
@prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> . @prefix owl: <http://www.w3.org/2002/07/owl#> .
@prefix rr: <http://www.w3.org/ns/r2rml#> . @prefix xsd: <http://www.w3.org/2001/XMLSchema#> . @prefix : <urn:mine#> .
@prefix swrl: <http://www.w3.org/2003/11/swrl#> .
"""
_REST = "http://www.w3.org/1999/02/22-rdf-syntax-ns#rest"
_LOOPS = "".join(f"{{% for {name} in range(99999) %}}" for name in "abc") + "{% endfor %}" * 3
_TEMPLATES = (
    *(_LOOPS, '{{ "x" * 999999999 }}', '{{ ("x" * 99999) * 99999 }}', "{{ 9**9**9 }}", '{{ "%999999999d" % 1 }}'),
    *('{{ "{:>999999999}".format(1) }}', '{{ "{0.__class__.__mro__}".format(1) }}', "{{ range(10**12) | list }}"),
    *("{{ ''.__class__.__mro__[1].__subclasses__() }}", "{{ cycler.__init__.__globals__.os.popen('id').read() }}"),
    *("{{ self.__init__ }}", '{% include "../../../secret.html.jinja" %}', '{% include "OUTSIDE/secret.html.jinja" %}'),
    *('{% include "/etc/passwd" %}', '{% extends "energy/page.html.jinja" %}'),
    *('{% include "energy/page.html.jinja" %}', "{% macro m() %}{{ m() }}{% endmacro %}{{ m() }}", "{{ nobody }}"),
    *("{{ 1 / 0 }}", "{% if", "{{", "", "\0", "\ud800", "{{ 'x' | attr('__class__') }}"),
    *("{{ [1] | map('nothing') | list }}", "{% import 'energy/mine.html.jinja' as m %}", "{{ 'a' | center(10**10) }}"),
    *("{" * 3000, "{{ " + "(" * 3000 + " }}", "{% set x = 'x' %}" * 3000, "<html>{{ robot }}"),
)
_QUERY = "PREFIX irt: <https://w3id.org/irtwin#>\n"
_HEAD = "# title: Mine\n# question: What?\n# theme: run\n# of: plant\n"
_QUESTIONS = (
    _HEAD + _QUERY + "SELECT ?a { ?a ?b ?c . ?d ?e ?f . ?g ?h ?i . ?j ?k ?l } ORDER BY ?l",
    _HEAD + _QUERY + "SELECT (COUNT(*) AS ?n) { ?a (irt:x|!irt:x)* ?b }",
    _HEAD + _QUERY + "SELECT (GROUP_CONCAT(?t) AS ?n) { ?a ?b ?c . ?d ?e ?f . BIND(STR(?f) AS ?t) }",
    _HEAD + _QUERY + 'SELECT ?a { ?a ?b ?c FILTER(REGEX(STR(?c), "(a+)+$")) } LIMIT 3',
    _HEAD + "SELECT * { SERVICE <http://127.0.0.1:1/> { ?a ?b ?c } }",
    _HEAD + "INSERT DATA { <urn:a> <urn:b> <urn:c> }",
    _HEAD + "SELECT ?a FROM <file:///etc/passwd> { ?a ?b ?c }",
    _HEAD + "LOAD <file:///etc/passwd>",
    _HEAD.replace("plant", "robot") + "SELECT ?a { ?a ?b ?c } LIMIT 2",
    _HEAD.replace("Mine", "x" * 5000) + "SELECT ?a { ?a ?b ?c } LIMIT 2",
    _HEAD.replace("run", "\x1b[31m") + "CONSTRUCT { ?a ?b ?c } WHERE { ?a ?b ?c } LIMIT 2",
    _HEAD + "ASK { ?a ?b ?c }",
    _HEAD + "SELECT ?a { " + "{" * 3000,
    _HEAD + 'SELECT (1/0 AS ?x) ("NaN"^^<http://www.w3.org/2001/XMLSchema#double> AS ?y) {}',
    *("# bind: robot, x\nSELECT ?a { ?a ?b ?c } LIMIT 1", "", "\0", "SELECT", "#" * 99999),
    "SELECT ?a { ?a ?b ?c } LIMIT 2",
)
_CONSTRUCT = _TURTLE + ':rule a sh:NodeShape ; rdfs:label "mine" ; sh:targetClass %s ; sh:rule [ a sh:SPARQLRule ; '
_RULES = (
    *(
        _CONSTRUCT % "irt:Industrial_Robot" + f'sh:construct """{text}""" ] .'
        for text in (
            "CONSTRUCT { ?a a <urn:x> } WHERE { ?a ?b ?c . ?d ?e ?f . ?g ?h ?i }",
            "CONSTRUCT { ?a <http://www.w3.org/2002/07/owl#sameAs> ?c } WHERE { ?a ?b ?c FILTER(isIRI(?c)) }",
            "CONSTRUCT { $this a <http://www.w3.org/2002/07/owl#Nothing> } WHERE { $this ?b ?c }",
            'CONSTRUCT { ?a <urn:next> ?n } WHERE { ?a <urn:next>? ?b BIND(IRI(CONCAT(STR(?b), \\"x\\")) AS ?n) }',
            'CONSTRUCT { ?n a ?c } WHERE { $this a ?c BIND(IRI(CONCAT(STR($this), \\"x\\")) AS ?n) }',
            'CONSTRUCT { ?x <urn:p> ?y } WHERE { $this ?p ?y BIND(\\"x y<>\\" AS ?x) }',
            "CONSTRUCT { $this <urn:p> [] } WHERE { $this ?b ?c }",
            "CONSTRUCT { $this <urn:p> ?free } WHERE { $this ?b ?c }",
            "CONSTRUCT { $this <urn:p> ?c } WHERE { SERVICE <http://127.0.0.1:1/> { $this ?b ?c } }",
            'CONSTRUCT { $this ?p \\"1e999\\" } WHERE { $this ?p ?c }',
            "SELECT ?a { ?a ?b ?c }",
            "",
            "CONSTRUCT { $this <urn:p> ?c } WHERE { { SELECT ?c { ?c (:x|!:x)* ?d . ?e ?f ?g } } $this ?b ?x }",
        )
    ),
    *(_TURTLE, "", "\0", "[" * 3000, _TURTLE + ":rule sh:rule :rule .", _TURTLE + "[] a sh:NodeShape ; sh:rule [] ."),
    _TURTLE + ":rule a swrl:Imp ; swrl:body :list ; swrl:head :list . :list <urn:first> :list .",
    _TURTLE + ":r a swrl:Imp ; swrl:body [] ; swrl:head ( [ a swrl:ClassAtom ; swrl:classPredicate :r ] ) .",
)
_ONTOLOGY = (
    _TURTLE + "owl:Thing rdfs:subClassOf owl:Nothing .",
    _TURTLE + "irt:Industrial_Robot owl:disjointWith irt:Industrial_Robot .",
    *(_TURTLE + "<urn:x> owl:imports <file:///etc/passwd>, <http://127.0.0.1:1/> .", "[" * 3000, "", "\0", "x"),
    _TURTLE + "irt:has_Joint owl:inverseOf irt:has_Joint ; a owl:TransitiveProperty, owl:IrreflexiveProperty .",
    _TURTLE + "irt:has_Joint owl:propertyChainAxiom ( irt:has_Joint irt:has_Joint ) ; rdfs:subPropertyOf owl:sameAs .",
    _TURTLE + f":l <{_REST}> :l . :c owl:intersectionOf :l ; owl:unionOf :l ; owl:oneOf :l .",
    _TURTLE + ':x rdfs:label "' + "x" * 200_000 + '" , "\\u202e"@ar , "<script>1</script>" ; a owl:Class .',
    _TURTLE + "irt:Industrial_Robot owl:sameAs irt:Robot_Joint . owl:sameAs owl:sameAs owl:sameAs .",
    _TURTLE + ':x owl:onProperty :x ; owl:someValuesFrom :x ; owl:maxCardinality "x"^^xsd:int ; rdfs:subClassOf :x .',
    _TURTLE + "".join(f":c{n} rdfs:subClassOf :c{n + 1} ; a owl:Class . " for n in range(300)),
)
_SHAPES = (
    *(
        _TURTLE + ":s a sh:NodeShape ; sh:targetClass irt:Industrial_Robot ; " + text
        for text in (
            'sh:property [ sh:path irt:x ; sh:pattern "(a+)+$" ; sh:minCount 1 ] .',
            "sh:node :s .",
            "sh:not :s ; sh:property [ sh:path [ sh:zeroOrMorePath [ sh:alternativePath ( :x :y ) ] ] ] .",
            "sh:property [ sh:path :s ; sh:minCount -1 ; sh:maxCount 1e30 ] .",
            'sh:sparql [ sh:select "SELECT $this { $this ?a ?b . ?c ?d ?e . ?f ?g ?h }" ] .',
            'sh:sparql [ sh:select "SELECT $this { SERVICE <http://h/> { $this ?a ?b } }" ; sh:message "{$this}" ] .',
            'sh:property [ sh:path ( :p :q ) ; sh:in () ; sh:message "\\u001b[31m{?value}" ; sh:minCount 1 ] .',
            'sh:property [ sh:path irt:x ; sh:pattern "(" ; sh:flags "zzz" ] .',
            "sh:property [ sh:path irt:x ; sh:class [] ; sh:datatype :s ; sh:hasValue 1 ] .",
            "sh:propertyy 1 .",
        )
    ),
    *("", "\0", "[" * 3000, _TURTLE, _TURTLE + f":x sh:path :l . :l <{_REST}> :l ."),
)
_MAP = (
    ":m rr:logicalTable [ %s ] ; rr:subjectMap [ "
    'rr:template "mine/{a}" ; rr:graph <https://w3id.org/irtwin/graph/source/mine> ] ; '
    'rr:predicateObjectMap [ rr:predicate irt:x ; rr:objectMap [ rr:column "a" ] ] .'
)
_MAPPINGS = (
    *(
        _TURTLE + _MAP % f'rr:sqlQuery """{text}"""'
        for text in (
            "SELECT 1 AS a; DROP TABLE robot",
            "WITH RECURSIVE c(a) AS (SELECT 1 UNION ALL SELECT a + 1 FROM c) SELECT a FROM c",
            "SELECT a.robot_id AS a FROM parameter a, parameter b, parameter c, parameter d, parameter e",
            "ATTACH DATABASE 'OUTSIDE/x' AS other",
            "SELECT zeroblob(900000000) AS a",
            "SELECT load_extension('x') AS a",
            "SELECT readfile('/etc/passwd') AS a",
            "PRAGMA writable_schema = 1",
            "DELETE FROM robot RETURNING robot_id AS a",
            "SELECT NULL AS a UNION SELECT 'a b<>' UNION SELECT x'ff00' UNION SELECT 9e999",
            "SELECT '../../' AS a, randomblob(5) AS b",
            "SELECT printf('%999999999d', 1) AS a",
            "SELECT",
            "",
        )
    ),
    *("", "\0", "[" * 3000, _TURTLE, _TURTLE + _MAP % 'rr:tableName "sqlite_master"'),
    _TURTLE + _MAP % 'rr:tableName "nothing"',
    *(
        _TURTLE + (_MAP % 'rr:tableName "robot"').replace("{a}", other)
        for other in ("{robot_id}", "{", "{robot_id}{name}")
    ),
    _TURTLE + (_MAP % 'rr:tableName "robot"').replace("source/mine", "inferred").replace('"a"', '"name"'),
    _TURTLE + (_MAP % 'rr:tableName "robot"').replace("{a}", "{robot_id}").replace('"a"', '"name"'),
)
_NAMES = (*("mine", "other") * 12, "é", "a b", "-", "x" * 240, ".hidden")


def _called(ending: str, *replaced: str) -> tuple[str, ...]:
    return (*(f"{name}{ending}" for name in _NAMES), *replaced)


FILES: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {  # folder -> names and texts of its files
    "ontology": (_called(".ttl", "robot.ttl", "irtwin.ttl"), _ONTOLOGY),
    "rules": (_called("rules.ttl", "mine.swrl.ttl", "live_rules.ttl", "mine.ttl"), _RULES),
    "shapes": (_called(".ttl", "shapes.ttl"), _SHAPES),
    "mappings": (_called(".r2rml.ttl", "robot.r2rml.ttl", "mine.ttl"), _MAPPINGS),
    "questions": (_called(".rq", "robots.rq", "alarms.rq", "energy_per_joint.rq"), _QUESTIONS),
    "reports/energy": (_called(".html.jinja", "page.html.jinja", "page.html.jinja"), _TEMPLATES),
    "reports/gap": (_called(".html.jinja", "page.html.jinja"), _TEMPLATES),
    "reports/layout": (_called(".css", "style.css"), ("</style><script>1</script>", "\0", "x" * 99_999, "")),
    "reports/mine": (_called(".rq", "page.html.jinja", "x.js"), _QUESTIONS),
}


def _file(kind: str) -> Callable[[Path, np.random.Generator], None]:
    def write(workspace: Path, rng: np.random.Generator) -> None:
        names, texts = FILES[kind]
        file = workspace / kind / some(rng, names)
        file.parent.mkdir(parents=True, exist_ok=True)
        text = some(rng, texts).replace("OUTSIDE", str(workspace.parents[1]))
        file.write_bytes(text.encode("utf-8", "surrogatepass"))

    return write


def _odd_file(workspace: Path, rng: np.random.Generator) -> None:
    """Put what is no file there: a link, a ring, a pipe, a folder, one that is huge, many."""
    kind = some(rng, FILES)
    folder = workspace / kind
    file, outside = folder / some(rng, FILES[kind][0]), workspace.parents[1]
    folder.mkdir(parents=True, exist_ok=True)
    how = rng.integers(7)
    if how == 0:
        file.symlink_to(some(rng, [outside / "secret.toml", outside / "etc/passwd", "/dev/zero", "nowhere", file]))
    elif how == 1:
        folder.rmdir()
        folder.symlink_to(some(rng, [outside, outside / "etc", Path("nowhere"), folder]))
    elif how == 2:
        os.mkfifo(file)
    elif how == 3:
        file.mkdir()
    elif how == 4:
        file.write_bytes(b"# " + b"x" * 11_000_000)
    elif how == 5:
        for number in range(600):
            (folder / f"m{number}{''.join(file.suffixes[-2:])}").touch()
    else:
        folder.rmdir()
        folder.write_text("x")


WAYS: dict[str, Callable[[Path, np.random.Generator], None]] = {kind: _file(kind) for kind in FILES}
WAYS |= {"odd file": _odd_file}
