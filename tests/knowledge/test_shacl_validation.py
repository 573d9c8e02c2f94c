from itertools import pairwise

import pytest
from pyoxigraph import Literal, NamedNode, Quad
from tests.individuals import individual
from tests.knowledge.graphs import graph_of, quad, reasoned_over

from irtwin.knowledge import parts
from irtwin.knowledge.reasoning import reason
from irtwin.knowledge.shacl import validation
from irtwin.knowledge.shacl.validation import validate
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import (
    GRAPH_ACTIVITY,
    GRAPH_ONTOLOGY,
    GRAPH_SOURCE,
    GRAPH_VALIDATION,
    ID,
    PROV,
    RDF,
    XSD,
    shorten,
    term,
)

pytestmark = pytest.mark.slow

RUN = individual("run", "Arm_A.fit_1")
JOINT = individual("joint", "Arm_A", "j1")
PARAMETER = individual("parameter", "Arm_A.t1.coulomb_friction.j1.Fc")
SHARE = ID + "energy_share/Arm_A.fit_1/standby_power/robot"
FIT = ID + "torque_fit/Arm_A.t1/Arm_A.fit_1/j1/fit"


def changed(quads: list[Quad], subject: str, name: str, value) -> list[Quad]:
    """Return the quads with another value of a property, or without any where it is None."""
    same = [quad for quad in quads if (quad.subject.value, quad.predicate.value) == (subject, term(name))]
    rest = [quad for quad in quads if quad not in same]
    new = [] if value is None else [Quad(NamedNode(subject), NamedNode(term(name)), value, same[0].graph_name)]
    return rest + new


def turn(graph: KnowledgeGraph, before: list[Quad], after: list[Quad]) -> None:
    graph.change(set(before) - set(after), set(after) - set(before))
    reason(graph)


def test_two_robots_keep_every_constraint(graph: KnowledgeGraph) -> None:
    assert validate(graph) == ()
    report = graph.query(
        "PREFIX sh: <http://www.w3.org/ns/shacl#> SELECT ?ok { ?r a sh:ValidationReport ; sh:conforms ?ok }"
    )
    assert report.rows == ({"ok": True},)


def test_a_property_of_listed_texts_leads_to_no_individual() -> None:
    graph = graph_of([quad(ID + "saving_action/one", term("Compared_For"), Literal("piece"))])
    assert [one.message for one in validate(graph) if one.property == term("Compared_For")] == []


# what is wrong with an individual, and how it is told; a list is wrong at once
BROKEN = [
    [
        (RUN, "Run_Time", Literal(0.0), "a run that is not watched has several samples and lasts longer than 0 s"),
        (RUN, "Sample_Rate", Literal(0.0), "a run's sample rate, if it has one, is above 0 Hz (irt:Sample_Rate is 0"),
        (RUN, "run_of", None, "a run is of one robot (irt:run_of is absent)"),
        (RUN, "Energy_Consumption", Literal(float("nan")), "a run's energy consumption is one finite number"),
        (RUN, "Modelled_Energy", Literal(float("inf")), "a run's modelled energy is one finite number"),
        (RUN, "Returned_Energy", Literal(-1.0), "a run's returned energy is one finite number, 0 J or more"),
        (RUN, "Measured_Energy", None, "a run with an energy error has a measured energy to err from"),
        (RUN, "Idle_Share", Literal(1.5), "a run's idle share is one number between 0 and 1 (irt:Idle_Share is 1.5)"),
        (RUN, "Part_In_Twin", Literal("half"), 'part in twin is "fit", "held_out", "both" or "apart"'),
        (FIT, "Fit_Part", Literal("half"), 'fit part is "fit" or "held_out" (irt:Fit_Part is half)'),
        (RUN, "Payload", Literal("heavy"), "a run's payload is one number, 0 kg or more (irt:Payload is heavy)"),
        (JOINT, "Lower_Limit", Literal(4.0), "a joint's lower limit is one number below its upper limit"),
        (PARAMETER, "Interval_Lower", Literal(4.05), "a parameter's interval begins at its value or below"),
        (PARAMETER, "of_Effect", NamedNode("https://w3id.org/irtwin/effect/magic"), "one effect of the catalogue"),
        (SHARE, "Energy", None, "an energy share has one finite energy"),
        (FIT, "R_Squared", Literal(1.2), "a torque fit's R squared is at most 1"),
        (individual("twin", "Arm_A.t1"), "twin_of", None, "a twin is of one robot"),
    ],
    [
        (RUN, "Run_Time", Literal(-1.0), "a run lasts 0 s or longer (irt:Run_Time is -1"),
        (RUN, "run_of", NamedNode(JOINT), "a run is of one robot"),
        (JOINT, "Joint_Name", None, "a joint has one name"),
        (PARAMETER, "Interval_Upper", Literal(3.95), "a parameter's interval ends at its value or above"),
    ],
    [
        (RUN, "Run_Time", None, "a run lasts 0 s or longer (irt:Run_Time is absent)"),
        (RUN, "Sample_Count", Literal(1), "a run that is not watched has several samples and lasts longer than 0 s"),
    ],
]


