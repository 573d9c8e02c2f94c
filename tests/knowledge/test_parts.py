"""Reasoning over the parts that changed gives what reasoning over the whole graph gives."""

from collections.abc import Iterable
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyoxigraph import Literal, NamedNode, Quad, Triple
from tests import small_fleet
from tests.individuals import individual
from tests.knowledge.graphs import DRAWN, inferred, quad, turtle
from tests.mapped import ontology_graph

from irtwin import rewriting
from irtwin.alarms.alarm import alarms
from irtwin.knowledge import by_parts, parts, reasoning
from irtwin.knowledge.owl_rl.beside import FactsClosure
from irtwin.knowledge.owl_rl.closure import Contradiction
from irtwin.knowledge.owl_rl.schema import Schema
from irtwin.knowledge.reasoning import reason
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.named_graphs import in_graph
from irtwin.knowledge.vocabulary import (
    GRAPH_ACTIVITY,
    GRAPH_CHANGED,
    GRAPH_INFERRED,
    GRAPH_ONTOLOGY,
    GRAPH_OWL_RL,
    GRAPH_REASONED,
    GRAPH_SHACL,
    GRAPH_SOURCE,
    OWL,
    RDF,
    RDFS,
    XSD,
    term,
)
from irtwin.storage.database import Workspace

TYPE = RDF + "type"
ROBOTS = ("r", "s")


LIMIT = "https://w3id.org/irtwin/limit/idle_share"
EFFECT = "https://w3id.org/irtwin/effect/copper_loss"
CELL, LINE = individual("cell", "4"), individual("line", "body")
ONTOLOGY = list(
    in_graph(
        turtle(f"""
        irt:IR_RunProcess a owl:Class ; rdfs:subClassOf irt:Process . irt:Joint_Energy a owl:Class .
        irt:exceeds rdfs:domain irt:IR_RunProcess . irt:of_Effect rdfs:range irt:Effect . <{EFFECT}> a irt:Effect .
        irt:has_RunProcess owl:inverseOf irt:run_of ; a owl:InverseFunctionalProperty .
        irt:has_Joint a owl:InverseFunctionalProperty . irt:run_of a owl:FunctionalProperty .
        irt:of_Run a owl:ObjectProperty . irt:before a owl:TransitiveProperty . irt:Idle_Share rdfs:range xsd:double .
        irt:part_of a owl:TransitiveProperty . irt:stands_in rdfs:subPropertyOf irt:part_of .
        irt:stands_in rdfs:range irt:Robot_Cell .
        irt:cell_of_Line rdfs:subPropertyOf irt:part_of . irt:joint_of rdfs:subPropertyOf irt:part_of .
        irt:Run_Name rdfs:range xsd:string . irt:Joint_Number rdfs:range xsd:integer .
        <{LIMIT}> irt:Limit_Value "0.5"^^xsd:double ."""),
        GRAPH_ONTOLOGY,
    )
)


def of_robot(robot: str) -> list[Quad]:
    one, two = individual("run", robot + ".1"), individual("run", robot + ".2")
    body, energy, joint = (individual(kind, robot) for kind in ("robot", "energy", "joint"))
    return [
        quad(body, TYPE, term("Industrial_Robot")),
        quad(body, term("has_RunProcess"), one),
        quad(two, term("run_of"), body),
        quad(one, TYPE, term("IR_RunProcess")),
        quad(two, TYPE, term("IR_RunProcess")),
        quad(one, term("Idle_Share"), Literal(0.7)),
        quad(two, term("Idle_Share"), Literal(0.2)),
        quad(one, term("before"), two),
        quad(one, term("Run_Name"), Literal("morning")),
        quad(energy, TYPE, term("Joint_Energy")),
        quad(energy, term("of_Run"), one),
        quad(energy, term("of_Joint"), joint),
        quad(energy, term("of_Effect"), EFFECT),
        quad(energy, term("Energy"), Literal(5.0)),
        quad(joint, term("Joint_Number"), Literal(5)),
        quad(joint, term("joint_of"), body),
        quad(body, term("stands_in"), CELL),
        quad(CELL, TYPE, term("Robot_Cell")),
        quad(CELL, term("cell_of_Line"), LINE),
        quad(LINE, TYPE, term("Production_Line")),
    ]


