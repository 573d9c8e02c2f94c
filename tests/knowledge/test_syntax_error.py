"""A SPARQL text that fails says where and why in one short line."""

import pytest
from pyoxigraph import Store

from irtwin.knowledge.store.syntax_error import in_words


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("SELECT * { ?s ?p ?o", "error at 1:20: found the end, expected one of , . ; { {| } ~ ..."),
        ("SELECT *\n{ ?s ?p ?o } LIMIT x", 'error at 2:20: found "x", expected one of HAVING OFFSET OPTIONAL VALUES'),
        ("SELECT ?x { ?s ?p ?o } GROUP BY ?s", "error at 1:35: The SELECT contains a variable that is unbound"),
        ("SELECT * { ?s <a b> ?o }", "error at 1:20: IRI parsing failed"),
        ("SELECT * { ?s ?p ?o BIND(1 AS ?s) }", "error at 1:36: found the end"),
    ],
)
def test_a_fault_is_told_in_one_line(text, said):
    with pytest.raises(SyntaxError) as caught:
        Store().query(text)
    assert in_words(caught.value, text).rstrip(" .") == said.rstrip(" .")


def test_an_unknown_prefix_is_named_with_those_that_need_no_prefix():
    text = "SELECT * { ?s a ex:b ; irt:c 3 }"
    with pytest.raises(SyntaxError) as caught:
        Store().query(text)
    said = in_words(caught.value, text)
    assert said.startswith('error at 1:21: the prefix "ex:" is not declared; write PREFIX, or use one of irt, ')


def test_a_message_of_another_form_stays():
    assert in_words(SyntaxError("no SPARQL at all"), "x") == "no SPARQL at all"
