"""The ontology's documentation page."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from pyoxigraph import NamedNode, RdfFormat, parse
from tests.data_sets import done
from tests.html_elements import Elements
from tests.trusting import trust_all

from irtwin.report.ontology.page import page, read_modules
from irtwin.resources import folder, resources_of, shipped

IRT = "https://w3id.org/irtwin#"


def links_of(page: Elements) -> set[str]:
    return set(page.values("href")) - {"data:,"}  # an empty icon, else a browser asks for one


@pytest.fixture(scope="module")
def text() -> str:
    return page(read_modules(shipped()))


@pytest.fixture(scope="module")
def elements(text: str) -> Elements:
    return Elements(text)


def test_each_term_has_the_anchor_of_its_iri(elements: Elements) -> None:
    terms = {
        quad.subject.value.removeprefix(IRT)
        for file in folder("ontology").glob("*.ttl")
        for quad in parse(path=str(file), format=RdfFormat.TURTLE)
        if isinstance(quad.subject, NamedNode) and quad.subject.value.startswith(IRT)
    }
    assert terms | {"effect/coulomb_friction", "unit:N-M", "sosa:Platform"} <= set(elements.values("id"))


def test_no_anchor_stands_twice_and_no_link_leads_nowhere_or_away(elements: Elements) -> None:
    ids = elements.values("id")
    assert len(ids) == len(set(ids))
    assert links_of(elements) <= {f"#{one}" for one in ids}


def test_the_page_needs_no_network(elements: Elements, text: str) -> None:
    assert elements.values("src") == []
    assert [said for tag, said in elements.found if tag in ("link", "script", "iframe")] == [
        {"rel": "icon", "href": "data:,"}
    ]
    assert "default-src &#39;none&#39;" in text


def said_of(text: str, term: str) -> str:
    article = re.search(rf'<article id="{term}">.*?</article>', text, re.DOTALL)
    return re.sub(r"\s+", " ", re.sub(r"<[^>]+>", " ", article[0]))


@pytest.mark.parametrize(
    ("term", "words"),
    [
        ("Wasteful_Run", "equivalent to idle-heavy run or standby-heavy run"),
        ("Planned_Run", "disjoint with live run , measured run , replayed run"),
        ("Planned_Run", "at most 0 measured energy"),
        ("lies_in", "follows from caused by effect then sits in"),
        ("IR_RunProcess", "key run name , run of"),
        ("Verification_Result", "range &#34;verified&#34; or &#34;not verified&#34;"),
    ],
)
def test_axioms_are_said_in_words(text: str, term: str, words: str) -> None:
    assert words in said_of(text, term)


def test_what_the_page_says_of_a_property(text: str) -> None:
    said = said_of(text, "Energy_Error")
    for words in (
        "energy error irt:Energy_Error",
        "Difference of modelled and measured energy over the measured",
        "domain industrial robot run process",
        "range xsd:double",
        "characteristics functional",
        "unit unit:PERCENT (%)",
        "example 6.54",
        "source Yan et al. (2018), equation (15)",
    ):
        assert words in said


def test_effects_show_their_equations_and_alignments_their_superclasses(text: str) -> None:
    assert "Fv dq" in text
    assert '<a href="#sosa:Platform">sosa:Platform</a>' in text


def test_the_tree_has_what_is_below_within_what_is_above(text: str) -> None:
    tree = text[text.index('<div class="tree">') : text.index('<section id="module-')]
    above, below = tree.index('href="#IR_RunProcess"'), tree.index('href="#Live_Run"')
    assert above < below
    assert tree[above:below].count("<ul>") > tree[above:below].count("</ul>")


OWN = """@prefix my: <https://example.org/my#> . @prefix irt: <https://w3id.org/irtwin#> .
@prefix owl: <http://www.w3.org/2002/07/owl#> . @prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .
<https://example.org/my> a owl:Ontology .
irt:IR_RunProcess a owl:Class .
my:Night_Run a owl:Class ; rdfs:subClassOf irt:IR_RunProcess ; rdfs:comment "Made <by> night." .
"""


@pytest.mark.slow
def test_what_extends_a_workspace_stands_on_the_page(tmp_path: Path) -> None:
    (tmp_path / "ontology").mkdir()
    (tmp_path / "ontology/shifts.ttl").write_text(OWN)
    trust_all(tmp_path)
    text = page(read_modules(resources_of(tmp_path)))
    ids = Elements(text).values("id")
    assert {"module-shifts", "shifts/Night_Run"} <= set(ids)
    assert len(ids) == len(set(ids))
    assert {link for link in links_of(Elements(text)) if link.startswith("#")} <= {f"#{one}" for one in ids}
    assert "shifts.ttl of workspace" in text
    assert "Made &lt;by&gt; night." in text
    done("docs", "--workspace", tmp_path, "--ontology", tmp_path / "page.html")
    assert (tmp_path / "page.html").read_text() == text
