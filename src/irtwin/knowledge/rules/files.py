"""The files of `rules/`: `NAMErules.ttl` are SHACL, `NAME.swrl.ttl` are SWRL."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from irtwin.knowledge.rules import shacl, swrl
from irtwin.knowledge.rules.rule import Rule
from irtwin.knowledge.shacl.shapes import Shapes
from irtwin.knowledge.store.rdf_input import read_turtle
from irtwin.resources import Resources

_SWRL = ".swrl.ttl"


@lru_cache(maxsize=16)
def all_rules(resources: Resources) -> tuple[Rule, ...]:
    """Return the rules that hold for a workspace."""
    return tuple(rule for file in resources.of("rules") for rule in read_rules(file.path))


def read_rules(file: Path) -> tuple[Rule, ...]:
    """Return the rules of a file that are not switched off; InputError for one that cannot be understood."""
    triples = read_turtle(file)
    if file.name.endswith(_SWRL):
        return tuple(swrl.rules_of(triples, str(file)))
    return shacl.rules_of(Shapes(triples, str(file)))
