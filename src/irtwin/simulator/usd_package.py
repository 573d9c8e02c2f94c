"""A package of USD files, `.usdz`: looked through before it is read, and packed anew under another layer."""

from __future__ import annotations

import posixpath
import tempfile
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pxr import Sdf

from irtwin.errors import InputError

PACKAGE = ".usdz"
_LAYERS = (".usd", ".usda", ".usdc")
_MOST = 1000  # files: each is sought among all


def check_package(path: Path) -> tuple[str, ...]:
    """Return the names of a package's files, that which it opens with first; look through the layers that it loads.

    Raises InputError where it holds no USD, or what USD does not allow there, and where a layer names a file that is
    not in it: USD would look for that elsewhere.
    """
    archive = Sdf.ZipFile.Open(str(path))
    names = tuple(archive.GetFileNames() if archive else ())
    if not names or not names[0].lower().endswith(_LAYERS):
        raise InputError(f"{path}: is no package of USD; its first file is to be a USD file, as `usdzip` packs it")
    if len(names) > _MOST:
        raise InputError(f"{path}: holds {len(names)} files, more than {_MOST}; pack those alone that the robot needs")
    counts = Counter(map(posixpath.normpath, names))
    for name in names:
        if counts[posixpath.normpath(name)] > 1 or not _is_inside(name):
            raise InputError(f"{path}: holds {name!r} twice, or outside itself; pack it anew, as `usdzip` does")
        about = archive.GetFileInfo(name)
        if about.compressionMethod or about.encrypted:
            raise InputError(f"{path}: holds {name} compressed or encrypted; pack it anew, as `usdzip` does")
    _check_layer(path, names[0], {posixpath.normpath(name): name for name in names}, set())
    return names


def packed(path: Path, names: Sequence[str], layer: Path) -> bytes:
    """Return the package with a layer, of the file's name, put before its files, which stay as they are."""
    archive = Sdf.ZipFile.Open(str(path))
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder, "whole.usdz")
        writer = Sdf.ZipFileWriter.CreateNew(str(out))
        _add(writer, layer, layer.name)
        for number, name in enumerate(names):  # by number: no name of an archive becomes one on the disk
            own = Path(folder, str(number))
            own.write_bytes(archive.GetFile(name))
            _add(writer, own, name)
        writer.Save()
        return out.read_bytes()


def new_name(names: Sequence[str]) -> str:
    """Return a name for a layer that no file of a package has."""
    return next(name for k in range(len(names) + 1) if (name := f"changed_{k + 1}.usda") not in names)


def _add(writer: Any, file: Path, name: str) -> None:
    if writer.AddFile(str(file), name) != name:
        raise InputError(f"{name}: cannot be the name of a file in a package; give it another")


def _is_inside(name: str) -> bool:
    return not name.startswith("/") and "\\" not in name and ".." not in name.split("/") and name.isprintable()


def _check_layer(path: Path, layer: str, inside: dict[str, str], seen: set[str]) -> None:
    """Look through the files that a layer names, and that these name."""
    seen.add(layer)
    for named in Sdf.Layer.FindOrOpen(f"{path}[{layer}]").GetCompositionAssetDependencies():
        name = inside.get(posixpath.normpath(posixpath.join(posixpath.dirname(layer), named)))
        if name is None or not name.lower().endswith(_LAYERS):
            raise InputError(f"{path}: {layer} names {named}, which is no USD file in the package; pack it with that")
        if name not in seen:
            _check_layer(path, name, inside, seen)
