"""What the classes of effects say, as OWL: `make effects` writes `ontology/effect_facts.ttl`.

What no class needs to know (label, definition, equation, part, remedy) is written by hand, in `ontology/effects.ttl`.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from importlib.metadata import version

from irtwin.effects.catalogue import BASELINE, OWN
from irtwin.effects.effect import Effect

_VERSION = version("irtwin")
_HEAD = f"""\
# What the classes of effects say: made of src/irtwin/effects by `make effects`; change those.
@prefix irt: <https://w3id.org/irtwin#> .
@prefix effect: <https://w3id.org/irtwin/effect/> .
@prefix family: <https://w3id.org/irtwin/family/> .
@prefix channel: <https://w3id.org/irtwin/channel/> .
@prefix dcterms: <http://purl.org/dc/terms/> .
@prefix owl: <http://www.w3.org/2002/07/owl#> .
@prefix xsd: <http://www.w3.org/2001/XMLSchema#> .

<https://w3id.org/irtwin/effect_facts> a owl:Ontology ;
    owl:versionIRI <https://w3id.org/irtwin/{_VERSION}/effect_facts> ;
    owl:versionInfo "{_VERSION}" ;
    owl:imports <https://w3id.org/irtwin/effects> ;
    dcterms:title "irtwin: effects as the program has them"@en ;
    dcterms:description "Family and channel of each effect, and the ranges in which it is searched."@en ;
    dcterms:creator "The irtwin developers" ;
    dcterms:created "2026-11-30"^^xsd:date ;
    dcterms:modified "2026-11-30"^^xsd:date ;
    dcterms:license <https://www.apache.org/licenses/LICENSE-2.0> .
"""


def facts() -> str:
    """Return the module, as Turtle."""
    return "\n".join([_HEAD, *(line for kind in OWN for line in _facts(kind)), ""])


def _facts(kind: type[Effect]) -> Iterator[str]:
    baseline = "true" if kind.id in BASELINE else "false"
    filed = f"irt:has_Family family:{kind.family} ; irt:has_Channel channel:{kind.channel}"
    yield f"effect:{kind.id} {filed} ; irt:Baseline {baseline} ."
    for name, (low, high) in kind.ranges.items():
        ends = f'irt:Range_Lower "{low}"^^xsd:double ; irt:Range_Upper "{high}"^^xsd:double'
        yield f"effect:{kind.id}.{name} {ends} ."


if __name__ == "__main__":
    sys.stdout.write(facts())
