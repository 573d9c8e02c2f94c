"""Single numbers of a URDF changed: bodies of links and dynamics of joints; all else stays, byte for byte."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from xml.parsers import expat
from xml.sax.saxutils import quoteattr

import pinocchio as pin

_MOMENTS = (("ixx", 0, 0), ("ixy", 0, 1), ("ixz", 0, 2), ("iyy", 1, 1), ("iyz", 1, 2), ("izz", 2, 2))
_TAG = re.compile(rb"""<(?:"[^"]*"|'[^']*'|[^>"'])*>""")


@dataclass
class _Element:
    """An element of the bytes from `start` to `stop`, its start tag as far as `inside`."""

    tag: str
    attributes: dict[str, str]
    start: int
    inside: int
    stop: int = 0
    children: list[_Element] = field(default_factory=list)


def with_numbers(urdf: str, bodies: Mapping[str, pin.Inertia], dynamics: Mapping[str, Mapping[str, float]]) -> str:
    """Return checked URDF text with these bodies of links, in the links' frames, and numbers of joints' <dynamics>."""
    content = urdf.encode("utf-8")
    for element in reversed(_root(content).children):  # from behind: places before stay right
        name = element.attributes.get("name", "")
        if element.tag == "link" and name in bodies:
            content = _with_child(content, element, "inertial", _inertial(bodies[name]))
        elif element.tag == "joint" and dynamics.get(name):
            said = next((child.attributes for child in element.children if child.tag == "dynamics"), {})
            words = said | {key: repr(value) for key, value in dynamics[name].items()}
            tag = " ".join(["<dynamics", *(f"{key}={quoteattr(value)}" for key, value in words.items())])
            content = _with_child(content, element, "dynamics", f"{tag}/>")
    return content.decode("utf-8")


def _root(content: bytes) -> _Element:
    parser = expat.ParserCreate()
    open_ones = [_Element("", {}, 0, 0)]

    def begin(tag: str, attributes: dict[str, str]) -> None:
        start = parser.CurrentByteIndex
        tag_text = _TAG.match(content, start)
        assert tag_text is not None  # the parser has seen it whole
        element = _Element(tag, attributes, start, tag_text.end())
        open_ones[-1].children.append(element)
        open_ones.append(element)

    def end(tag: str) -> None:
        element = open_ones.pop()
        closed = content[: element.inside].endswith(b"/>")
        element.stop = element.inside if closed else content.index(b">", parser.CurrentByteIndex) + 1

    parser.StartElementHandler, parser.EndElementHandler = begin, end
    parser.Parse(content, True)
    return open_ones[0].children[0]


def _with_child(content: bytes, element: _Element, tag: str, text: str) -> bytes:
    """Return the bytes with the element's child of a tag replaced by a text, or with such a child."""
    for child in element.children:
        if child.tag == tag:
            return content[: child.start] + text.encode() + content[child.stop :]
    before, own, after = content[: element.start], content[element.start : element.stop], content[element.stop :]
    if own.endswith(b"/>"):
        own = own[:-2].rstrip() + f"></{element.tag}>".encode()
    place = own.rindex(b"</")
    gap = b"\n" if b"\n" in own else b""
    return before + own[:place].rstrip() + gap + text.encode() + gap + own[place:] + after


def _inertial(body: pin.Inertia) -> str:
    centre = " ".join(map(repr, body.lever.tolist()))
    moments = " ".join(f'{name}="{float(body.inertia[row, column])!r}"' for name, row, column in _MOMENTS)
    return f'<inertial><origin xyz="{centre}"/><mass value="{float(body.mass)!r}"/><inertia {moments}/></inertial>'
