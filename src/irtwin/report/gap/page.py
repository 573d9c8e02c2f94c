"""A robot's gap report: where its twin and the robot differ, why, and what to do; one HTML file that opens offline."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from markupsafe import Markup
from plotly.offline import get_plotlyjs

from irtwin import resources
from irtwin.errors import InputError
from irtwin.knowledge.mapping import map_database
from irtwin.knowledge.shacl import rules as shacl_rules
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_ACTIVITY, GRAPH_SOURCE
from irtwin.providers.gap import record
from irtwin.providers.records import identifier, ingest, robot_iri
from irtwin.report import wording
from irtwin.report.energy.page import content_policy, embedded_json, environment
from irtwin.report.gap import document as gap_document
from irtwin.report.gap import figures as gap_figures
from irtwin.report.gap import verdict as gap_verdict
from irtwin.report.questions import Answers, Graph, Question, Row, ask, read_questions
from irtwin.signals.log import DataSet
from irtwin.storage.database import Workspace
from irtwin.storage.files import write

ReadDocument = Callable[[str, str], bytes]  # path in the workspace, checksum


_ELSEWHERE = ("share of what is closed",)  # evidence that has its own place on the page
_FEW = 3  # of many rivals the foremost are shown; the file of the diagnosis has them all


def render_gap(graph: Graph, robot: str, read_document: ReadDocument, out: Path) -> None:
    """Write the gap report of a robot (its IRI) to `out`.

    Numbers come from the questions in `reports/gap`; shares, intervals and the experiment from the diagnosis' file and
    curves from its evidence, both of which the graph names.
    Raises InputError where the graph has no diagnosis of the robot.
    """
    found = ask(graph, {"diagnosis": _questions()["diagnosis"]}, {"robot": robot})["diagnosis"].first
    if found is None:
        raise InputError(f"{robot}: no diagnosis in the graph; run `irtwin diagnose` with this workspace first")
    bindings = {"robot": robot, "diagnosis": found["diagnosis"]}
    answers = ask(graph, _questions(), bindings)
    evidence = json.loads(read_document(found["evidence_file"], found["evidence_checksum"]))
    document = json.loads(read_document(found["file"], found["checksum"]))
    write(out, _page(gap_document.ranked(answers, document), bindings, evidence, document).encode())


def render_alone(data_set: DataSet, diagnosis: Mapping[str, Any], evidence: Mapping[str, Any], out: Path) -> None:
    """Write the gap report of a diagnosis that no workspace keeps."""
    robot_id = identifier(data_set.robot.name)
    with tempfile.TemporaryDirectory() as folder, Workspace(Path(folder)) as workspace:
        ingest(workspace, data_set)
        record(workspace, robot_id, diagnosis, evidence)
        graph = KnowledgeGraph()
        graph.load_ontology()
        mappings = sorted(resources.folder("mappings").glob("*.r2rml.ttl"))
        graph.replace(map_database(workspace.engine, mappings), GRAPH_SOURCE, GRAPH_ACTIVITY)
        shacl_rules.infer(graph)
        render_gap(graph, robot_iri(robot_id), workspace.read_document, out)


def _questions() -> dict[str, Question]:
    return read_questions(resources.folder("reports") / "gap")


def _page(
    answers: Answers, bindings: Mapping[str, str], evidence: Mapping[str, Any], document: Mapping[str, Any]
) -> str:
    folder = resources.folder("reports")
    follows = gap_figures.foremost_curves(evidence.get("follows") or [], answers)
    drawn = gap_figures.figures(answers, {**evidence, "follows": follows}, document)
    parts = gap_document.shares(document)
    scripts = {
        "plotly": get_plotlyjs(),
        "figures": (folder / "layout" / "figures.js").read_text(encoding="utf-8"),
    }
    return environment(folder).get_template("gap/page.html.jinja").render(
        answers=answers,
        bindings=bindings,
        rows={name: answer.rows for name, answer in answers.items()},
        verdict=gap_verdict.sentence(answers),
        causes=[_cause(row, answers) | {"share": parts.get(row["rank"])} for row in answers["causes"].rows],
        places=gap_document.locations(answers["locations"].rows, document),
        budgets=gap_document.budgets(document),
        foremost=gap_figures.foremost_joint(answers),
        follows=follows,
        hidden_curves=len(evidence.get("follows") or []) - len(follows),
        effect_names=gap_figures.effect_names(answers),
        experiment=gap_document.experiment(document, gap_figures.effect_names(answers)),
        drawn=drawn,
        data=embedded_json({"figures": drawn, "explorer": None}),
        style=Markup((folder / "layout" / "style.css").read_text(encoding="utf-8")),
        scripts={name: Markup(text) for name, text in scripts.items()},
        policy=content_policy(scripts.values()),
    )  # fmt: skip


def _cause(row: Row, answers: Answers) -> dict[str, Any]:
    rank = row["rank"]
    return {
        **row,
        "name": gap_verdict.effect_name(row),
        "joints": gap_verdict.joints_of(rank, answers),
        "rivals": gap_verdict.rivals_of(rank, answers),
        "parameters": [one for one in answers["cause_parameters"].rows if one["rank"] == rank],
        "evidence": [pair for pair in _pairs(row["evidence"]) if pair[0] not in _ELSEWHERE],
    }


def _pairs(text: str) -> list[tuple[str, str]]:
    """Return a JSON object as names and texts."""
    given: dict[str, Any] = json.loads(text)
    return [(name.replace("_", " "), _said(value)) for name, value in given.items() if value is not None]


def _said(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return wording.number(value)
    if isinstance(value, list):
        return ", ".join(_said(one) for one in value)
    if isinstance(value, dict):
        foremost = sorted(value.items(), key=lambda pair: -pair[1] if isinstance(pair[1], float) else 0.0)[:_FEW]
        return "; ".join(f"{name.replace('_', ' ')} {_said(one)}" for name, one in foremost)
    return str(value).replace("_", " ") if isinstance(value, str) and " " not in value else str(value)