FACTS = [fact for robot in ROBOTS for fact in of_robot(robot)]
JOINING = {  # by each of these, something follows for both robots
    "another value of the ontology's limit": quad(LIMIT, term("Limit_Value"), Literal(0.1)),
    "a class of runs": quad(term("IR_RunProcess"), RDFS + "subClassOf", individual("class", "Lazy")),
    "a key": quad(term("IR_RunProcess"), OWL + "hasKey", individual("list", "x")),
    "runs that are the same": quad(individual("run", "r.1"), OWL + "sameAs", individual("run", "s.1")),
    "a robot that is an effect": quad(EFFECT, OWL + "sameAs", individual("robot", "r")),
    "from the ontology to a run": quad(EFFECT, term("before"), individual("run", "s.1")),
    "the ontology's joint": quad(individual("robot", "r"), term("has_Joint"), EFFECT),
    "an energy of the ontology's run": quad(individual("energy", "r"), term("of_Run"), LIMIT),
    "a property that is transitive": quad(term("of_Run"), TYPE, OWL + "TransitiveProperty"),
    "a robot before the other": quad(individual("run", "r.2"), term("before"), individual("run", "s.1")),
    "a datatype": quad(individual("joint", "r"), term("Joint_Kind"), XSD + "byte"),
    "a type of a text": quad(term("Run_Name"), RDFS + "range", individual("class", "Name")),
}


def conclusions(graph: KnowledgeGraph) -> dict[str, set]:
    return {name: triples for name, triples in inferred(graph).items() if name != GRAPH_REASONED}


def holding(quads: Iterable[Quad]) -> KnowledgeGraph:
    graph = KnowledgeGraph()
    graph.replace(ONTOLOGY, GRAPH_ONTOLOGY)
    graph.replace(quads, GRAPH_SOURCE)
    return graph


def anew(quads: Iterable[Quad]) -> KnowledgeGraph:
    graph = holding(quads)
    reason(graph)
    return graph


def refused(*_: object) -> None:
    raise parts.Joined("for comparison")


