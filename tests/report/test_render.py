import re
from pathlib import Path

import pytest
from markupsafe import Markup
from pyoxigraph import Literal, NamedNode, Quad, Triple
from tests.html_elements import Elements, plain
from tests.report.robots import Factory, PageOf, power_only, six_axis

from irtwin.errors import InputError
from irtwin.knowledge.explain.explanation import Explanation
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_REASONED, term
from irtwin.packing import Fragment
from irtwin.report.energy.page import render
from irtwin.report.page import content_policy

pytestmark = pytest.mark.slow

HOSTILE = "<script>alert(1)</script>\"'&</title>"


def without_scripts(page: str) -> str:
    return re.sub(r"<script[^>]*>.*?</script>", "", page, flags=re.DOTALL)


def text(page: str) -> str:
    return plain(without_scripts(page))


def test_the_twin_says_how_sure_the_scale_of_its_torque_is(graph: KnowledgeGraph, page_of: PageOf):
    said = "The scale of torque is uncertain by 10 %: torque of drives comes from nominal constants"
    page = text(page_of(six_axis(graph, scale_why=said)))
    assert f"{said}. All that goes with torque is off together by it" in page
    assert page.count("with the scale</th>") == 2 and page.count('class="scaled"') == 12


def test_the_twin_says_its_filter(graph: KnowledgeGraph, page_of: PageOf):
    page = text(page_of(six_axis(graph)))
    assert "Signals were low-pass filtered at 10.0 Hz (found: 10 times the bandwidth of the motion)." in page


def test_key_numbers_stand_at_the_top(graph: KnowledgeGraph, page_of: PageOf):
    page = text(page_of(six_axis(graph)))
    assert "These logs are simulated." in page
    assert "misses the energy of runs it never saw by 2.5 %" in page
    assert "This twin should be identified again" in page and "exceeds 10 % on cycle_6" in page
    assert page.index('class="verdict"') < page.index('class="key-numbers"') < page.index('id="robot"')


def test_the_flow_of_energy_is_drawn_without_a_script(graph: KnowledgeGraph, page_of: PageOf):
    page = without_scripts(page_of(six_axis(graph)))
    flow = page[page.index('class="flows"') :]
    assert "Sankey diagram" in flow and flow.index("<path") < flow.index(">supply ")


def test_nothing_is_loaded_from_anywhere(graph: KnowledgeGraph, page_of: PageOf):
    page = page_of(six_axis(graph))
    for tag, attributes in Elements(page).found:
        assert tag not in {"iframe", "object", "embed", "base"}
        assert tag != "link" or attributes == {"rel": "icon", "href": "data:,"}  # else a browser asks for one
        for name in ("src", "href", "srcset", "action"):
            assert (attributes.get(name) or "#").startswith(("#", "data:")), (tag, attributes)
    assert not re.search(r"url\(|@import", without_scripts(page))


def test_only_the_scripts_of_the_page_may_run(graph: KnowledgeGraph, tmp_path: Path):
    six = six_axis(graph)
    out = tmp_path / "page.html"
    scene = Fragment(Markup("<div>scene</div>"), ("let scene = 1;\r\n", "let more = 2;"))
    render(graph, six.iri, six.read_series, out, draw_scene=lambda runs, opens: scene)
    page = out.read_text(encoding="utf-8")
    policy = next(a["content"] for tag, a in Elements(page).found if a.get("http-equiv") == "Content-Security-Policy")
    assert policy and policy.startswith("default-src 'none'")
    assert policy.count("'sha256-") == 6
    assert "unsafe-eval" not in policy and "http" not in policy
    assert content_policy(["let more = 2;"]).split("'")[3] in policy


def test_conclusions_say_how_they_are_known(graph: KnowledgeGraph, tmp_path: Path):
    six = six_axis(graph)
    out = tmp_path / "page.html"
    file = Explanation("id:run/cycle_6", "what was recorded", file="cycle_6.csv", checksum="c0ffee")
    asked: list[tuple[str, str, str]] = []

    def explain(subject: str, predicate: str, object: str) -> Explanation:
        asked.append((subject, predicate, object))
        return Explanation("a <fact>", "a rule", (file,), meaning="What the rule means.")

    render(graph, six.iri, six.read_series, out, explain=explain)
    page = out.read_text(encoding="utf-8")
    for part in ("<summary>Why", "What the rule means.", "a &lt;fact&gt;", "cycle_6.csv", "c0ffee"):
        assert part in page
    assert all(graph.holds(Triple(*map(NamedNode, triple))) for triple in asked)
    assert any(predicate.endswith("#dominant_Joint") for _, predicate, _ in asked)


def test_hostile_names_are_text(graph: KnowledgeGraph, page_of: PageOf):
    factory = Factory("ODD", HOSTILE, joint_name=HOSTILE + "{}").robot(note={"<script>": "</script><script>alert(2)"})
    page = page_of(factory.run(HOSTILE.translate({60: "a", 62: "b", 34: "c", 39: "d"})).into(graph))
    elements = Elements(page)
    kinds = [said.get("type") for tag, said in elements.found if tag == "script"]
    assert kinds == ["application/json", *["application/gzip"] * 3, None]
    assert "<script>alert" not in page
    assert "&lt;script&gt;alert(1)&lt;/script&gt;" in page


