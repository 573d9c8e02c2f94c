"""The effects that are installed and those that the ontology describes are the same."""

from __future__ import annotations

from irtwin.document.words import ONTOLOGY
from irtwin.effects.catalogue import catalogue
from irtwin.errors import InputError
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import EFFECT

_DESCRIBED = f"""SELECT ?effect {{
    ?effect a irt:Effect ; rdfs:label ?label ; irt:has_Channel ?channel
    FILTER(?channel != <{ONTOLOGY}/channel/position>)  # a simulator's, and no twin's
}}"""


def check_effects(graph: KnowledgeGraph) -> None:
    """Raise InputError where an effect is installed or described alone: answers would lose its energy unsaid."""
    described = {str(row["effect"]).removeprefix(EFFECT) for row in graph.query(_DESCRIBED)}
    if alone := sorted(catalogue().keys() - described):
        raise InputError(
            f'the ontology lacks the effect "{alone[0]}", which is installed; without it, answers would lose its '
            f"energy: describe <{EFFECT}{alone[0]}> as an irt:Effect with label and channel, in "
            f"ontology/{alone[0]}.ttl of the package that brings it, or of the workspace"
        )
    if alone := sorted(described - catalogue().keys()):
        raise InputError(
            f'ontology/effects.ttl: describes the effect "{alone[0]}", which is not installed; install its package, or '
            "take it out"
        )
