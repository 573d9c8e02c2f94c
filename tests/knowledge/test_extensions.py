"""What extends a workspace: each fault is one line with file and line, before anything is used."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.data_sets import irtwin, refused_in_a_line
from tests.trusting import trust_all

from irtwin.errors import InputError
from irtwin.knowledge.extensions import check, check_mappings
from irtwin.knowledge.questions.queries import named_questions
from irtwin.knowledge.rules.files import all_rules
from irtwin.resources import resources_of
from irtwin.storage.database import Workspace

PREFIXES = """@prefix irt: <https://w3id.org/irtwin#> .
@prefix my: <https://example.org/my#> .
@prefix sh: <http://www.w3.org/ns/shacl#> .
@prefix swrl: <http://www.w3.org/2003/11/swrl#> .
@prefix swrlb: <http://www.w3.org/2003/11/swrlb#> .
@prefix rdf: <http://www.w3.org/1999/02/22-rdf-syntax-ns#> .
@prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .
@prefix owl: <http://www.w3.org/2002/07/owl#> .
@prefix rr: <http://www.w3.org/ns/r2rml#> .
"""  # nine lines


def rule(body: str, more: str = "") -> str:
    return f"""my:long_run a sh:NodeShape ;
    rdfs:label "long run" ;
    sh:targetClass irt:IR_RunProcess ;
    sh:rule [ a sh:SPARQLRule ; sh:construct \"\"\"
        PREFIX my: <https://example.org/my#> CONSTRUCT {{ {body} }}
        WHERE {{ $this irt:Run_Time ?seconds {more} FILTER(?seconds > 60) }}\"\"\" ] .
"""


def swrl(head: str, body: str = "swrl:ClassAtom ; swrl:classPredicate irt:IR_RunProcess") -> str:
    return f"""my:run a swrl:Variable . my:other a swrl:Variable .
[] a swrl:Imp ; rdfs:label "odd" ;
    swrl:body ( [ a {body} ; swrl:argument1 my:run ] ) ;
    swrl:head ( [ a swrl:ClassAtom ; swrl:classPredicate irt:Idle_Heavy_Run ; swrl:argument1 my:{head} ] ) .
"""


def shape(property: str) -> str:
    return f"""my:shape a sh:NodeShape ; sh:targetClass irt:IR_RunProcess ;
    sh:property [ {property} ] .
"""


def mapping(
    table: str = "run", graph: str = "rr:graph <https://w3id.org/irtwin/graph/source/my>", base: str = ""
) -> str:
    return f"""<#Long> rr:logicalTable [ rr:tableName "{table}" ] ;
    rr:subjectMap [ rr:template "{base}run/{{run_id}}" ; {graph} ] ;
    rr:predicateObjectMap [ rr:predicate my:p ; rr:objectMap [ rr:column "run_time_s" ] ] .
"""


def question(body: str = "", theme: str = "run", verb: str = "SELECT ?run") -> str:
    header = f"# title: Long runs\n# question: Which runs are long?\n# theme: {theme}\n"
    return f"{header}{verb} {{ ?run irt:Run_Time ?s {body} }}\n"


def put(place: Path, name: str, text: str) -> Path:
    file = place / name
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text if name.endswith(".rq") else PREFIXES + text, encoding="utf-8")
    trust_all(place)
    return file


LONG_RUN, NO_QUERY = rule("$this a my:Long_Run"), rule("$this a")
ELSEWHERE = "SERVICE <http://e.org> { ?a ?b ?c }"
FAULTS = [
    ("ontology/my.ttl", "my:a my:b my:c .\nmy:d my:e\n", ", line 12: "),
    ("rules/my_rules.ttl", rule("?x a my:C"), r", line 10: the rule 'long run' concludes \?x, which"),
    ("rules/my_rules.ttl", rule("[] a my:C"), "line 10: .*blank nodes"),
    ("rules/my_rules.ttl", NO_QUERY, ", line 10: the rule 'long run' is no SPARQL: "),
    ("rules/my_rules.ttl", rule("$this a my:C", ELSEWHERE), "line 10: .*SERVICE asks another server"),
    ("rules/my_rules.ttl", LONG_RUN.replace("my:long_run", "[]"), "no IRI"),
    ("rules/my_rules.ttl", LONG_RUN.replace("long_run", "gap_alarm"), "line 10: .* both have"),
    ("rules/my_rules.ttl", LONG_RUN.replace("sh:targetClass", "sh:target"), "line 10: my:|line 10: https"),
    ("rules/my_rules.ttl", "my:a a my:b .", "has no sh:rule"),
    ("rules/my.swrl.ttl", swrl("other"), r"line 11: .*\?other, which"),
    ("rules/my.swrl.ttl", swrl("run").replace("IR_RunProcess", "Nothing_Such"), "line 12: .*irt:Nothing_Such"),
    ("rules/my.swrl.ttl", "my:a a my:b .", "has no swrl:Imp"),
    ("rules/my.swrl.ttl", swrl("run", "swrl:BuiltinAtom"), "line 11: the rule 'odd' uses"),
    ("shapes/my.ttl", shape('sh:path irt:Run_Time ; sh:minCount "one"'), "line 11: not well-formed SHACL: sh:minCount"),
    ("shapes/my.ttl", shape("sh:path irt:Run_Time ; sh:minCont 1"), "line 11: sh:minCont is no term of SHACL"),
    ("shapes/my.ttl", shape("sh:minCount 1"), "line 10: not well-formed"),
    ("shapes/my.ttl", "my:a a my:b .", "has no sh:NodeShape"),
    ("questions/my.rq", question("FILTER(?s >"), r"my.rq, line \d, column \d+: "),
    ("questions/my.rq", question(ELSEWHERE), "line 4, column 36: SERVICE asks"),
    ("questions/my.rq", question(verb="DELETE"), r"line 4, column \d+: "),
    ("questions/my.rq", question(theme="weather"), "its theme is 'weather'"),
    ("questions/my.rq", "SELECT * { ?s ?p ?o }", "line 1: a question begins with `# title: ...`"),
]


@pytest.mark.parametrize(("name", "text", "said"), FAULTS)
def test_a_fault_is_said_with_file_and_line(name: str, text: str, said: str, tmp_path: Path) -> None:
    file = put(tmp_path, name, text)
    with pytest.raises(InputError, match=said) as error:
        check(resources_of(tmp_path))
    assert str(error.value).startswith(str(file))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (mapping("nothing_such"), "line 10: <Long>.*no such table"),
        (mapping().replace("run_time_s", "colour"), "no column colour"),
        (mapping(graph=""), "line 10: <Long>.* has no rr:graphMap"),
        (mapping(graph="rr:graph my:own"), "its graph is none of a mapping"),
        (
            mapping(base="https://w3id.org/irtwin/id/"),
            "line 10: <Long>, subject map: individuals lie below the workspace's base, which may be another",
        ),
        (mapping().replace("rr:tableName", "rr:tableNam"), "tableNam"),
    ],
)
def test_a_mapping_is_held_to_the_tables(text: str, said: str, tmp_path: Path) -> None:
    file = put(tmp_path, "mappings/my.r2rml.ttl", text)
    with Workspace(tmp_path) as place, pytest.raises(InputError, match=said) as error:
        check_mappings(place.resources, place.engine)
    assert str(error.value).startswith(f"{file}, line ")


def test_what_is_sound_holds_beside_what_ships(tmp_path: Path) -> None:
    put(tmp_path, "rules/my_rules.ttl", LONG_RUN)
    put(tmp_path, "rules/my.swrl.ttl", swrl("run"))
    put(tmp_path, "shapes/my.ttl", shape("sh:path irt:Run_Time ; sh:minCount 1"))
    put(tmp_path, "questions/long_runs.rq", question())
    put(tmp_path, "mappings/my.r2rml.ttl", mapping())
    with Workspace(tmp_path) as place:
        check(place.resources)
        check_mappings(place.resources, place.engine)
        assert {"long run", "odd"} <= {rule.label for rule in all_rules(place.resources)}
        assert "long_runs" in named_questions(place.resources)
        assert "long_runs" not in named_questions()


@pytest.mark.parametrize("command", [["query"], ["query", "robots"], ["explain", "?"], ["export", "--owl", "x.owl"]])
def test_commands_stop_at_a_fault(command: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    put(tmp_path / "irtwin-workspace", "rules/my_rules.ttl", NO_QUERY)
    said = "irtwin: irtwin-workspace/rules/my_rules.ttl, line 10: the rule 'long run' is no SPARQL"
    assert refused_in_a_line(*command).startswith(said)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("rules/my_rules.ttl", NO_QUERY),
        ("mappings/my.r2rml.ttl", mapping("nothing_such")),
        ("questions/my.rq", question("FILTER(?s >")),
    ],
)
def test_live_stops_at_a_fault_before_a_sample_is_read(name: str, text: str, tmp_path: Path) -> None:
    Workspace(tmp_path).close()
    file = put(tmp_path, name, text)
    assert refused_in_a_line("live", "--workspace", tmp_path).startswith(f"irtwin: {file}, line ")
    assert not (tmp_path / "graph").exists()


def test_status_lists_what_extends_and_what_is_wrong(tmp_path: Path) -> None:
    Workspace(tmp_path).close()
    file = put(tmp_path, "rules/my_rules.ttl", NO_QUERY)
    put(tmp_path, "shapes/shapes.ttl", shape("sh:path irt:Run_Time ; sh:minCount 1"))
    done = irtwin("workspace", "status", "--workspace", tmp_path)
    assert done.status == 2
    lines = done.out.splitlines()
    assert any(line.split() == ["robots", "none"] for line in lines)
    assert any("shapes/shapes.ttl of workspace, in place of what ships" in line for line in lines)
    assert any(line.startswith("damage") and f"{file}, line 10: the rule 'long run'" in line for line in lines)