@pytest.mark.parametrize("wrong", BROKEN)
def test_broken_constraints_are_said_in_words(two_robots: list[Quad], wrong: list[tuple]) -> None:
    quads = two_robots
    for subject, name, value, _ in wrong:
        quads = changed(quads, subject, name, value)
    graph = graph_of(quads)
    violations = validate(graph)
    for subject, _, _, message in wrong:
        assert [one for one in violations if one.node == subject and message in str(one)] != [], message
    subjects = {subject for subject, *_ in wrong}
    assert {one.node for one in violations} == subjects
    kept = graph.query("PREFIX sh: <http://www.w3.org/ns/shacl#> SELECT ?node { ?r sh:result / sh:focusNode ?node }")
    assert {row["node"] for row in kept} == subjects


def test_two_values_where_one_may_be_are_not_called_absent(two_robots: list[Quad]) -> None:
    one = changed(two_robots, RUN, "Payload", Literal(1.0))
    (violation,) = validate(graph_of([*one, quad(RUN, term("Payload"), Literal(2.0))]))
    assert str(violation).endswith("a run's payload is one number, 0 kg or more (irt:Payload has several values)")


def typed(subject: str, kind: str) -> Quad:
    return quad(subject, RDF + "type", term(kind))


def untyped(quads: list[Quad], subject: str) -> list[Quad]:
    return [one for one in quads if (one.subject.value, one.predicate.value) != (subject, RDF + "type")]


MAGIC, LUCK = "https://w3id.org/irtwin/effect/magic", "https://w3id.org/irtwin/family/luck"
SMELL, FOUND = "https://w3id.org/irtwin/channel/smell", ID + "gap_finding/x"
# what is wrong, though the closure makes all of it true
WRONG_LINES = {
    "id:robot/Arm_A: id:run/Arm_A.fit_1: is not said to be an industrial robot run process (irt:IR_RunProcess), "
    "though only one has such properties",
    f"id:robot/Arm_A: {shorten(JOINT)}: is not said to be a robot joint (irt:Robot_Joint), "
    "though only one has such properties",
    f"id:robot/Arm_A: {shorten(SHARE)}: an energy share is of one effect of the catalogue (irt:of_Effect is {MAGIC})",
    f"id:robot/Arm_A: {shorten(PARAMETER)}: a parameter is of one effect of the catalogue (irt:of_Effect is {MAGIC}2)",
    "id:robot/Arm_A: effect:magic2: is not in the ontology, which lists every effect (irt:Effect)",
    f"{LUCK}: is not in the ontology, which lists every effect family (irt:Effect_Family)",
    f"{shorten(FOUND)}: irt:has_Family leads to an effect family (irt:Effect_Family) of the ontology "
    f"(irt:has_Family is {LUCK})",
    f"{shorten(FOUND)}: irt:located_in_Channel leads to a channel (irt:Channel) of the ontology "
    f"(irt:located_in_Channel is {SMELL})",
}


def test_what_the_closure_would_make_true_is_told(two_robots: list[Quad]) -> None:
    wrong = changed(untyped(untyped(two_robots, RUN), JOINT), SHARE, "of_Effect", NamedNode(MAGIC))
    wrong = changed(wrong, PARAMETER, "of_Effect", NamedNode(MAGIC + "2"))
    wrong += [typed(MAGIC + "2", "Effect"), typed(LUCK, "Effect_Family"), typed(FOUND, "Gap_Finding")]
    for name, value in (("located_in_Channel", SMELL), ("has_Family", LUCK)):
        wrong.append(quad(FOUND, term(name), value))
    graph = reasoned_over(wrong)
    for name, kind in ((RUN, "IR_RunProcess"), (JOINT, "Robot_Joint"), (MAGIC, "Effect"), (SMELL, "Channel")):
        assert graph.holds(typed(name, kind).triple)
    assert WRONG_LINES - set(map(str, validate(graph))) == set()


def test_what_the_ontology_adds_to_a_catalogue_is_in_it(graph: KnowledgeGraph, two_robots: list[Quad]) -> None:
    graph.replace(changed(two_robots, PARAMETER, "of_Effect", NamedNode(MAGIC)), GRAPH_SOURCE, GRAPH_ACTIVITY)
    assert {one.value for one in validate(graph)} == {MAGIC}
    graph.change((), {quad(MAGIC, RDF + "type", term("Effect"), GRAPH_ONTOLOGY)})
    assert validate(graph) == ()


