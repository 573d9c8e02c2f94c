"""Meshes: found inside the data set alone, read in three formats, hostile ones refused, large ones made small."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from irtwin.errors import InputError
from irtwin.robot.meshes import find_mesh, read_mesh, read_mesh_file, simplified

BALL = trimesh.creation.icosphere(subdivisions=3, radius=0.1)


def written(kind: str) -> bytes:
    content = BALL.export(file_type=kind)
    return content.encode() if isinstance(content, str) else content


@pytest.mark.parametrize("kind", ["stl", "stl_ascii", "obj", "dae"])
def test_a_mesh_is_read_as_it_is(kind: str) -> None:
    mesh = read_mesh(written(kind), f".{kind.partition('_')[0].upper()}", "ball")
    assert mesh.faces.shape == (1280, 3) and len(mesh.points) == 642
    np.testing.assert_allclose(np.linalg.norm(mesh.points, axis=1), 0.1, atol=1e-6)


def test_a_dae_has_a_unit() -> None:
    content = written("dae").replace(b"<asset>", b'<asset><unit meter="0.001" name="millimeter"/>')
    assert np.abs(read_mesh(content, ".dae", "ball").points).max() == pytest.approx(1e-4, rel=1e-3)


@pytest.mark.parametrize("most", [100, 500])
def test_a_simplified_mesh_looks_the_same(most: int) -> None:
    few = simplified(read_mesh(written("stl"), ".stl", "ball"), most)
    assert len(few.faces) <= most
    assert few.faces.max() == len(few.points) - 1
    np.testing.assert_allclose(np.linalg.norm(few.points, axis=1), 0.1, rtol=0.1)


def test_triangles_that_touch_nowhere_are_thinned_out() -> None:
    rng = np.random.default_rng(0)
    corners = rng.uniform(-1, 1, (3000, 1, 3)) + rng.uniform(0, 0.01, (3000, 3, 3))
    loose = trimesh.Trimesh(corners.reshape(-1, 3), np.arange(9000).reshape(-1, 3), process=False)
    few = simplified(read_mesh(loose.export(file_type="stl"), ".stl", "loose"), 200)
    assert 0 < len(few.faces) <= 400


def place(folder: Path, *names: str) -> None:
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(written("stl"))


@pytest.mark.parametrize(
    ("name", "found"),
    [
        ("package://arm/meshes/a.stl", "urdf/arm/meshes/a.stl"),
        ("package://other/b.stl", "b.stl"),
        ("meshes/c.stl", "urdf/meshes/c.stl"),
        ("../d.stl", "d.stl"),
        ("urdf/e.stl", "urdf/e.stl"),
        ("file://b.stl", "b.stl"),
    ],
)
def test_a_mesh_is_found_in_the_data_set(tmp_path: Path, name: str, found: str) -> None:
    place(tmp_path, "urdf/arm/meshes/a.stl", "b.stl", "urdf/meshes/c.stl", "d.stl", "urdf/e.stl")
    assert find_mesh(name, tmp_path, tmp_path / "urdf") == (tmp_path / found).resolve()


@pytest.mark.parametrize(
    "name", ["../secret.stl", "package://arm/../../secret.stl", "link.stl", "package://x/link.stl", "{}/secret.stl"]
)
def test_no_mesh_is_taken_from_outside(tmp_path: Path, name: str) -> None:
    inside = tmp_path / "inside"
    place(tmp_path, "secret.stl", "inside/own.stl")
    (inside / "link.stl").symlink_to(tmp_path / "secret.stl")
    with pytest.raises(InputError, match="leads outside the data set; copy the file into it"):
        find_mesh(name.format(tmp_path), inside, inside)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("package://arm/none.stl", "is not in the data set; copy the file into it"),
        ("http://example.org/a.stl", "is not fetched; copy it into the data set"),
        ("", "is not in the data set"),
        ("a\0b", "is not fetched"),
        ("x" * 5000, "is not in the data set"),
        ("ring", "is not in the data set"),
    ],
)
def test_a_mesh_that_is_not_there_is_said(tmp_path: Path, name: str, message: str) -> None:
    (tmp_path / "ring").symlink_to(tmp_path / "ring")
    with pytest.raises(InputError, match=message):
        find_mesh(name, tmp_path, tmp_path)


BOMB = b'<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa">]><COLLADA>&a;</COLLADA>'


@pytest.mark.parametrize(
    ("content", "suffix", "message"),
    [
        (b"", ".stl", "holds no triangles"),
        (b"solid x\nendsolid", ".stl", "no mesh that can be read|holds no triangles"),
        (written("stl")[:-7], ".stl", "no mesh that can be read"),
        (b"\xff\xfe" + written("obj"), ".obj", "no mesh that can be read"),
        (b"v 0 0 0\nv 1 0 0\nv nan 0 0\nf 1 2 3\n", ".obj", "holds no triangles of finite size"),
        (b"v 0 0 0\nf 1 2 999999\n", ".obj", "no mesh that can be read|holds no triangles"),
        (BOMB, ".dae", "is no DAE that can be read"),
        (written("dae").replace(b"<node ", b"<instance_node/><node ", 1), ".dae", "repeats its parts by instances"),
        (written("obj") + b"usemtl a\nf 1 2 3\n" * 1001, ".obj", "has more than 1000 groups or materials"),
        (written("dae").replace(b"<asset>", b'<asset><unit meter="x"/>'), ".dae", "its unit of 'x' m is no number"),
        (b"v 0 0\nv 1 0\nv 0 1\nf 1 2 3\n", ".obj", "no mesh that can be read|holds no triangles"),
        (b"PK", ".zip", "a mesh as .zip is not read; use STL, OBJ or DAE"),
        (b"x", "", "a mesh as a file without an ending is not read"),
    ],
)
def test_what_is_no_mesh_is_refused(content: bytes, suffix: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        read_mesh(content, suffix, "here")


def test_a_file_too_large_is_refused(tmp_path: Path) -> None:
    with (tmp_path / "large.stl").open("wb") as file:
        file.truncate(20_000_001)
    with pytest.raises(InputError, match="larger than the 20 MB limit"):
        read_mesh_file(tmp_path / "large.stl")


@pytest.mark.slow
@settings(max_examples=60)
@given(st.sampled_from(["stl", "stl_ascii", "obj", "dae"]), st.data())
def test_a_damaged_mesh_is_read_or_refused(kind: str, data: st.DataObject) -> None:
    content = bytearray(written(kind))
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(content) - 1))
        gone = data.draw(st.integers(0, 500))
        content[at : at + gone] = data.draw(st.sampled_from([b"", b"1e999", b"nan", b"\xff", b"</", b"99999999"]))
    try:
        mesh = simplified(read_mesh(bytes(content), f".{kind.partition('_')[0]}", "here"), 100)
    except InputError:
        return
    assert np.isfinite(mesh.points).all() and mesh.faces.max() < len(mesh.points)
