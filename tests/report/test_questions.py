import re
from pathlib import Path

from tests.report.robots import power_only, six_axis

from irtwin import resources
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.report.questions import ask, read_questions

FOLDER = resources.folder("reports") / "energy"
QUESTIONS = read_questions(FOLDER.glob("*.rq"))
OF_GAPS = read_questions((FOLDER.parent / "gap").glob("*.rq"))
EVERY = [*QUESTIONS.values(), *OF_GAPS.values()]
TWIN = "https://w3id.org/irtwin/id/twin/{}.1a2b"


def test_every_question_has_a_title_and_runs_unbound_too(graph: KnowledgeGraph):
    for question in EVERY:
        assert question.title.endswith("?")
        assert "# title" not in question.text
        graph.query(question.text)


def test_every_question_uses_terms_of_the_ontology_only(graph: KnowledgeGraph):
    terms = {term for question in EVERY for term in re.findall(r"\birt:(\w+)", question.text)}
    assert [term for term in terms if not graph.query(f"SELECT ?p WHERE {{ irt:{term} ?p ?o }}")] == []


def test_a_question_is_about_the_robot_that_was_asked_for(graph: KnowledgeGraph):
    six, ur3 = six_axis(graph), power_only(graph)
    for factory, runs in ((six, 6), (ur3, 1)):
        bindings = {"robot": factory.iri, "twin": TWIN.format(factory.robot_id)}
        answers = ask(graph, QUESTIONS, bindings)
        assert answers["totals"].first["runs"] == runs
        for answer in answers.values():
            for row in answer.rows:
                assert row.get("robot", factory.iri) == factory.iri
                assert row.get("twin", bindings["twin"]) == bindings["twin"]


def test_a_question_whose_variables_are_unknown_has_no_rows(graph: KnowledgeGraph):
    six = six_axis(graph)
    assert ask(graph, QUESTIONS, {"robot": six.iri})["parameters"].rows == ()


def test_a_value_of_two_graphs_is_counted_once(graph: KnowledgeGraph):
    six = six_axis(graph)
    alone = ask(graph, QUESTIONS, {"robot": six.iri})["totals"].rows
    six.inferred = six.text  # a reasoner that states all of it again
    six.into(graph)
    assert ask(graph, QUESTIONS, {"robot": six.iri})["totals"].rows == alone


def test_the_header_is_not_part_of_the_text(tmp_path: Path):
    (tmp_path / "q.rq").write_text("# title: Why?\n# bind: robot, twin\nSELECT ?robot WHERE { ?robot ?p ?o }\n")
    question = read_questions([tmp_path / "q.rq"])["q"]
    assert (question.title, question.bind) == ("Why?", ("robot", "twin"))
    assert question.text.startswith("SELECT")
