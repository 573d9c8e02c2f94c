"""A plant for pages: the four robots of `small_fleet`, one known by mechanics alone, one with a hostile name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from pyoxigraph import Literal, NamedNode, Quad
from sqlalchemy import update
from sqlalchemy.orm import Session

from irtwin.knowledge.mapping import map_database
from irtwin.knowledge.reasoning import reason
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_ACTIVITY, GRAPH_SOURCE, RDFS
from irtwin.report.questions import Answers
from irtwin.storage import schema
from irtwin.storage.database import Workspace
from tests import small_fleet
from tests.mapped import MAPPINGS

TARIFF = 'name = "Werk 1"\nprice_per_kwh = 0.2\ncurrency = "EUR"\nco2_kg_per_kwh = 0.4\nhours_a_year = 1000\n'
HOSTILE = "=1+1\"><script>alert('x')</script>"


PLACE = "https://w3id.org/irtwin/id/place/Hall_Käfer"  # an individual whose IRI has a letter beyond ASCII


def robots(place: Path) -> list[Quad]:
    """Return what the mappings make of four robots, whose rows are in the workspace `place`."""
    with Workspace(place) as workspace:
        small_fleet.fill(workspace)
        with Session(workspace.engine) as session, session.begin():
            of_arm_c = schema.RunEnergy.run_id.like("Arm_C%")
            session.execute(
                update(schema.RunEnergy).where(of_arm_c).values(energy_from="mechanical", measured_energy_j=None)
            )
            session.execute(update(schema.RobotRow).where(schema.RobotRow.robot_id == "Arm_D").values(name=HOSTILE))
        quads = list(map_database(workspace.engine, MAPPINGS))
    label = Quad(NamedNode(PLACE), NamedNode(f"{RDFS}label"), Literal(HOSTILE), NamedNode(f"{GRAPH_SOURCE}place"))
    return [*quads, label]


def make_plant(place: Path) -> Path:
    """Make a workspace of four robots, with a tariff and a graph that was reasoned over; return the graph's folder."""
    (place / "plant.toml").write_text(TARIFF, encoding="utf-8")
    quads = robots(place)
    with KnowledgeGraph(place / "graph") as graph:
        graph.load_ontology()
        graph.replace(quads, GRAPH_SOURCE, GRAPH_ACTIVITY)
        reason(graph)
    return place / "graph"


def make_empty_plant(place: Path) -> Path:
    """Make a graph that knows the ontology and no robot, and return its folder."""
    with KnowledgeGraph(place / "graph") as graph:
        graph.load_ontology()
    return place / "graph"


def many(answers: Answers, times: int) -> Answers:
    """Return what would be answered of so many plants in one."""
    return {
        name: replace(answer, rows=tuple(_renamed(row, number) for number in range(times) for row in answer.rows))
        for name, answer in answers.items()
    }


def _renamed(row: Mapping[str, Any], number: int) -> dict[str, Any]:
    return {name: value.replace("Arm_", f"Arm_{number}_") if isinstance(value, str) else value
            for name, value in row.items()}  # fmt: skip
