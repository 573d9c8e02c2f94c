"""What the parameters of causes mean, in the ontology's words, for the terminal."""

from __future__ import annotations

from irtwin.document.document import Document
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import EFFECT

_MEANINGS = """SELECT ?effect ?name ?meaning {
    ?effect irt:has_Effect_Parameter ?parameter . ?parameter irt:Parameter_Name ?name ; skos:definition ?meaning
}"""


def meanings(diagnosis: Document) -> list[str]:
    """Return a line for each parameter of the causes that matter; none for one that no module describes."""
    told = {  # each once, and of a vector's parts ("f_x") the whole
        (cause.effect, one.name.partition("_")[0]): None for cause in diagnosis.mattering for one in cause.parameters
    }
    if not told:
        return []
    with KnowledgeGraph() as graph:
        graph.load_ontology()
        said = {(row["effect"].removeprefix(EFFECT), row["name"]): row["meaning"] for row in graph.query(_MEANINGS)}
    return [
        f"{name} of {effect.replace('_', ' ')}: {said[effect, name]}" for effect, name in told if (effect, name) in said
    ]
