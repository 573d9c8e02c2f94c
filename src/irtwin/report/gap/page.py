"""A robot's gap report: where its twin and the robot differ, why, and what to do; one HTML file that opens offline."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from irtwin.document.curves import Curves, FarthestApart
from irtwin.document.document import FALSE_PLACES, LEAST_SHARE, LIKELY, Document
from irtwin.errors import InputError
from irtwin.json_text import parse_json
from irtwin.knowledge.mapping import map_database
from irtwin.knowledge.reasoning import reason
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_ACTIVITY, GRAPH_SOURCE
from irtwin.packing import Fragment
from irtwin.providers.gap import unrecorded
from irtwin.providers.names import identifier, robot_iri
from irtwin.report import wording
from irtwin.report.gap import figures as gap_figures
from irtwin.report.gap import friction as gap_friction
from irtwin.report.gap import verdict as gap_verdict
from irtwin.report.gap.experiment import experiment
from irtwin.report.gap.findings import NOT_REPEATING, counted
from irtwin.report.page import report_page
from irtwin.report.questions import Answers, ask, questions_of
from irtwin.resources import Resources, shipped
from irtwin.robot.description import Robot
from irtwin.robot.meshes import Mesh
from irtwin.signals.log import DataSet
from irtwin.storage.database import in_memory
from irtwin.storage.files import write
from irtwin.virtual.scene import apart_html

ReadDocument = Callable[[str, str], bytes]  # path in the workspace, checksum
DescribeRobot = Callable[[], tuple[Robot, Mapping[str, Mesh]]]  # with its meshes


def render_gap(
    graph: KnowledgeGraph,
    robot: str,
    read_document: ReadDocument,
    out: Path,
    resources: Resources | None = None,
    describe: DescribeRobot | None = None,
) -> None:
    """Write the gap report of a robot (its IRI) to `out`.

    Numbers and sentences come from the questions in `reports/gap`, curves from the evidence file that the graph names,
    with friction's numbers. `describe` says what the robot looks like, if it is to be drawn beside its simulator.
    `resources` are the questions and templates to take, those that ship if None.
    Raises InputError where the graph has no diagnosis of the robot.
    """
    resources = resources or shipped()
    questions = questions_of(resources, "gap")
    diagnosis = ask(graph, {"diagnosis": questions["diagnosis"]}, {"robot": robot})["diagnosis"].first
    if diagnosis is None:
        raise InputError(f"{robot}: no diagnosis in the graph; run `irtwin diagnose` with this workspace first")
    bindings = {"robot": robot, "diagnosis": diagnosis["diagnosis"]}
    answers = ask(graph, questions, bindings)
    curves = Curves.from_json(parse_json(read_document(diagnosis["evidence_file"], diagnosis["evidence_checksum"])))
    picture = None if describe is None or curves.apart is None else _picture(curves.apart, *describe())
    write(out, _page(resources, answers, bindings, curves, picture).encode())


def _picture(apart: FarthestApart, robot: Robot, meshes: Mapping[str, Mesh]) -> Fragment:
    before, after = (wording.quantity(1e3 * off, "mm", 2) for off in (apart.off_before, apart.off_after))
    poses = {f"The simulator as it is: {before} off": np.array(apart.before)}
    if apart.after != apart.before:
        poses[f"With the robot’s numbers: {after} off"] = np.array(apart.after)
    return apart_html(robot, np.array(apart.robot), poses, meshes)


def render_alone(
    data_set: DataSet, diagnosis: Document, curves: Curves, out: Path, resources: Resources | None = None
) -> None:
    """Write the gap report of a diagnosis, and no other file; `resources` as `render_gap` has them."""
    graph = KnowledgeGraph(resources=resources)
    graph.load_ontology()
    rows, documents = unrecorded(data_set, diagnosis, curves)
    with in_memory(rows) as engine:
        graph.replace(map_database(engine, graph.resources.paths("mappings")), GRAPH_SOURCE, GRAPH_ACTIVITY)
    reason(graph)
    robot = graph.iri(robot_iri(identifier(data_set.robot.name)))
    render_gap(graph, robot, lambda path, checksum: documents[path], out, graph.resources, lambda: (data_set.robot, {}))


def _page(
    resources: Resources, answers: Answers, bindings: Mapping[str, str], curves: Curves, picture: Fragment | None
) -> str:
    follows = gap_figures.foremost_curves(curves.follows, answers)
    drawn = gap_figures.figures(answers, replace(curves, follows=tuple(follows)))
    friction = gap_friction.figures(curves.friction or ())
    effect_names = gap_figures.effect_names(answers)
    verdict = gap_verdict.told(answers)
    return report_page(
        resources,
        "gap",
        answers,
        bindings,
        drawn | {f"friction_{k}": figure for k, figure in enumerate(friction.values())},
        fragment=picture,
        verdict=gap_verdict.sentence(answers),
        findings=[finding for finding in verdict if finding.matters],
        counted=counted([finding for finding in verdict if not finding.matters]),
        likely_from=LIKELY,
        foremost=gap_figures.foremost_joint(answers),
        follows=follows,
        hidden_curves=len(curves.follows) - len(follows),
        kinds=NOT_REPEATING,
        least_share=LEAST_SHARE,
        chance=FALSE_PLACES,
        effect_names=effect_names,
        friction=list(friction),
        friction_numbers=gap_friction.table(curves.friction or (), effect_names),
        former_role=next((curve.role for curve in curves.friction or () if curve.role != "observed"), None),
        experiment=experiment(answers),
        moment=curves.apart,
        picture=None if picture is None else picture.html,
    )  # fmt: skip
