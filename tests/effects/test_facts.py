"""What classes of effects say stands in the ontology once, as they say it, and fits what is written there by hand."""

from __future__ import annotations

import pytest
from pyoxigraph import RdfFormat, parse

from irtwin.effects.catalogue import OWN
from irtwin.effects.facts import facts
from irtwin.knowledge.owl_rl.closure import Closure, Contradiction
from irtwin.knowledge.store.rdf_input import read_turtle
from irtwin.resources import folder

IRT = "https://w3id.org/irtwin#"
WRITTEN = {*read_turtle(folder("ontology") / "effects.ttl")}


def said(text: str) -> set:
    return {quad.triple for quad in parse(text, RdfFormat.TURTLE)}


def of(triples: set, *names: str) -> set[tuple[str, str]]:
    """Return what has these properties, and which of them."""
    known = {IRT + name for name in names}
    return {(one.subject.value, one.predicate.value) for one in triples if one.predicate.value in known}


def test_the_shipped_module_is_what_the_classes_say() -> None:
    assert (folder("ontology") / "effect_facts.ttl").read_text(encoding="utf-8") == facts(), "run `make effects`"


def test_nothing_of_it_is_written_by_hand_too() -> None:
    names = ("has_Family", "has_Channel", "Baseline", "Range_Lower", "Range_Upper")
    assert of(said(facts()), *names) & of(WRITTEN, *names) == set()


def test_ranges_are_of_parameters_that_are_described() -> None:
    described = {subject for subject, _ in of(WRITTEN, "Parameter_Name")}
    assert {subject for subject, _ in of(said(facts()), "Range_Lower")} <= described


def test_kinds_of_effects_have_the_families_of_their_classes() -> None:
    closed = Closure(WRITTEN | said(facts())).worth_keeping()  # raises Contradiction where one has two
    losses = {
        one.subject.value.rpartition("/")[2]
        for one in closed
        if one.object.value == "https://w3id.org/irtwin/loss/friction"
    }
    assert {kind.id for kind in OWN if kind.family == "friction"} <= losses


def test_a_class_of_another_family_than_its_kind_contradicts() -> None:
    wrong = facts().replace(
        "effect:coulomb_friction irt:has_Family family:friction", "effect:coulomb_friction irt:has_Family family:load"
    )
    with pytest.raises(Contradiction):
        Closure(WRITTEN | said(wrong))
