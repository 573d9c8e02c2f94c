"""The page of competency questions: each named question, its columns with units, and the start of its answer."""

from __future__ import annotations

import re
from pathlib import Path

from tests.data_sets import done

from irtwin.knowledge.questions.queries import THEMES, named_questions
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.report.ontology.questions_page import ASKED_BY, MOST_ROWS, page
from irtwin.report.wording import shown
from irtwin.resources import shipped


def test_each_question_has_its_place_its_words_and_its_query(tmp_path: Path) -> None:
    out = tmp_path / "questions.html"
    ontology = tmp_path / "ontology.html"
    assert done("docs", "--ontology", ontology, "--questions", out) == f"{ontology}\n{out}\n"
    assert "industrial robots and the energy they use" in ontology.read_text(encoding="utf-8")
    text = out.read_text(encoding="utf-8")
    questions = named_questions()
    assert re.findall(r'<article id="(\w+)">', text) == list(questions)
    assert f"{len(questions)} questions" in text
    assert text.count("<details><summary>SPARQL</summary>") == len(questions)
    assert '<th scope="col">Energy, Wh</th>' in text and "<td><code>?energy_Wh</code></td>" in text
    assert "No answer" not in text and 'http-equiv="Content-Security-Policy"' in text
    assert ASKED_BY.keys() == set(THEMES)


def test_a_graph_shows_the_first_rows_and_says_where_it_has_none(graph: KnowledgeGraph) -> None:
    """The ontology alone knows kinds of data, and no robot."""
    kinds, robots = (graph.query(named_questions()[name].text) for name in ("data_kinds", "robots"))
    assert len(kinds) > MOST_ROWS and not robots
    text = page(shipped(), graph)
    assert f"and {len(kinds) - MOST_ROWS} rows more" in text and "No answer in this workspace." in text
    assert all(shown(cell) in text for cell in kinds[0].values())
