"""Gap reports of hand-written diagnoses, by way of database and graph."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

from irtwin.document.curves import Curves
from irtwin.document.document import Document
from irtwin.knowledge.mapping import map_database
from irtwin.knowledge.reasoning import reason
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_ACTIVITY, GRAPH_SOURCE
from irtwin.providers.gap import record
from irtwin.providers.names import robot_iri
from irtwin.report.gap.page import render_gap
from irtwin.resources import folder
from irtwin.storage.database import Workspace
from irtwin.storage.schema import JointRow
from tests import gap_cases, rows


def six_axis(workspace: Workspace, kind: str = "revolute") -> None:
    """Put the robot of `gap_cases`, with joints of a kind, and its runs, into a workspace."""
    names = enumerate(gap_cases.JOINTS, 1)
    joints = [JointRow(robot_id=rows.ROBOT, name=name, position=k, kind=kind) for k, name in names]
    runs = [rows.run(name, role="reference" if name.startswith("ref") else "observed") for name in gap_cases.RUNS]
    workspace.ingest(rows.robot(controlled_axes=6), joints, runs, {run.run_id: rows.samples(1) for run in runs})


def graph_of(workspace: Workspace) -> KnowledgeGraph:
    graph = KnowledgeGraph()
    graph.load_ontology()
    mappings = sorted(folder("mappings").glob("*.r2rml.ttl"))
    graph.replace(map_database(workspace.engine, mappings), GRAPH_SOURCE, GRAPH_ACTIVITY)
    reason(graph)
    return graph


def page_of(
    place: Path, said: dict[str, Any], drawn: dict[str, Any] | None = None, twin: str | None = None, **robot: str
) -> str:
    """Return the page of a diagnosis, which is then `place`/p.html."""
    with Workspace(place / "w") as workspace:
        six_axis(workspace, **robot)
        curves = Curves.from_json(drawn or gap_cases.evidence("attributed"))
        record(workspace, rows.ROBOT, Document.from_json(said), curves, twin)
        render_gap(graph_of(workspace), robot_iri(rows.ROBOT), workspace.read_document, place / "p.html")
    return (place / "p.html").read_text()


def figures_of(page: Path) -> dict[str, Any]:
    """Return what a page draws, by the name of the figure."""
    return json.loads(re.search(r'id="page-data">(.*?)</script>', page.read_text())[1])["figures"]
