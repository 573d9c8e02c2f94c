"""A query that would end the process by its depth is refused, and what is merely long is read."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.trusting import trust_all

from irtwin.errors import InputError
from irtwin.knowledge.extensions import check
from irtwin.knowledge.questions import queries
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.readable import is_readable
from irtwin.resources import resources_of

DEEP = {
    "open groups": "SELECT ?a { " + "{" * 3000,
    "brackets": "SELECT ?a { FILTER(" + "(" * 50_000 + "1" + ")" * 50_000 + ") }",
    "negations": "SELECT ?a { FILTER(" + "!" * 50_000 + "true) }",
    "sums": "SELECT (" + "1+" * 50_000 + "1 AS ?a) {}",
    "unions": "SELECT ?a { " + "{ ?a ?p ?o } UNION " * 20_000 + "{} }",
}
LONG = "SELECT ?a { VALUES ?a { " + "1 " * 20_000 + "} }"


@pytest.mark.parametrize("name", DEEP)
def test_a_deep_query_is_refused(name: str) -> None:
    with pytest.raises(InputError, match="the query is nested too deeply, or too long, to be read"):
        queries.ask(KnowledgeGraph(), DEEP[name])


def test_a_deep_question_of_a_workspace_is_told_with_its_file(tmp_path: Path) -> None:
    file = tmp_path / "questions" / "my.rq"
    file.parent.mkdir()
    file.write_text(f"# title: Mine\n# question: What?\n# theme: run\n{DEEP['open groups']}")
    trust_all(tmp_path)
    with pytest.raises(InputError, match="line 1, column 1: the query is nested too deeply") as error:
        check(resources_of(tmp_path))
    assert str(error.value).startswith(str(file))


def test_what_is_long_or_no_query_is_read() -> None:
    assert len(queries.ask(KnowledgeGraph(), LONG)) == 20_000
    assert is_readable("x" * 20_000, None)
