"""Graphs of the ontology and of what the mappings that ship make of a workspace's rows, and what they say."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pyoxigraph import CanonicalizationAlgorithm, Dataset, Quad

from irtwin.knowledge.mapping import map_database
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_ACTIVITY, GRAPH_SOURCE
from irtwin.resources import folder
from irtwin.storage.database import Workspace

MAPPINGS = sorted(folder("mappings").glob("*.r2rml.ttl"))


def map_into(graph: KnowledgeGraph, workspace: Workspace, mappings: Sequence[Path] = MAPPINGS) -> KnowledgeGraph:
    """Put what the mappings make of the rows in place of what sources said, and return the graph."""
    graph.replace(map_database(workspace.engine, mappings), GRAPH_SOURCE, GRAPH_ACTIVITY)
    return graph


def said(graph: KnowledgeGraph, *but: str) -> set[Quad]:
    """Return what a graph says, some graphs left out, whatever its blank nodes are called."""
    found = Dataset(quad for quad in graph.quads() if quad.graph_name.value not in but)  # type: ignore[union-attr]
    found.canonicalize(CanonicalizationAlgorithm.UNSTABLE)
    return set(found)


def ontology_graph(workspace: Path | None = None) -> KnowledgeGraph:
    """Return a graph in memory that holds the ontology alone, with the tariff of a workspace's folder."""
    graph = KnowledgeGraph(workspace=workspace)
    graph.load_ontology()
    return graph
