"""A model's file of XML: read without reaching outside its folder, and changed in single numbers."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice, takewhile
from pathlib import Path
from typing import TYPE_CHECKING
from xml.parsers import expat

from irtwin.errors import InputError
from irtwin.input_file import as_text, read_input, real_path
from irtwin.robot.xml_elements import outermost

if TYPE_CHECKING:
    import mujoco

_MOST = 20_000_000  # bytes
_IN_URDF = {"damping": "damping", "frictionloss": "friction"}  # of <dynamics>, by what MJCF calls them
_FOLDERS = {"mesh": "meshdir", "hfield": "meshdir", "skin": "meshdir", "texture": "texturedir"}


@dataclass(frozen=True, eq=False)
class Tag:
    """A start tag: its element, attributes, and the bytes of the file that it takes; none where it is yet to come."""

    element: str
    attributes: Mapping[str, str]
    start: int
    stop: int


@dataclass(frozen=True)
class ModelFile:
    """The file's bytes and its start tags, in their order; files that it includes are not among them."""

    path: Path
    content: bytes
    tags: tuple[Tag, ...]

    def changed(self, changes: Mapping[Tag, Mapping[str, float | str | None]]) -> bytes:
        """Return the file with attributes of tags changed; all else stays, byte for byte.

        A number takes the place of the first one of several, a text that of all, None takes the attribute out. The key
        "" gives the element another name.
        """
        content = self.content
        for tag in sorted(changes, key=lambda one: -one.start):  # from behind: places before stay right
            text, after = content[tag.start : tag.stop] or f"<{tag.element}/>".encode(), content[tag.stop :]
            for attribute, value in changes[tag].items():
                if attribute:
                    text = _with_attribute(text, attribute, repr(value) if isinstance(value, float) else value)
                else:
                    text = text.replace(f"<{tag.element}".encode(), f"<{value}".encode(), 1)
                    if not text.endswith(b"/>"):
                        after = after.replace(f"</{tag.element}".encode(), f"</{value}".encode(), 1)
            content = content[: tag.start] + text + after
        return content

    def tag(self, elements: Sequence[str], key: str, value: str) -> Tag:
        """Return the tag of one of some elements with an attribute's value.

        Raises InputError where the file has none of its own: an included file may have it.
        """
        for one in self.tags:
            if one.element in elements and one.attributes.get(key) == value:
                return one
        raise InputError(
            f'{self.path}: has no <{elements[0]} {key}="{value}"> of its own; give the file that defines it'
        )

    @property
    def is_urdf(self) -> bool:
        """Whether it is a URDF."""
        return any(tag.element == "robot" for tag in self.tags[:1])

    def holds(self, number: str) -> bool:
        """Return whether it has a place for a number, by what MJCF calls it."""
        return not self.is_urdf or number in _IN_URDF

    def check_written(self, out: Path) -> None:
        """Raise InputError where it cannot be written to another file."""

    def spec(self) -> mujoco.MjSpec:
        """Return MuJoCo's specification of it. Raises ValueError or mujoco.FatalError where MuJoCo refuses it."""
        import mujoco

        return mujoco.MjSpec.from_file(str(self.path))

    def number(self, joint: str, number: str) -> tuple[Tag, str]:
        """Return the tag and the attribute that hold a joint's number."""
        own = self.tag(["joint"], "name", joint)
        if not self.is_urdf:
            return own, number
        after = self.tags[self.tags.index(own) + 1 :]
        return next(one for one in after if one.element == "dynamics"), _IN_URDF[number]

    def inertial(self, body: str) -> Tag | None:
        """Return the tag of a body's own inertial, None where the file has none: included, or taken from geoms."""
        of = ""
        for one in self.tags:
            of = one.attributes.get("name", "") if one.element == "body" else of
            if one.element == "inertial" and of == body:
                return one
        return None


def read_xml(path: Path) -> ModelFile:
    """Read the XML of a model file. Raises InputError where it is none, declares a document type, or is over 20 MB."""
    content = read_input(path, _MOST)
    as_text(path, content)  # what is changed is sought byte by byte
    try:
        whole = outermost(content)
    except expat.ExpatError as error:
        reason = expat.ErrorString(error.code)
        raise InputError(f"{path}, line {error.lineno}, column {error.offset + 1}: {reason}; mend the XML") from error
    except ValueError as error:
        raise InputError(f"{path}, {error}") from error
    return ModelFile(path, content, tuple(Tag(one.tag, one.attributes, one.start, one.inside) for one in whole.walk()))


def with_dynamics(file: ModelFile) -> ModelFile:
    """Return a URDF with a tag of <dynamics> that is yet to come in each joint that has none."""
    tags: list[Tag] = []
    for place, tag in enumerate(file.tags):
        tags.append(tag)
        if tag.element == "joint":
            inside = takewhile(lambda one: one.element not in ("joint", "link"), islice(file.tags, place + 1, None))
            if not any(one.element == "dynamics" for one in inside):
                tags.append(Tag("dynamics", {}, tag.stop, tag.stop))
    return replace(file, tags=tuple(tags))


def check_inside(file: ModelFile, folder: Path, seen: dict[Path, None]) -> None:
    """Raise InputError where a file, or one that it includes, names one outside the folder of the model."""
    seen[file.path] = None
    folders: dict[str, str] = {}
    for tag in file.tags:
        if tag.element == "compiler":
            folders |= {"meshdir": tag.attributes.get("assetdir", ""), "texturedir": tag.attributes.get("assetdir", "")}
            folders |= {key: tag.attributes[key] for key in ("meshdir", "texturedir") if key in tag.attributes}
    for element, named in _files(file):
        place = folder / folders.get(_FOLDERS.get(element, ""), "") / named
        real = real_path(place)
        if real is None or not real.is_relative_to(folder.resolve()):
            raise InputError(
                f'{file.path}: <{element} file="{named}"> is outside the folder of the model; move it there'
            )
        if element == "include" and place not in seen:
            check_inside(read_xml(place), folder, seen)


def _files(file: ModelFile) -> Iterator[tuple[str, str]]:
    for tag in file.tags:
        for key, value in tag.attributes.items():
            if key.startswith("file") and value:
                yield tag.element, value


def _with_attribute(tag: bytes, name: str, value: str | None) -> bytes:
    """Return a start tag with an attribute's value changed, with the attribute added, or without it."""
    whole = re.compile(rb"(\s" + name.encode() + rb"\s*=\s*)([\"']).*?\2", re.DOTALL)
    if value is None:
        return whole.sub(b"", tag, count=1)
    several = " " in value
    said = re.compile(rb"(\s" + name.encode() + rb"\s*=\s*[\"']\s*)" + (rb"[^\"']+" if several else rb"[^\s\"']+"))
    if said.search(tag):  # of several numbers the first one: those after it are of higher powers
        return said.sub(lambda match: match[1] + value.encode(), tag, count=1)
    end = -2 if tag.endswith(b"/>") else -1
    return tag[:end].rstrip() + f' {name}="{value}"'.encode() + tag[end:]
