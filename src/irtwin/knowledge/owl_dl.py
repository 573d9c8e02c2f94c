"""Description-logic reasoning by HermiT, and clashes as Pellet explains them; owlready2 brings both. They need Java."""

from __future__ import annotations

import io
import re
import subprocess
import tempfile
from collections.abc import Iterable

import owlready2
import owlready2.reasoning as reasoning
from pyoxigraph import NamedNode, RdfFormat, Triple, parse, serialize

from irtwin.errors import InputError
from irtwin.knowledge.java import NoJava, java
from irtwin.knowledge.literals import to_milliseconds
from irtwin.knowledge.owl_rl.closure import Contradiction
from irtwin.knowledge.rules.value_rules import values_as_rules
from irtwin.knowledge.vocabulary import ONTOLOGY, OWL

_IMPORTS = NamedNode(OWL + "imports")
_LONGEST_SEARCH = 120  # seconds
_INFERRED = "http://inferrences/"  # the ontology that owlready2 puts a reasoner's results into
_RESULTS = NamedNode("http://inferrences")


def classify(triples: Iterable[Triple]) -> set[Triple]:
    """Return the superclasses, types and links that HermiT infers in OWL 2 DL; of classes the nearest alone.

    NoJava where there is none. Contradiction says which statements clash, as Pellet explains it, or which classes
    nothing can belong to.
    """
    owlready2.JAVA_EXE = java()
    if owlready2.JAVA_EXE is None:
        raise NoJava
    given = set(triples)
    world = _world(values_as_rules(given))
    try:
        owlready2.sync_reasoner_hermit(world, infer_property_values=True, debug=0)
    except owlready2.OwlReadyInconsistentOntologyError as error:
        raise Contradiction(f"statements contradict each other, HermiT finds. {_clash(_world(given))}") from error
    except owlready2.base.OwlReadyJavaError as error:
        if "OutOfMemoryError" in str(error):
            raise InputError(
                f"HermiT needs more than the {reasoning.JAVA_MEMORY:,} MB it may take; reason with another engine"
            ) from error
        reason = re.search(r"Exception: (.+)", str(error))
        raise InputError(f"HermiT cannot read this as OWL 2 DL: {reason[1] if reason else error}") from error
    empty = [kind.iri for kind in world.inconsistent_classes() if kind is not owlready2.Nothing]
    if empty:
        raise Contradiction(f"HermiT finds classes that nothing can belong to: {', '.join(sorted(empty))}")
    return {triple for triple in _triples(world.get_ontology(_INFERRED)) if triple.subject != _RESULTS}


def _clash(world: owlready2.World) -> str:
    """Return a smallest set of statements that cannot all be true, as Pellet finds it."""
    with tempfile.NamedTemporaryFile(suffix=".nt") as file:
        world.save(file.name, format="ntriples")
        command = [owlready2.JAVA_EXE, "-Xmx2000M", "-cp", reasoning._PELLET_CLASSPATH, "pellet.Pellet"]
        try:
            finished = subprocess.run(
                [*command, "explain", "--ignore-imports", file.name],
                capture_output=True, text=True, check=False, timeout=_LONGEST_SEARCH,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            return f"Pellet did not find out within {_LONGEST_SEARCH} s which statements clash."
    statements = finished.stdout.partition("Explanation(s):")[2]
    if not statements:
        return "Pellet does not find the clash."
    return f"These statements cannot all be true: {' '.join(statements.replace('1)', '', 1).split())}"


def _world(triples: Iterable[Triple]) -> owlready2.World:
    world = owlready2.World()
    text = io.BytesIO()
    kept = (to_milliseconds(triple) for triple in triples if triple.predicate != _IMPORTS)
    serialize(kept, text, RdfFormat.N_TRIPLES)
    text.seek(0)
    world.get_ontology(ONTOLOGY).load(fileobj=text)
    return world


def _triples(ontology: owlready2.Ontology) -> set[Triple]:
    text = io.BytesIO()
    ontology.graph.save(text, format="ntriples")
    return {quad.triple for quad in parse(text.getvalue(), format=RdfFormat.N_TRIPLES)}
