"""Where the ontology, rules, shapes, mappings, questions and reports lie: those that ship, and what extends them.

What ships stands at the top of the source tree, for people who read it, and inside the package once it is installed.
It is extended by installed packages, each named by an entry point of the group `irtwin.extensions`, and after these by
the workspace's own folder. Both hold the folders of `KINDS`. A file replaces the one of the same name in the same
folder that came before; any other is added. Of a workspace's files only those that its user trusts hold.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cache
from importlib.metadata import entry_points
from importlib.util import find_spec
from pathlib import Path

from irtwin.errors import InputError
from irtwin.input_file import read_input, real_path
from irtwin.trust import trusted

GROUP = "irtwin.extensions"
MOST_BYTES, MOST_FILES = 10_000_000, 500  # of one file; of one extension

_PACKAGE = Path(__file__).parent
_SHIPPED, _WORKSPACE = "", "workspace"


@dataclass(frozen=True)
class Kind:
    """What a folder holds: endings of its files, in words for messages too, and where that which ships of it lies."""

    endings: tuple[str, ...]
    shipped: str
    pattern: str


KINDS = {
    "ontology": Kind((".ttl",), "ontology", "*.ttl"),
    "rules": Kind(("rules.ttl", ".swrl.ttl"), "rules", "*.ttl"),
    "shapes": Kind((".ttl",), "rules", "shapes.ttl"),
    "mappings": Kind((".r2rml.ttl",), "mappings", "*.r2rml.ttl"),
    "questions": Kind((".rq",), "knowledge/questions", "*.rq"),
    "reports": Kind((".rq", ".html.jinja", ".css"), "reports", "*/*"),
}
_NAME = re.compile(r"[A-Za-z0-9_~-][A-Za-z0-9_.~-]*")
_NO_EXTENSION = re.compile(
    r"\..*|.*~|README(\..*)?|catalog-v001\.xml|__init__\.py|__pycache__"
)  # editors leave the rest


@dataclass(frozen=True)
class Resource:
    """A file: of which folder, its name there, who brings it ("" ships, else "workspace" or a package and version).

    `replaces`: whether a file of its name came before. `checksum`: SHA-256 of what does not ship.
    """

    kind: str
    name: str
    path: Path
    origin: str = _SHIPPED
    replaces: bool = False
    checksum: str = ""

    @property
    def is_extension(self) -> bool:
        """Whether it does not ship."""
        return self.origin != _SHIPPED

    @property
    def is_of_workspace(self) -> bool:
        """Whether it stands in the workspace's own folder."""
        return self.origin == _WORKSPACE

    @property
    def asked(self) -> str:
        """Folder and name: by this the user trusts it."""
        return f"{self.kind}/{self.name}"

    def __str__(self) -> str:
        """Return folder and name, and who brings it if that is not irtwin: "rules/rules.ttl of irtwin-co2 0.1.0"."""
        return self.asked + (f" of {self.origin}" if self.is_extension else "")


Files = tuple[Resource, ...]


@dataclass(frozen=True)
class Resources:
    """All files that hold for a workspace, in the order of their folders and names.

    `left_aside`: the workspace's own that its user does not trust.
    """

    files: Files
    left_aside: Files = ()

    def of(self, kind: str, ending: str = "") -> Files:
        """Return the files of a folder whose names have an ending."""
        return tuple(file for file in self.files if file.kind == kind and file.name.endswith(ending))

    def paths(self, kind: str) -> list[Path]:
        """Return where the files of a folder lie."""
        return [file.path for file in self.of(kind)]

    def path(self, kind: str, name: str) -> Path:
        """Return where one file lies."""
        return next(file.path for file in self.files if (file.kind, file.name) == (kind, name))

    @property
    def extensions(self) -> Files:
        """The files that do not ship."""
        return tuple(file for file in self.files if file.is_extension)


def folder(name: str) -> Path:
    """Return the folder `ontology`, `rules`, `mappings`, `reports` or `demo`, as it ships."""
    installed = _PACKAGE / name
    return installed if installed.is_dir() else _PACKAGE.parents[1] / name


