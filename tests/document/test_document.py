"""The document of a diagnosis: its JSON, its schema, and the contract's."""

from __future__ import annotations

import json
from importlib import resources
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyoxigraph import Literal, NamedNode
from tests import gap_cases

from irtwin.document import form
from irtwin.document.curves import Curves
from irtwin.document.document import LIKELY, Cause, Document, Gap, GapLocation, Shrink, cause_ids, schema
from irtwin.document.experiment import Experiment
from irtwin.errors import InputError
from irtwin.knowledge.store.ontology import LIMIT_VALUE, limits
from irtwin.knowledge.vocabulary import LIMIT
from irtwin.resources import shipped

CONTRACT = json.loads((resources.files("irtwin.gap") / "diagnosis.schema.json").read_text())
TO_ACT = NamedNode(f"{LIMIT}confidence_to_act")
JOINTS = ["joint_1", "joint_2", "joint_3"]


def test_a_cause_is_likely_from_the_confidence_from_which_rules_act() -> None:
    (least,) = (quad.object for about, quad in limits(shipped()).items() if about == (TO_ACT, LIMIT_VALUE))
    assert isinstance(least, Literal) and float(least.value) == LIKELY


def resolved(node: dict[str, Any]) -> dict[str, Any]:
    return CONTRACT["$defs"][node["$ref"].rpartition("/")[2]] if "$ref" in node else node


def differences(contract: dict[str, Any], ours: dict[str, Any], where: str) -> list[str]:
    """Return where a schema does not say what the contract's says; what it says beside that is no difference."""
    contract, found = resolved(contract), []
    for keyword, said in contract.items():
        if keyword == "properties":
            for name, inner in said.items():
                found += differences(inner, ours["properties"][name], f"{where}.{name}")
        elif keyword in ("items", "additionalProperties"):
            found += differences(said, ours[keyword], f"{where}.{keyword}")
        elif keyword == "required":
            found += [f"{where}: {name} is not required" for name in set(said) - set(ours["required"])]
        elif keyword != "$defs" and ours.get(keyword) != said:
            found.append(f"{where}: {keyword} is {ours.get(keyword)}, not {said}")
    return found


def test_the_schema_says_all_that_the_contract_says() -> None:
    assert differences(CONTRACT, schema(), "diagnosis") == []


def test_the_schema_is_one() -> None:
    jsonschema = pytest.importorskip("jsonschema")
    jsonschema.Draft202012Validator.check_schema(schema())


@pytest.mark.parametrize("verdict", gap_cases.VERDICTS)
def test_a_document_goes_through_json_and_back(verdict: str) -> None:
    jsonschema = pytest.importorskip("jsonschema")
    said = gap_cases.diagnosis(verdict)
    for one in (CONTRACT, schema()):
        jsonschema.validate(said, one)
    assert json.dumps(gap_cases.document(verdict).to_json(), sort_keys=True) == json.dumps(said, sort_keys=True)


def json_of(node: dict[str, Any]) -> st.SearchStrategy[Any]:
    """Return what a schema of ours allows."""
    if "enum" in node:
        return st.sampled_from(node["enum"])
    kind, *others = node["type"] if isinstance(node["type"], list) else [node["type"]]
    inner = _typed(kind, node)
    return st.none() | inner if others else inner


def _typed(kind: str, node: dict[str, Any]) -> st.SearchStrategy[Any]:
    if kind == "string":
        return st.text(max_size=5)
    if kind == "boolean":
        return st.booleans()
    if kind == "number":
        low, high = node.get("minimum"), node.get("maximum")
        return st.floats(low, high, allow_nan=False, allow_infinity=False)
    if kind == "array":
        return st.lists(json_of(node["items"]), min_size=node.get("minItems", 0), max_size=node.get("maxItems", 2))
    if "additionalProperties" in node:
        return st.dictionaries(st.text(max_size=5), json_of(node["additionalProperties"]), max_size=2)
    parts = {name: json_of(inner) for name, inner in node["properties"].items()}
    required = {name: parts.pop(name) for name in node["required"]}
    return st.fixed_dictionaries(required, optional=parts)


