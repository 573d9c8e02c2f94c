"""Meshes from the data set through workspace and graph to the scene."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np
import pytest
from tests import mesh_robots
from tests.mapped import map_into
from tests.mesh_robots import ARM, HAND, SLIDE

from irtwin.errors import InputError
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.providers.mesh_files import mesh_copies, meshes_of_graph
from irtwin.providers.names import robot_iri
from irtwin.providers.records import ingest
from irtwin.robot.meshes import Mesh
from irtwin.storage.database import Workspace
from irtwin.storage.staging import staged


def meshes_in(workspace: Workspace) -> dict[str, Mesh]:
    return dict(meshes_of_graph(map_into(KnowledgeGraph(), workspace), robot_iri("Meshed"), workspace.folder))


def stored(workspace: Workspace) -> list[Path]:
    return sorted((workspace.folder / "meshes").glob("[!.]*"))


def test_copies_are_the_files_and_each_that_is_missing_is_said(tmp_path: Path) -> None:
    copies, said = mesh_copies(mesh_robots.write(tmp_path))
    assert set(copies) == {SLIDE, ARM}
    content = (tmp_path / "parts" / "arm.dae").read_bytes()
    sha256 = hashlib.sha256(content).hexdigest()
    assert (copies[ARM].path, copies[ARM].sha256, copies[ARM].content) == (f"meshes/{sha256}.dae", sha256, content)
    assert said == [f'mesh "{HAND}" is not in the data set; copy the file into it; shapes stand in for it']


def test_the_graph_gives_back_the_meshes_without_the_data_set(tmp_path: Path) -> None:
    data_set = mesh_robots.write(tmp_path / "data")
    with Workspace(tmp_path / "w") as workspace:
        lines: list[str] = []
        assert ingest(workspace, data_set, lines.append) == "new"
        assert len(lines) == 1
        assert ingest(workspace, data_set) == "unchanged"
        (tmp_path / "data").rename(tmp_path / "elsewhere")
        meshes = meshes_in(workspace)
        assert set(meshes) == {SLIDE, ARM}
        np.testing.assert_allclose(np.ptp(meshes[SLIDE].points, axis=0), (150, 150, 400))
        assert len(meshes[ARM].faces) > 100


def test_a_mesh_that_was_changed_replaces_the_old_one(tmp_path: Path) -> None:
    data_set = mesh_robots.write(tmp_path / "data")
    with Workspace(tmp_path / "w") as workspace:
        with staged(workspace, "Meshed") as apart:
            ingest(apart, data_set)
        before = stored(workspace)
        assert len(before) == 2
        (tmp_path / "data" / "parts" / "arm.dae").unlink()
        with staged(workspace, "Meshed") as apart:
            assert ingest(apart, data_set) == "replaced"
        assert len(stored(workspace)) == 1
        workspace.drop_robot("Meshed")
        assert stored(workspace) == []


def test_a_damaged_copy_is_said_and_mended_by_the_data_set(tmp_path: Path) -> None:
    data_set = mesh_robots.write(tmp_path / "data")
    with Workspace(tmp_path / "w") as workspace:
        ingest(workspace, data_set)
        stored(workspace)[0].write_bytes(b"other")
        with pytest.raises(InputError, match="was changed after it was written; run or diagnose its data set again"):
            meshes_in(workspace)
        assert ingest(workspace, data_set) == "replaced"
        assert len(meshes_in(workspace)) == 2
