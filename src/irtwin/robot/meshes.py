"""Meshes that a robot description names: found inside its data set, read as hostile input, made small to be drawn."""

from __future__ import annotations

import io
import logging
import re
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from xml.etree.ElementTree import Element, ParseError

import numpy as np
from defusedxml import DefusedXmlException
from defusedxml import ElementTree as SafeXml

from irtwin.errors import InputError, first_line
from irtwin.input_file import read_input, real_path

FORMATS = (".stl", ".obj", ".dae")
LARGEST = 20_000_000  # bytes of a file
_MOST_INSTANCES = 200  # of geometry in a DAE: a small file could name a large one without end
_MOST_GROUPS = 1000  # of an OBJ by material, object or group: each becomes a mesh that the others are joined to
_OBJ_GROUP = re.compile(rb"^\s*(?:usemtl|o|g)\s", re.MULTILINE)
_COLLADA = "{http://www.collada.org/2005/11/COLLADASchema}"
# what trimesh and pycollada raise on bytes that are no mesh
_DAMAGED = (ValueError, KeyError, IndexError, TypeError, AttributeError, AssertionError, OverflowError, EOFError)


@dataclass(frozen=True)
class Mesh:
    """Triangles: points (V, 3) m, faces (F, 3) rows of `points`."""

    points: np.ndarray
    faces: np.ndarray


def find_mesh(name: str, folder: Path, beside: Path) -> Path:
    """Return the file that a robot description means by a mesh's name, inside a data set's folder.

    `package://PACKAGE/PATH` is PACKAGE/PATH or PATH in `beside`, where the description lies, or in `folder`; any other
    name is a path in one of them. Raises InputError where there is none, or only one outside the folder.
    """
    scheme, _, rest = name.rpartition("://")
    if scheme not in ("", "package", "file") or "\0" in name:
        raise InputError(f'mesh "{_shown(name)}" is not fetched; copy it into the data set, and name it by a path')
    path = PurePosixPath(rest)
    paths = [path, PurePosixPath(*path.parts[1:])] if scheme == "package" else [path]
    inside, outside = folder.resolve(), False
    for mesh in (base / relative for base in (beside, folder) for relative in paths):
        real = real_path(mesh)
        if real is not None and real.is_relative_to(inside) and real.is_file():
            return real
        outside |= real is not None and not real.is_relative_to(inside)
    if outside:
        raise InputError(f'mesh "{_shown(name)}" leads outside the data set; copy the file into it')
    raise InputError(f'mesh "{_shown(name)}" is not in the data set; copy the file into it')


def read_mesh_file(path: Path) -> bytes:
    """Return a mesh file's content once it was read as a mesh. Raises InputError."""
    content = read_input(path, LARGEST)
    read_mesh(content, path.suffix, str(path))
    return content


def read_mesh(content: bytes, suffix: str, where: str) -> Mesh:
    """Read a mesh of a file's bytes, in m as the format says. Raises InputError where it is none."""
    import trimesh  # not above: half a second, and only robots with meshes need it

    kind = suffix.lower()
    if kind not in FORMATS:
        raise InputError(f"{where}: a mesh as {suffix or 'a file without an ending'} is not read; use STL, OBJ or DAE")
    if kind == ".obj" and len(_OBJ_GROUP.findall(content)) > _MOST_GROUPS:
        raise InputError(f"{where}: has more than {_MOST_GROUPS} groups or materials; export it as one mesh")
    metres = _check_collada(content, where) if kind == ".dae" else 1.0
    logging.getLogger("trimesh").setLevel(logging.CRITICAL)  # what it has to say of bad files is said below
    try:
        if kind == ".obj" or (kind == ".stl" and not _is_binary(content)):
            content.decode()  # else trimesh would guess the encoding
        with np.errstate(all="ignore"):  # sizes are checked below
            read = trimesh.load_scene(io.BytesIO(content), file_type=kind[1:], resolver=None).to_mesh()
            points, faces = np.asarray(read.vertices, float) * metres, np.asarray(read.faces, np.int64)
    except _DAMAGED as error:
        raise InputError(f"{where}: is no mesh that can be read ({first_line(error)}); export it again") from error
    in_space = points.shape[1:] == (3,)  # a damaged OBJ file may hold pairs
    if not len(faces) or not in_space or not np.isfinite(points).all() or np.abs(points).max() > 1e6:
        raise InputError(f"{where}: holds no triangles of finite size; export it again")
    return Mesh(points, faces)


def simplified(mesh: Mesh, most: int) -> Mesh:
    """Return a mesh of at most about `most` triangles that looks like this one."""
    if len(mesh.faces) <= most:
        return mesh
    import fast_simplification  # not above, as trimesh

    centre = mesh.points.mean(axis=0)  # single precision needs it near zero
    points, faces = fast_simplification.simplify(
        (mesh.points - centre).astype(np.float32), mesh.faces.astype(np.int32), target_count=most
    )
    if not 0 < len(faces) <= 2 * most:  # loose triangles have no edge that could be drawn in
        faces = faces[:: -(-len(faces) // most)] if len(faces) else mesh.faces[:: -(-len(mesh.faces) // most)]
    used, places = np.unique(faces, return_inverse=True)
    return Mesh(points[used].astype(float) + centre, places.reshape(-1, 3))


def _is_binary(stl: bytes) -> bool:
    return len(stl) >= 84 and len(stl) == 84 + 50 * int.from_bytes(stl[80:84], "little")


def _check_collada(content: bytes, where: str) -> float:
    """Hold a DAE to be one without entities and endless repetition; return its unit, m."""
    try:
        root: Element = SafeXml.fromstring(content, forbid_dtd=True)
    except (ParseError, DefusedXmlException, LookupError, ValueError) as error:
        raise InputError(f"{where}: is no DAE that can be read ({first_line(error)}); export it again") from error
    instances = len(root.findall(f".//{_COLLADA}instance_geometry"))
    if root.find(f".//{_COLLADA}instance_node") is not None or instances > _MOST_INSTANCES:
        raise InputError(f"{where}: repeats its parts by instances; export it as one mesh")
    unit = root.find(f"{_COLLADA}asset/{_COLLADA}unit")
    metres = "1" if unit is None else unit.get("meter", "1")
    try:
        return float(metres)
    except ValueError as error:
        raise InputError(f"{where}: its unit of {metres[:40]!r} m is no number; export it again") from error


def _shown(name: str) -> str:
    return name[:200].replace("\0", "\\0")