@pytest.mark.parametrize("kind", [Gap, GapLocation, Cause, Shrink, Experiment, Curves])
def test_whatever_the_schema_allows_is_read_and_written_alike(kind: type) -> None:
    @settings(max_examples=40)
    @given(json_of(form.schema(kind)))
    def holds(said: dict[str, Any]) -> None:
        made = form.from_json(kind, said, "part")
        if kind is Cause and "runs" in said["evidence"]:
            said["evidence"].setdefault("window", None)  # goes with the runs
        elif kind is Cause:
            said["evidence"].pop("window", None)
        assert form.to_json(made) == said

    holds()


def test_a_stretch_of_time_goes_with_its_runs() -> None:
    said = gap_cases.diagnosis("attributed")
    said["causes"][0]["evidence"]["runs"] = ["work_1"]
    evidence = Document.from_json(said).to_json()["causes"][0]["evidence"]
    assert evidence["window"] is None
    assert "window" not in Document.from_json(said).to_json()["causes"][1]["evidence"]


def changed(path: str, value: Any) -> dict[str, Any]:
    """Return a diagnosis with another value at a path, or one made of the value there, or with none."""
    said = gap_cases.diagnosis("attributed")
    *way, last = path.split(".")
    part: Any = said
    for step in way:
        part = part[int(step) if step.isdigit() else step]
    if value is None:
        del part[last]
    else:
        part[last] = value(part[last]) if callable(value) else value
    return said


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        ("verdict", "maybe", "diagnosis.verdict must be one of no_gap, attributed, ambiguous, unexplained"),
        ("shrink", None, "diagnosis.shrink must be given"),
        ("causes.0.confidence", 1.5, r"diagnosis.causes\[0\].confidence must be from 0 to 1"),
        ("causes.0.confidence", True, r"diagnosis.causes\[0\].confidence must be a finite number"),
        ("causes.0.evidence.log_odds", float("nan"), "must be a finite number"),
        ("causes.0.parameters.0.interval95", [1.0], r"parameters\[0\].interval95 must be an array of 2"),
        ("causes.0.parameters.0.value", 10**400, r"parameters\[0\].value must be a finite number"),
        ("causes", {}, "diagnosis.causes must be an array"),
        ("gap.torque", [], "diagnosis.gap.torque must be an object"),
        ("robot", 7, "diagnosis.robot must be a string"),
        ("causes.1.id", "viscous_friction@joint_a3", "diagnosis.causes: two have one id"),
        ("shrink.by_cause.0.cause", "glue", "diagnosis.shrink.by_cause: no cause has the id glue"),
        ("findings", lambda some: some * 2, "diagnosis.findings: two have one id"),
        ("findings.0.members", lambda some: some[:1], "findings: stribeck_friction@joint_a3 has to be a cause"),
    ],
)
def test_what_is_no_document_is_told(path: str, value: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        Document.from_json(changed(path, value))


@pytest.mark.parametrize(
    ("causes", "ids"),
    [
        ([("payload", [])], ["payload"]),
        ([("backlash", ["joint_2"])], ["backlash@joint_2"]),
        ([("backlash", ["joint_3", "joint_1"])], ["backlash@joint_1+joint_3"]),
        ([("copper_loss", JOINTS)], ["copper_loss@all"]),
        ([("backlash", ["joint_1"]), ("backlash", ["joint_2"])], ["backlash@joint_1", "backlash@joint_2"]),
        ([("payload", []), ("payload", []), ("payload", [])], ["payload", "payload#2", "payload#3"]),
    ],
)
def test_ids_say_what_and_where(causes: list[tuple[str, list[str]]], ids: list[str]) -> None:
    assert cause_ids(causes, JOINTS) == ids


def test_the_one_joint_of_a_robot_is_named() -> None:
    assert cause_ids([("backlash", ["axis"])], ["axis"]) == ["backlash@axis"]


@given(st.lists(st.tuples(st.sampled_from(["a", "a#2"]), st.lists(st.sampled_from(JOINTS), unique=True)), max_size=9))
def test_ids_are_given_once(causes: list[tuple[str, list[str]]]) -> None:
    ids = cause_ids(causes, JOINTS)
    assert len(set(ids)) == len(ids)