def guide() -> Path:
    """Return the first page of the guide: in the wheel, or where a checkout builds it. Raises InputError if neither."""
    for page in (_PACKAGE / "guide" / "index.html", _PACKAGE.parents[1] / "build" / "guide" / "index.html"):
        if page.is_file():
            return page
    raise InputError(f"{page}: not found; this is a checkout, where `make guide` builds the guide")


def resources_of(workspace: Path | None = None) -> Resources:
    """Return the files that hold for a workspace; without one, those that ship and those of installed packages.

    Raises InputError for a file that no folder takes, that is too large, or that lies outside.
    """
    if workspace is None:
        return _installed()
    own = _found(workspace, _WORKSPACE)
    if not own:
        return _installed()
    may = trusted(workspace)
    known = _joined(_installed(), (file for file in own if file.asked in may))
    return replace(known, left_aside=tuple(file for file in own if file.asked not in may))


@cache
def shipped() -> Resources:
    """Return the files that ship."""
    return Resources(
        tuple(
            Resource(kind, file.relative_to(place).as_posix(), file)
            for kind, holds in KINDS.items()
            for place in [folder(holds.shipped)]
            for file in sorted(place.glob(holds.pattern))
            if file.name.endswith((*holds.endings, ".js"))
        )
    )


@cache
def _installed() -> Resources:
    known, brought = shipped(), dict[str, str]()
    for point in sorted(entry_points(group=GROUP), key=lambda point: (point.value, point.name)):
        origin = f"{point.dist.name} {point.dist.version}" if point.dist else point.value
        spec = find_spec(point.value)
        if spec is None or not spec.submodule_search_locations:
            raise InputError(
                f"{origin}: its entry point {point.name} of {GROUP} names {point.value}, which is no package"
            )
        own = _found(Path(next(iter(spec.submodule_search_locations))), origin)
        for file in own:
            other = brought.setdefault(file.asked, origin)
            if other != origin:
                raise InputError(f"{file.path}: {other} brings {file.asked} too; take one of the packages out")
        known = _joined(known, own)
    return known


def _joined(known: Resources, added: Iterable[Resource]) -> Resources:
    files = {file.asked: file for file in known.files}
    for file in added:
        files[file.asked] = replace(file, replaces=file.asked in files)
    order = list(KINDS)
    return Resources(tuple(sorted(files.values(), key=lambda file: (order.index(file.kind), file.name))))


def _found(place: Path, origin: str) -> list[Resource]:
    """Return the files of an extension's folders."""
    files = []
    for kind in KINDS:
        for path, name in _files(place / kind, in_folders=kind == "reports"):
            real = real_path(path)
            if real is None or not real.is_relative_to(place.resolve()):
                raise InputError(f"{path}: leads outside {place}; put the file itself there")
            holds = KINDS[kind]
            if not (name.endswith(holds.endings) and all(map(_NAME.fullmatch, name.split("/")))):
                raise InputError(
                    f"{path}: {kind}/ takes files called NAME{' or NAME'.join(holds.endings)}, of letters, digits, "
                    "_, - and dots; rename it or take it out"
                )
            checksum = hashlib.sha256(read_input(path, MOST_BYTES)).hexdigest()
            files.append(Resource(kind, name, path, origin, checksum=checksum))
            if len(files) > MOST_FILES:
                raise InputError(f"{place}: has more than {MOST_FILES} files of extensions; join some of them")
    return files


def _files(place: Path, in_folders: bool) -> Iterator[tuple[Path, str]]:
    """Yield the files of a folder with their names, or those of its folders: what lies in `reports/` itself is made."""
    if not place.is_dir():
        return
    for path in sorted(place.iterdir()):
        if _NO_EXTENSION.fullmatch(path.name):
            continue
        if in_folders:
            yield from ((file, f"{path.name}/{name}") for file, name in _files(path, in_folders=False))
        else:
            yield path, path.name
