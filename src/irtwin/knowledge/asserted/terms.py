"""Terms that a user's statement may have: of the project's own those that its ontology declares, and none concludes."""

from __future__ import annotations

import re
from difflib import get_close_matches
from functools import lru_cache

from pyoxigraph import NamedNode, Quad

from irtwin.errors import InputError
from irtwin.knowledge.explain.mapping import maps_of
from irtwin.knowledge.rules.files import all_rules
from irtwin.knowledge.rules.rule import head_of
from irtwin.knowledge.store import ontology
from irtwin.knowledge.store.by_subject import BySubject
from irtwin.knowledge.vocabulary import IRT, LIMIT, OWL, RDFS, TARIFF, TYPE, shorten, term
from irtwin.resources import Resources

_DECLARING = (IRT, LIMIT, TARIFF)
_SAME = f"{OWL}equivalentClass"
_NOTEWORTHY = NamedNode(term("Noteworthy"))
_CONCLUDED = re.compile(rf"(?:\birt:|<{IRT})(\w+)")
_ALSO_SAID = frozenset(map(term, ("Saving_Action", "saves_at", "applies_Remedy", "Currency")))  # as of what was done


def check(resources: Resources, quad: Quad, statement: str) -> None:
    """Raise InputError where a statement has a term that the ontology lacks, or one that rules or axioms conclude."""
    declared, concluded = _terms(resources)
    names = [node.value for node in (quad.subject, quad.predicate, quad.object) if isinstance(node, NamedNode)]
    for name in names:
        if name.startswith(_DECLARING) and name not in declared:
            near = get_close_matches(name, declared, 1)
            meant = f"did you mean {shorten(near[0])}? " if near else ""
            own = "A term of your own has a namespace of your own"
            raise refusal(statement, f"the ontology has no {shorten(name)}: {meant}{own}")
    used = names[-1] if quad.predicate == TYPE else quad.predicate.value
    if used in concluded:
        raise refusal(statement, f"{shorten(used)} is concluded; change what it is concluded from")


def refusal(statement: str, why: object) -> InputError:
    """Return the error of a statement that is not taken."""
    return InputError(f"{statement}: {why}; nothing changed")


@lru_cache(maxsize=4)
def _terms(resources: Resources) -> tuple[frozenset[str], frozenset[str]]:
    """Return the terms that the ontology declares, and the properties and classes that are concluded."""
    said = BySubject((quad.triple for quad in ontology.of_modules(resources)), RDFS)
    named = {node.value: node for node in said.all() if isinstance(node, NamedNode)}
    defined = {name for name, node in named.items() if name.startswith(IRT) and said.values(node, _SAME)}
    mapped = {kind.value for _, triples_map in maps_of(resources.of("mappings")) for kind in triples_map.classes}
    noteworthy = {name for name, node in named.items() if _NOTEWORTHY in said.reached(node, "subClassOf")}
    heads = ((rule.construct, head_of(rule.construct)) for rule in all_rules(resources))
    made = {term(name) for text, head in heads if head for name in _CONCLUDED.findall(text, *head.span())}
    return frozenset(named), frozenset(defined - mapped | noteworthy | made - _ALSO_SAID)
