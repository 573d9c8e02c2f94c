"""The meshes of a robot: copied from its data set into the workspace, and read again as the graph names them."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from irtwin.errors import InputError
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.robot.meshes import Mesh, find_mesh, read_mesh, read_mesh_file
from irtwin.robot.structure import structure_of
from irtwin.signals.log import DataSet
from irtwin.storage.database import MESHES
from irtwin.storage.files import read_document

_MESHES = """SELECT DISTINCT ?mesh ?file ?checksum {
  ?shape irt:shape_of / irt:link_of ?arm ; irt:Mesh ?mesh ; irt:File ?file ; irt:Checksum ?checksum .
}"""


@dataclass(frozen=True)
class MeshCopy:
    """A mesh's file in the workspace: path, SHA-256, content."""

    path: str
    sha256: str
    content: bytes


def mesh_copies(data_set: DataSet) -> tuple[dict[str, MeshCopy], list[str]]:
    """Return the meshes that a data set's robot names, by that name, and a line for each that cannot be drawn."""
    copies: dict[str, MeshCopy] = {}
    undrawn = []
    beside = data_set.folder if data_set.urdf is None else data_set.urdf.parent
    solids = structure_of(data_set.robot).solids if data_set.robot.urdf else ()  # a meter's log has none
    for name in dict.fromkeys(solid.file for solid in solids if solid.file is not None):
        try:
            file = find_mesh(name, data_set.folder, beside)
            content = read_mesh_file(file)
        except InputError as error:
            undrawn.append(f"{error}; shapes stand in for it")
            continue
        sha256 = hashlib.sha256(content).hexdigest()
        copies[name] = MeshCopy(f"{MESHES}/{sha256}{file.suffix.lower()}", sha256, content)
    return copies, undrawn


def meshes_of_graph(graph: KnowledgeGraph, robot_iri: str, workspace: Path) -> Mapping[str, Mesh]:
    """Return a robot's meshes by the names that its description gives them, from the files that the graph names."""
    copies = mesh_copies_of_graph(graph, robot_iri, workspace)
    return {name: read_mesh(copy.content, Path(copy.path).suffix, copy.path) for name, copy in copies.items()}


def mesh_copies_of_graph(graph: KnowledgeGraph, robot_iri: str, workspace: Path) -> Mapping[str, MeshCopy]:
    """Return the files that a graph names of a robot's meshes, by the names that its description gives them."""
    rows = graph.query(_MESHES, {"arm": robot_iri}).rows
    named = [(row["mesh"], row["file"], row["checksum"]) for row in rows]
    return {mesh: MeshCopy(path, sha256, read_document(workspace, path, sha256)) for mesh, path, sha256 in named}