@pytest.mark.parametrize(("who", "place"), [("an activity", ID + "activity/"), ("a run", ID + "run/")])
def test_what_is_under_way_has_no_end(graph: KnowledgeGraph, two_robots: list[Quad], who: str, place: str) -> None:
    ends = [one for one in two_robots if one.predicate.value == PROV + "endedAtTime"]
    ended = [one for one in ends if one.subject.value.startswith(place)]
    assert ended
    graph.replace(set(two_robots) - set(ended), GRAPH_SOURCE, GRAPH_ACTIVITY)
    assert validate(graph) == ()
    early = Literal("1999-01-01T00:00:00Z", datatype=NamedNode(XSD + "dateTime"))
    before = Quad(ended[0].subject, ended[0].predicate, early, ended[0].graph_name)
    graph.change((), {before})
    (said,) = validate(graph)
    assert said.message == f"{who} started before it ended"


def test_report_is_replaced_not_gathered(two_robots: list[Quad], graph: KnowledgeGraph) -> None:
    graph.replace(changed(two_robots, RUN, "Run_Time", None), GRAPH_SOURCE, GRAPH_ACTIVITY)
    assert len(validate(graph)) == 1
    graph.replace(two_robots, GRAPH_SOURCE, GRAPH_ACTIVITY)
    assert validate(graph) == ()
    assert len(graph.triples(GRAPH_VALIDATION)) == 2


def violations_anew(quads: list[Quad]) -> tuple[str, ...]:
    return tuple(map(str, validate(reasoned_over(quads))))


@pytest.fixture
def checked(monkeypatch: pytest.MonkeyPatch) -> list[set[str]]:
    """Return the individuals that are looked at, part by part."""
    calls: list[set[str]] = []
    report = validation._report

    def spy(ontology, said):
        calls.append({one.subject.value for one in said if one.subject.value.startswith(ID)})
        return report(ontology, said)

    monkeypatch.setattr(validation, "_report", spy)
    return calls


@pytest.mark.nightly
def test_only_the_robot_that_changed_is_checked_again(two_robots: list[Quad], checked: list[set[str]]) -> None:
    of_b = individual("run", "Arm_B.work_1")
    broken = changed(two_robots, of_b, "Run_Time", Literal(0.0))
    graph = reasoned_over(broken)
    assert tuple(map(str, validate(graph))) == violations_anew(broken)
    worse = changed(broken, RUN, "Run_Time", None)
    for before, now in pairwise([broken, worse, broken, two_robots]):
        turn(graph, before, now)
        checked.clear()
        found = validate(graph)
        again = set().union(*checked)
        assert tuple(map(str, found)) == violations_anew(now)
        assert again < set().union(*checked)
        kept = graph.query("PREFIX sh: <http://www.w3.org/ns/shacl#> SELECT ?n { ?r sh:result / sh:focusNode ?n }")
        assert sorted(row["n"] for row in kept) == sorted(one.node for one in found)
    assert len(graph.triples(GRAPH_VALIDATION)) == 2


def test_a_change_that_breaks_nothing_is_not_shown_to_pyshacl(
    two_robots: list[Quad], monkeypatch: pytest.MonkeyPatch
) -> None:
    graph = reasoned_over(two_robots)
    assert validate(graph) == ()
    monkeypatch.setattr(validation.pyshacl, "validate", None)
    longer = changed(two_robots, RUN, "Run_Time", Literal(99.0))
    turn(graph, two_robots, longer)
    assert validate(graph) == ()


def test_what_was_not_reasoned_over_is_checked_whole(two_robots: list[Quad], checked: list[set[str]]) -> None:
    graph = reasoned_over(two_robots)
    validate(graph)
    wrong = changed(two_robots, RUN, "Run_Time", None)
    graph.change(set(two_robots) - set(wrong), set(wrong) - set(two_robots))
    assert len(validate(graph)) == 1
    reason(graph)
    assert len(validate(graph)) == 1


def test_nothing_is_checked_where_nothing_changed(two_robots: list[Quad], checked: list[set[str]]) -> None:
    graph = reasoned_over(changed(two_robots, RUN, "Run_Time", None))
    first = validate(graph)
    checked.clear()
    assert validate(graph) == first
    assert checked == []


def test_a_part_that_was_just_reasoned_over_is_not_read_again(
    two_robots: list[Quad], monkeypatch: pytest.MonkeyPatch
) -> None:
    graph = reasoned_over(two_robots)
    assert validate(graph) == ()
    longer = changed(two_robots, RUN, "Run_Time", Literal(99.0))
    turn(graph, two_robots, longer)
    with monkeypatch.context() as patch:
        patch.setattr(parts, "around", None)
        assert validate(graph) == ()
    wrong = changed(two_robots, RUN, "Run_Time", None)
    turn(graph, longer, wrong)
    assert len(validate(graph)) == 1


def test_violations_go_with_their_robot(two_robots: list[Quad], checked: list[set[str]]) -> None:
    graph = reasoned_over(changed(two_robots, RUN, "Run_Time", None))
    assert len(validate(graph)) == 1
    gone = {one for one in graph.quads() if "Arm_A" in str(one.triple) and "/inferred/" not in str(one.graph_name)}
    graph.change({one for one in gone if one.graph_name.value.startswith((GRAPH_SOURCE, GRAPH_ACTIVITY))}, ())
    reason(graph)
    assert validate(graph) == ()