def test_hostile_joint_names_in_the_data_of_figures_cannot_end_the_script(graph: KnowledgeGraph, page_of: PageOf):
    factory = Factory("ODD", "ODD", joint_name="</script>{}").robot().run("a").twin(["a"], []).into(graph)
    data = re.findall(r"<script[^>]*>(.*?)</script>", page_of(factory), re.DOTALL)[0]
    assert data.startswith("{") and data.endswith("}") and "<" not in data


@pytest.mark.parametrize(
    ("changes", "runs", "expected"),
    [
        ({"power": False}, 1, "No electrical power was measured, so there is no energy error to show."),
        ({"torque": False}, 1, "Joint torque was not measured: only power can be compared."),
        ({"joints": 7}, 2, "joint_7"),
        ({"joints": 1, "power": False, "torque": False}, 1, "no measurement can check it"),
    ],
)
def test_what_is_missing_is_said(
    changes: dict[str, object], runs: int, expected: str, graph: KnowledgeGraph, page_of: PageOf
):
    factory = Factory("R", "R", **changes).robot(facts=False)  # type: ignore[arg-type]
    names = [f"run_{number}" for number in range(runs)]
    for name in names:
        factory.run(name)
    page = text(page_of(factory.twin(names, []).into(graph)))
    assert expected in page
    assert "These logs are simulated" not in page


def test_a_run_without_energy_does_not_hide_the_others(graph: KnowledgeGraph, page_of: PageOf):
    factory = Factory("R", "R").robot().run("known").run("unknown").twin(["known"], []).into(graph)
    assert re.search(r"2.45 Wh</b>\s*<span>energy taken</span>\s*<small>2 runs, 40.0 s", text(page_of(factory)))


def test_a_robot_without_twin_or_runs_has_a_page(graph: KnowledgeGraph, page_of: PageOf):
    page = text(page_of(Factory("NEW", "NEW").robot(facts=False).into(graph)))
    assert "No twin of this robot has been identified yet" in page
    assert "No run of this robot is in the graph." in page


def test_a_hundred_runs(graph: KnowledgeGraph, page_of: PageOf):
    page = page_of(six_axis(graph, runs=100))
    assert len(page) < 9e6
    assert page.count("<option ") == 100


def test_two_robots_do_not_mix(graph: KnowledgeGraph, page_of: PageOf):
    six, ur3 = six_axis(graph), power_only(graph)
    assert "cycle_6" not in page_of(ur3)
    assert "pick" not in text(page_of(six))


def test_every_question_of_the_report_is_shown(graph: KnowledgeGraph, page_of: PageOf):
    page = page_of(six_axis(graph))
    for file in Path(__file__).parents[2].glob("reports/energy/*.rq"):
        assert f"{file.name}</span>" in page, f"{file.name} is asked but not shown"


def test_a_violated_constraint_is_shown(graph: KnowledgeGraph, page_of: PageOf):
    factory = Factory("R", "R").robot().run("a")
    factory.say(
        "[] a sh:ValidationReport ; sh:conforms false ; sh:result [ a sh:ValidationResult ;"
        ' sh:focusNode id:run ; sh:resultSeverity sh:Violation ; sh:resultMessage "Run_Time must be positive" ] .'
    )
    page = text(page_of(factory.into(graph)))
    assert "does not conform" in page and "Run_Time must be positive" in page


def test_an_unknown_robot_is_the_users_mistake(graph: KnowledgeGraph, tmp_path: Path):
    with pytest.raises(InputError, match="this robot is not in the graph"):
        render(graph, "https://w3id.org/irtwin/id/robot/none", lambda path, checksum: None, tmp_path / "x.html")  # type: ignore[arg-type, return-value]
    assert not (tmp_path / "x.html").exists()


def test_a_robot_that_contradicts_itself_is_said_on_its_page_alone(graph: KnowledgeGraph, page_of: PageOf):
    other = Factory("B", "B").robot().run("a").into(graph)
    wrong = Factory("A", "A").robot().run("a").into(graph)
    why = "prp-fp: two values of irt:IR_Weight, <50> and <60>"
    triple = Triple(NamedNode(wrong.iri), NamedNode(term("Contradiction")), Literal(why))
    graph.replace([Quad(*triple, NamedNode(GRAPH_REASONED))], GRAPH_REASONED)
    page = page_of(wrong)
    (banner,) = re.findall(r'<p class="banner" id="contradiction">(.*?)</p>', page, re.DOTALL)
    assert plain(re.sub("<[^>]*>", "", banner)) == (
        f"What is said of this robot contradicts itself: {why}. Correct one of them, and run the data set again."
    )
    assert 'id="contradiction"' not in page_of(other)
