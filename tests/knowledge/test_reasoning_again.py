"""What is inferred after any change is what would be inferred from nothing, and nothing else is touched."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyoxigraph import Literal, Quad
from tests.individuals import individual
from tests.knowledge.graphs import inferred, quad

from irtwin.knowledge.reasoning import reason
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import (
    GRAPH_OWL_RL,
    GRAPH_REASONED,
    GRAPH_SHACL,
    GRAPH_SOURCE,
    GRAPH_SWRL,
    RDF,
    RDFS,
    term,
)

TYPE = RDF + "type"
RUNS = [individual("run", name) for name in ("one", "two")]
JOINTS = [individual("joint", name) for name in ("a", "b")]
ENERGIES = [individual("energy", name) for name in ("x", "y")]


# Each is a fact that some rule or axiom draws on.
FACTS = [
    *(quad(run, TYPE, term("IR_RunProcess")) for run in RUNS),
    *(quad(run, term("Idle_Share"), Literal(share)) for run, share in zip(RUNS, (0.7, 0.2), strict=True)),
    quad("https://w3id.org/irtwin/limit/idle_share", term("Limit_Value"), Literal(0.5)),
    *(quad(energy, TYPE, term("Joint_Energy")) for energy in ENERGIES),
    *(quad(energy, term("of_Run"), RUNS[0]) for energy in ENERGIES),
    *(quad(energy, term("of_Joint"), joint) for energy, joint in zip(ENERGIES, JOINTS, strict=True)),
    *(quad(energy, term("Energy"), Literal(joules)) for energy, joules in zip(ENERGIES, (5.0, 7.0), strict=True)),
    quad(individual("robot", "r"), term("has_Joint"), JOINTS[0]),
    quad(term("has_Joint"), "http://www.w3.org/2002/07/owl#inverseOf", term("joint_of")),
    quad(term("IR_RunProcess"), RDFS + "subClassOf", term("Process")),
    quad(term("exceeds"), RDFS + "domain", term("Lazy")),
]


def concluded(quads: list[Quad]) -> KnowledgeGraph:
    graph = KnowledgeGraph()
    graph.replace(quads, GRAPH_SOURCE)
    reason(graph)
    return graph


def anew(quads: list[Quad]) -> dict[str, set]:
    return inferred(concluded(quads))


@pytest.mark.slow
@settings(max_examples=25)
@given(st.lists(st.lists(st.sampled_from(FACTS), unique=True), min_size=2, max_size=4))
def test_any_change_gives_what_a_full_run_gives(states: list[list[Quad]]) -> None:
    graph = KnowledgeGraph()
    for quads in states:
        graph.replace(quads, GRAPH_SOURCE)
        before = inferred(graph)
        outcome = reason(graph)
        after = inferred(graph)
        assert after == anew(quads)
        new = {name: found - before.get(name, set()) for name, found in after.items()}
        assert outcome.owl_rl == len(new.get(GRAPH_OWL_RL, ()))
        of_rules = {name: found for name, found in new.items() if name.startswith((GRAPH_SHACL, GRAPH_SWRL))}
        assert outcome.by_rules == sum(map(len, of_rules.values()))


def test_graphs_of_rules_whose_premises_stay_are_not_rewritten() -> None:
    graph = concluded(FACTS)
    before = inferred(graph)
    graph.replace([one for one in FACTS if one.predicate.value != term("Idle_Share")], GRAPH_SOURCE)
    done, after = reason(graph), inferred(graph)
    assert done.owl_rl == done.by_rules == 0
    differing = {name for name in {*before, *after} - {GRAPH_REASONED} if before.get(name) != after.get(name)}
    assert differing == {GRAPH_OWL_RL, f"{GRAPH_SHACL}idle_share"}


def test_only_what_differs_is_written(monkeypatch: pytest.MonkeyPatch) -> None:
    graph = concluded(FACTS)
    written: list[Quad] = []
    change = graph.change
    monkeypatch.setattr(
        graph, "change", lambda removed, added: (written.extend([*removed, *added]), change(removed, added))
    )
    graph.replace([one for one in FACTS if one.object != Literal(7.0)], GRAPH_SOURCE)
    reason(graph)
    kept = {(one.subject.value, one.predicate.value) for one in written if one.graph_name.value != GRAPH_REASONED}
    assert kept == {(RUNS[0], term("dominant_Joint"))}


def test_nothing_is_done_where_no_premise_changed() -> None:
    graph = KnowledgeGraph()
    graph.replace(FACTS, GRAPH_SOURCE)
    first, again = reason(graph), reason(graph)
    assert (first.owl_rl, first.by_rules) == (4, 2)
    assert again.owl_rl == again.by_rules == 0
