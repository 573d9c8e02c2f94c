"""A model's file of XML: read without reaching outside its folder, and changed in single numbers."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar
from xml.parsers import expat

import pinocchio as pin

from irtwin.errors import InputError
from irtwin.input_file import as_text, read_input, real_path
from irtwin.robot import mjcf_text, urdf_text
from irtwin.robot.xml_elements import Element, outermost, with_child
from irtwin.simulator.engine import mujoco

_MOST = 20_000_000  # bytes
IN_DYNAMICS = {"damping": "damping", "frictionloss": "friction"}  # of URDF and SDF, by what MJCF calls them
_FOLDERS = {"mesh": "meshdir", "hfield": "meshdir", "skin": "meshdir", "texture": "texturedir"}


Changes = Mapping[Element, Mapping[str, float | str | None]]
Bodies = Mapping[str, pin.Inertia]
"""Bodies by name, each in its own frame."""


@dataclass(frozen=True)
class ModelFile:
    """The file's bytes and its elements, in their order; those of files that it includes are not among them."""

    path: Path
    content: bytes
    elements: tuple[Element, ...]
    damps_error: ClassVar[bool] = False  # whether its servos damp how fast the error changes, not how the joint moves

    def changed(self, changes: Changes, bodies: Bodies | None = None) -> bytes:
        """Return the file with attributes of elements, and bodies, changed; all else stays, byte for byte.

        A number takes the place of the first one of several, a text that of all, None takes the attribute out. The key
        "" gives the element another name.
        """
        return self._with_bodies(self._with_numbers(changes), bodies or {})

    def _with_numbers(self, changes: Changes) -> bytes:
        content = self.content
        for own in sorted(changes, key=lambda element: -element.start):  # from behind: places before stay right
            text, after = content[own.start : own.inside] or f"<{own.tag}/>".encode(), content[own.inside :]
            for attribute, value in changes[own].items():
                if attribute:
                    text = _with_attribute(text, attribute, repr(value) if isinstance(value, float) else value)
                else:
                    text = text.replace(f"<{own.tag}".encode(), f"<{value}".encode(), 1)
                    if not text.endswith(b"/>"):
                        after = after.replace(f"</{own.tag}".encode(), f"</{value}".encode(), 1)
            content = content[: own.start] + text + after
        return content

    def _with_bodies(self, content: bytes, bodies: Bodies) -> bytes:
        for name, body in bodies.items():
            element = next(own for own in outermost(content).walk() if _is_body(own, name))
            content = with_child(content, element, "inertial", self._inertial(body))
        return content

    def _inertial(self, body: pin.Inertia) -> str:
        if self.is_urdf:
            return urdf_text.inertial(body)
        attributes = (f'{name}="{value}"' for name, value in mjcf_text.inertial(body).items())
        return f"<inertial {' '.join(attributes)}/>"

    def holds_body(self, name: str) -> bool:
        """Return whether a body is the file's own, and has the inertia that the file says."""
        compilers = [element.attributes for element in self.elements if element.tag == "compiler"]
        otherwise = any(own.get("inertiafromgeom") == "true" or "settotalmass" in own for own in compilers)
        return not otherwise and any(_is_body(element, name) for element in self.elements)

    def element(self, tags: Sequence[str], key: str, value: str) -> Element:
        """Return the element of one of some tags with an attribute's value.

        Raises InputError where the file has none of its own: an included file may have it.
        """
        for element in self.elements:
            if element.tag in tags and element.attributes.get(key) == value:
                return element
        raise InputError(f'{self.path}: has no <{tags[0]} {key}="{value}"> of its own; give the file that defines it')

    @property
    def is_urdf(self) -> bool:
        """Whether it is a URDF."""
        return any(element.tag == "robot" for element in self.elements[:1])

    def holds(self, number: str) -> bool:
        """Return whether it has a place for a number, by what MJCF calls it."""
        return not self.is_urdf or number in IN_DYNAMICS

    def check_written(self, out: Path) -> None:
        """Raise InputError where it cannot be written to another file."""

    def spec(self) -> mujoco.MjSpec:
        """Return MuJoCo's specification of it. Raises ValueError or mujoco.FatalError where MuJoCo refuses it."""
        return mujoco.MjSpec.from_file(str(self.path))

    def number(self, joint: str, number: str) -> tuple[Element, str]:
        """Return the element and the attribute that hold a joint's number."""
        own = self.element(["joint"], "name", joint)
        if not self.is_urdf:
            return own, number
        dynamics = own.child("dynamics")
        if dynamics is None:
            dynamics = Element("dynamics", {}, own.inside, own.inside)  # yet to come
            own.children.append(dynamics)
        return dynamics, IN_DYNAMICS[number]

    def inertial(self, body: str) -> Element | None:
        """Return a body's own inertial, None where the file has none: included, or taken from geoms."""
        own = (element for element in self.elements if element.tag == "body" and element.attributes.get("name") == body)
        return next((element.child("inertial") for element in own), None)


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
    return ModelFile(path, content, tuple(whole.walk()))


def check_inside(file: ModelFile, folder: Path, seen: dict[Path, None]) -> None:
    """Raise InputError where a file, or one that it includes, names one outside the folder of the model."""
    seen[file.path] = None
    folders: dict[str, str] = {}
    for node in file.elements:
        if node.tag == "compiler":
            folders |= dict.fromkeys(("meshdir", "texturedir"), node.attributes.get("assetdir", ""))
            folders |= {key: node.attributes[key] for key in ("meshdir", "texturedir") if key in node.attributes}
    for element, named in _files(file):
        place = folder / folders.get(_FOLDERS.get(element, ""), "") / named
        real = real_path(place)
        if real is None or not real.is_relative_to(folder.resolve()):
            raise InputError(
                f'{file.path}: <{element} file="{named}"> is outside the folder of the model; move it there'
            )
        if element == "include" and place not in seen:
            check_inside(read_xml(place), folder, seen)


def _is_body(element: Element, name: str) -> bool:
    return element.tag in ("body", "link") and element.attributes.get("name") == name


def _files(file: ModelFile) -> Iterator[tuple[str, str]]:
    for element in file.elements:
        for key, value in element.attributes.items():
            if key.startswith("file") and value:
                yield element.tag, value


def _with_attribute(tag: bytes, name: str, value: str | None) -> bytes:
    """Return a start tag with an attribute's value changed, with the attribute added, or without it."""
    whole = re.compile(rb"(\s" + name.encode() + rb"\s*=\s*)([\"']).*?\2", re.DOTALL)
    if value is None:
        return whole.sub(b"", tag, count=1)
    several = " " in value
    pattern = re.compile(rb"(\s" + name.encode() + rb"\s*=\s*[\"']\s*)" + (rb"[^\"']+" if several else rb"[^\s\"']+"))
    if pattern.search(tag):  # of several numbers the first one: those after it are of higher powers
        return pattern.sub(lambda match: match[1] + value.encode(), tag, count=1)
    end = -2 if tag.endswith(b"/>") else -1
    return tag[:end].rstrip() + f' {name}="{value}"'.encode() + tag[end:]
