"""A plant for pages: the four robots of `small_fleet`, one known by mechanics alone, one with a hostile name."""

from __future__ import annotations

from pathlib import Path

from pyoxigraph import Literal, NamedNode, Quad, RdfFormat, parse, serialize
from sqlalchemy import update
from sqlalchemy.orm import Session

from irtwin.knowledge.mapping import map_database
from irtwin.knowledge.reasoning import reason
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_ACTIVITY, GRAPH_SOURCE, RDFS
from irtwin.resources import folder
from irtwin.storage import schema
from irtwin.storage.database import Workspace
from tests import small_fleet

HOSTILE = "=1+1\"><script>alert('x')</script>"


PLACE = "https://w3id.org/irtwin/id/place/Hall_Käfer"  # an individual whose IRI has a letter beyond ASCII


def fill(graph: KnowledgeGraph, place: Path, copies: int = 1) -> None:
    """Fill a graph with so many times four robots, whose rows are in the workspace `place`."""
    tell(graph, robots(place), copies)


def robots(place: Path) -> list[Quad]:
    """Return what the mappings make of four robots, whose rows are in the workspace `place`."""
    with Workspace(place) as workspace:
        small_fleet.fill(workspace)
        with Session(workspace.engine) as session, session.begin():
            of_arm_c = schema.RunEnergy.run_id.like("Arm_C%")
            session.execute(
                update(schema.RunEnergy).where(of_arm_c).values(energy_from="mechanical", measured_energy_j=None)
            )
            session.execute(update(schema.Robot).where(schema.Robot.robot_id == "Arm_D").values(name=HOSTILE))
        quads = list(map_database(workspace.engine, sorted(folder("mappings").glob("*.r2rml.ttl"))))
    label = Quad(NamedNode(PLACE), NamedNode(f"{RDFS}label"), Literal(HOSTILE), NamedNode(f"{GRAPH_SOURCE}place"))
    return [*quads, label]


def tell(graph: KnowledgeGraph, quads: list[Quad], copies: int) -> None:
    """Tell a graph the ontology, so many copies of the quads, and what it concludes."""
    graph.load_ontology()
    graph.replace((quad for number in range(copies) for quad in _renamed(quads, number)), GRAPH_SOURCE, GRAPH_ACTIVITY)
    reason(graph)


def make_plant(place: Path, copies: int = 1) -> Path:
    """Make a workspace's graph of so many times four robots, and return its folder."""
    quads = robots(place)
    with KnowledgeGraph(place / "graph") as graph:
        tell(graph, quads, copies)
    return place / "graph"


def make_empty_plant(place: Path) -> Path:
    """Make a graph that knows the ontology and no robot, and return its folder."""
    with KnowledgeGraph(place / "graph") as graph:
        graph.load_ontology()
    return place / "graph"


def _renamed(quads: list[Quad], number: int) -> list[Quad]:
    if number == 0:
        return quads
    text = serialize(quads, format=RdfFormat.N_QUADS)
    assert text is not None
    return list(parse(text.replace(b"Arm_", f"Arm_{number}_".encode()), format=RdfFormat.N_QUADS))