def as_one_part(graph: KnowledgeGraph) -> dict[str, set]:
    """Return what follows from the whole graph, taken as one part."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(by_parts, "conclude", refused)
        copy = KnowledgeGraph()
        names = [name for name in graph.graphs() if not name.startswith((GRAPH_INFERRED, GRAPH_REASONED))]
        copy.replace((it for name in names for it in graph.store.quads_in(name)), *names)
        assert reason(copy).joined_by == "for comparison"
        return conclusions(copy)


def test_robots_are_parts_of_their_own() -> None:
    graph = anew(FACTS)
    assert reason(graph).joined_by is None
    ontology = parts.Ontology(graph)
    top = parts.parted(ontology, reasoning.asserted(graph))
    tops = {top(node) for triple in graph.triples(DRAWN) for node in ontology.nodes(triple)}
    assert len(tops) == len((*ROBOTS, CELL, LINE))


def test_what_parts_conclude_of_the_cell_that_they_share_counts_once() -> None:
    of_r, of_s = of_robot("r"), of_robot("s")
    graph = holding([*of_r[:3], of_r[16], *of_s[16:19], JOINING["runs that are the same"]])
    assert reason(graph).owl_rl == len(conclusions(graph)[GRAPH_OWL_RL])


def test_a_part_is_no_less_apart_for_being_the_first(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parts, "_schema", Schema)  # as in a new process, which has closed no ontology yet
    graph = holding(of_robot("r"))
    ontology = parts.Ontology(graph)
    assert by_parts.conclude(graph, ontology, [NamedNode(individual("robot", "r"))]).added


@pytest.mark.slow
@settings(max_examples=25)
@given(
    st.lists(st.lists(st.sampled_from(FACTS), unique=True), min_size=2, max_size=4),
    st.lists(st.sampled_from([None, *JOINING.values()]), min_size=4, max_size=4),
    st.lists(st.booleans(), min_size=4, max_size=4),
)
def test_any_change_gives_what_the_whole_graph_gives(
    states: list[list[Quad]], joining: list[Quad | None], written_anew: list[bool]
) -> None:
    graph = holding([])
    for drawn, join, anew_graph in zip(states, joining, written_anew, strict=False):
        quads = {*drawn, *([join] if join else [])}
        before = conclusions(graph)
        if anew_graph:
            graph.replace(quads, DRAWN)
        else:
            now = set(in_graph(graph.triples(DRAWN), DRAWN))
            graph.change(now - quads, quads - now)
        try:
            outcome = reason(graph)
        except Contradiction:
            with pytest.raises(Contradiction):
                anew(quads)
            assert conclusions(graph) == before  # nothing goes silent
            continue
        assert inferred(graph) == inferred(anew(quads))
        assert conclusions(graph) == as_one_part(graph)
        assert not graph.triples(GRAPH_CHANGED + "/") and graph.changed(GRAPH_INFERRED) == set()
        after = conclusions(graph)
        new = {name: len(found - before.get(name, set())) for name, found in after.items()}
        assert outcome.owl_rl == new.get(GRAPH_OWL_RL, 0)
        assert outcome.by_rules == sum(new.values()) - outcome.owl_rl


@pytest.mark.parametrize("joining", JOINING.values(), ids=JOINING)
def test_what_joins_robots_is_seen(joining: Quad) -> None:
    graph = anew(FACTS)
    graph.change((), {joining})
    reason(graph)
    assert conclusions(graph) == as_one_part(graph)
    graph.change({joining}, ())
    reason(graph)
    assert inferred(graph) == inferred(anew(FACTS))


def test_only_the_part_that_changed_is_reasoned_over(monkeypatch: pytest.MonkeyPatch) -> None:
    graph = anew(FACTS)
    given: set[Triple] = set()
    add = FactsClosure.add
    monkeypatch.setattr(FactsClosure, "add", lambda self, triples: (given.update(triples), add(self, triples))[1])
    share = quad(individual("run", "r.2"), term("Idle_Share"), Literal(0.2))
    graph.change({share}, {quad(individual("run", "r.2"), term("Idle_Share"), Literal(0.9))})
    reason(graph)
    said_of = {it.subject.value for it in given if it.subject.value.startswith("https://w3id.org/irtwin/id/")}
    assert said_of == {one.subject.value for one in of_robot("r")}


@pytest.mark.parametrize("change", ["stands_in", "cell_of_Line", "type"])
def test_who_stands_in_a_place_that_changes_is_part_of_what_it_is_part_of_then(change: str) -> None:
    graph = anew(FACTS)
    assert graph.holds(Triple(*map(NamedNode, (individual("joint", "s"), term("part_of"), LINE))))
    old = {
        "stands_in": quad(individual("robot", "s"), term("stands_in"), CELL),
        "cell_of_Line": quad(CELL, term("cell_of_Line"), LINE),
        "type": quad(CELL, TYPE, term("Robot_Cell")),
    }[change]
    graph.change({old}, ())
    reason(graph)
    assert inferred(graph) == inferred(anew([one for one in FACTS if one != old]))
    graph.change((), {old})
    assert reason(graph).joined_by is None
    assert inferred(graph) == inferred(anew(FACTS))


def test_a_part_that_goes_takes_its_conclusions_along() -> None:
    graph = anew(FACTS)
    graph.change(set(of_robot("s")) - set(of_robot("r")), ())
    reason(graph)
    assert inferred(graph) == inferred(anew(of_robot("r")))


@pytest.mark.parametrize("wrong_robots", [("r",), ("r", "s")])
def test_statements_that_contradict_each_other_are_set_aside_and_all_else_is_concluded_from(wrong_robots) -> None:
    runs = {robot: individual("run", f"{robot}.1") for robot in wrong_robots}
    wrong = {quad(run, OWL + "differentFrom", run) for run in runs.values()}
    graph = anew(FACTS)
    graph.change((), wrong)
    done = reason(graph)
    assert {node for node, _ in done.set_aside} == {*(individual("robot", it) for it in wrong_robots), *runs.values()}
    assert all("eq-diff1" in why and "nothing is concluded from these" in why for _, why in done.set_aside)
    assert conclusions(graph) == conclusions(anew(FACTS))
    assert reason(graph).set_aside == done.set_aside

    share = quad(individual("run", "s.2"), term("Idle_Share"), Literal(0.9))
    graph.change((), {share})
    assert reason(graph).set_aside == done.set_aside
    graph.change({share}, ())
    graph.change(wrong, ())
    assert reason(graph).set_aside == ()
    assert inferred(graph) == inferred(anew(FACTS))


def test_a_contradiction_that_is_no_robots_is_contained_too() -> None:
    graph = holding([*FACTS, quad(LIMIT, OWL + "differentFrom", LIMIT)])
    assert [node for node, _ in reason(graph).set_aside] == [LIMIT]
    assert conclusions(graph) == conclusions(anew(FACTS))


def test_an_ontology_that_contradicts_itself_is_told_and_what_was_concluded_stays() -> None:
    graph = anew(FACTS)
    before = conclusions(graph)
    wrong = Triple(NamedNode(LIMIT), NamedNode(OWL + "differentFrom"), NamedNode(LIMIT))
    graph.replace([*ONTOLOGY, *in_graph([wrong], GRAPH_ONTOLOGY)], GRAPH_ONTOLOGY)
    for _ in range(2):
        with pytest.raises(Contradiction, match="eq-diff1"):
            reason(graph)
    assert conclusions(graph) == before
    assert [alarm.rule for alarm in alarms(graph)] == ["contradiction"]
    graph.replace(ONTOLOGY, GRAPH_ONTOLOGY)
    reason(graph)
    assert inferred(graph) == inferred(anew(FACTS))


def test_an_update_that_tells_no_individuals_has_all_done_anew() -> None:
    graph = anew(FACTS)
    graph.update("DELETE { ?run irt:Idle_Share ?s } WHERE { ?run irt:Idle_Share ?s }")
    reason(graph)
    assert inferred(graph) == inferred(anew([one for one in FACTS if one.predicate.value != term("Idle_Share")]))


def test_an_update_of_one_individual_is_followed() -> None:
    graph = anew(FACTS)
    run = individual("run", "s.2")
    graph.update(f"INSERT DATA {{ <{run}> irt:Idle_Share 0.8e0 }}")
    assert graph.changed(GRAPH_INFERRED)
    reason(graph)
    assert conclusions(graph) == as_one_part(graph)


def test_nothing_in_the_place_of_nothing_has_nothing_done_anew() -> None:
    graph = anew(FACTS)
    before = graph.made_of()
    assert before
    graph.replace([], DRAWN + "/none")
    assert graph.made_of() == before


def test_another_ontology_has_all_done_anew() -> None:
    graph = anew(FACTS)
    other = [one for one in ONTOLOGY if one.predicate.value != OWL + "inverseOf"]
    graph.replace(other, GRAPH_ONTOLOGY)
    reason(graph)
    assert conclusions(graph) == as_one_part(graph)


@pytest.mark.parametrize("joining", [None, JOINING["a class of runs"]], ids=["in parts", "as one part"])
def test_only_what_differs_is_written_and_nothing_where_no_premise_changed(
    joining: Quad | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    graph = anew([*FACTS, *([joining] if joining else [])])
    before = conclusions(graph)
    again = reason(graph)
    assert again.owl_rl == again.by_rules == 0
    shares = {one for one in FACTS if one.predicate.value == term("Idle_Share")}
    graph.change(shares, ())
    written: list[Quad] = []
    change = graph.change
    monkeypatch.setattr(graph, "change", lambda gone, come: (written.extend([*gone, *come]), change(gone, come)))
    done, after = reason(graph), conclusions(graph)
    assert (done.owl_rl, done.by_rules, done.joined_by is None) == (0, 0, joining is None)
    differing = {name: before[name] - after.get(name, set()) for name in before}
    assert not any(after[name] - before[name] for name in after)
    assert {name for name, gone in differing.items() if gone} == {f"{GRAPH_SHACL}idle_share"}
    assert f"{GRAPH_SHACL}dominant_joint" in after
    told = [one for one in written if one.graph_name.value.startswith(GRAPH_INFERRED)]
    assert len(told) == sum(map(len, differing.values()))


def test_nothing_is_noted_of_a_graph_that_was_never_reasoned_over() -> None:
    graph = holding([])
    graph.change((), FACTS)
    assert graph.graphs(GRAPH_CHANGED) == []


@pytest.mark.slow
def test_a_fleet_one_by_one(tmp_path: Path) -> None:
    with Workspace(tmp_path) as place, KnowledgeGraph() as mapped:
        small_fleet.fill(place)
        rewriting.map_rows(place, mapped)
        left = {one for one in mapped.quads() if one.graph_name.value.startswith((GRAPH_SOURCE, GRAPH_ACTIVITY))}
    graph = ontology_graph()
    reason(graph)
    for robot in (*small_fleet.JOINTS, ""):
        some = {one for one in left if robot in one.subject.value or robot in str(one.object)}
        graph.change((), some)
        left -= some
        assert reason(graph).joined_by is None
    assert conclusions(graph) == as_one_part(graph)
