"""How far rules look: which predicates could lead them from one robot to another."""

import pytest

from irtwin.knowledge import locality
from irtwin.knowledge.locality import Reach
from irtwin.knowledge.vocabulary import term
from irtwin.resources import shipped

EX = "https://example.org/"


def reach(body: str, head: str = "SELECT $this") -> Reach:
    return locality.of_query(f"PREFIX ex: <{EX}> {head} WHERE {{ {body} }}")


def test_shipped_rules_look_backward_and_anywhere_by_few_predicates() -> None:
    found = locality.of_all_rules(shipped())
    assert found.backward == {term(name) for name in ("of_Run", "total_of")}
    assert found.anywhere == frozenset()
    assert found.unknown == frozenset()


@pytest.mark.parametrize(
    ("body", "backward", "anywhere"),
    [
        ("$this ex:p ?a . ?a ex:q/ex:r* ?b", set(), set()),
        ("?a ex:p $this . ?a ex:q ?b", {"p"}, set()),
        ("?a ex:q ?b . ?a ex:p $this", {"p"}, set()),
        ("$this ex:p ?a . ?b ex:q ?a", {"q"}, set()),
        ("$this ex:p ?a . ?b ex:q ?c", set(), {"q"}),
        ("$this ex:p ?a . OPTIONAL { ?b ex:q ?a }", {"q"}, set()),
        ("$this ex:p ?a . FILTER NOT EXISTS { ?b ex:q $this ; ex:r ?c }", {"q"}, set()),
        ("$this ex:p ?a . FILTER EXISTS { ?b ex:q ?c }", set(), {"q"}),
        ("$this ex:p ?a . MINUS { ?b ex:q ?a }", {"q"}, set()),
        ("BIND(ex:x AS ?a) ?a ex:p ?b . $this ex:q ?c", set(), set()),
    ],
)
def test_patterns_are_followed_from_the_focus_node(body: str, backward: set[str], anywhere: set[str]) -> None:
    found = reach(body)
    assert found.unknown == frozenset()
    assert (found.backward, found.anywhere) == ({EX + it for it in backward}, {EX + it for it in anywhere})


@pytest.mark.parametrize(
    "body",
    [
        "$this ^ex:p ?a",
        "$this !ex:p ?a",
        "?a ?p $this",
        "$this ex:p ?a . ?b a ex:C",
        "$this ex:p ?a . { SELECT (MAX(?x) AS ?most) WHERE { ?b ex:q ?x } }",
        "$this ex:p ?a . GRAPH ?g { $this ex:q ?b }",
        "$this ex:p ?a . FILTER NOT EXISTS { $this ^ex:p ?b }",
    ],
)
def test_what_cannot_be_followed_is_said(body: str) -> None:
    assert reach(body).unknown


def test_terms_that_a_rule_names_are_told() -> None:
    assert {EX + "x", EX + "y"} <= reach("BIND(ex:x AS ?a) ?a ex:p ?b . $this ex:q ex:y").terms


@pytest.mark.parametrize(
    ("body", "predicates"),
    [
        ("$this ex:p ?a . FILTER NOT EXISTS { ?a ex:q/ex:r* ?b }", {"p", "q", "r"}),
        ("$this ex:p|^ex:q ?a . OPTIONAL { ?a ex:r ?b } { SELECT $this { $this ex:s ?c } }", {"p", "q", "r", "s"}),
    ],
)
def test_the_predicates_that_a_rule_reads(body: str, predicates: set[str]) -> None:
    assert reach(body).predicates == {EX + it for it in predicates}


@pytest.mark.parametrize("body", ["$this ?p ?a", "$this !ex:p ?a", "$this ex:p ?a . FILTER EXISTS { ?a ?q ?b }"])
def test_a_rule_that_may_read_anything(body: str) -> None:
    assert locality.ANY in reach(body).predicates
