"""Elements of XML and where they stand among its bytes, so that one is changed and all else stays; their numbers."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from xml.parsers import expat

from irtwin.errors import InputError

_TAG = re.compile(rb"""<(?:"[^"]*"|'[^']*'|[^>"'])*>""")


@dataclass(eq=False)
class Element:
    """An element of the bytes from `start` to `stop`, its start tag as far as `inside`.

    One that is yet to come takes no bytes: it stands where it is to be put.
    """

    tag: str
    attributes: dict[str, str]
    start: int
    inside: int
    stop: int = 0
    children: list[Element] = field(default_factory=list)

    def child(self, tag: str) -> Element | None:
        """Return its first child of a tag, None where it has none."""
        return next((child for child in self.children if child.tag == tag), None)

    def walk(self) -> Iterator[Element]:
        """Yield it and all within it, in the order of the file."""
        todo = [self]
        while todo:
            yield (element := todo.pop())
            todo += reversed(element.children)


def outermost(content: bytes) -> Element:
    """Return the outermost element. Raises expat.ExpatError, and ValueError where it declares a document type."""
    parser = expat.ParserCreate()
    open_ones = [Element("", {}, 0, 0)]

    def begin(tag: str, attributes: dict[str, str]) -> None:
        start = parser.CurrentByteIndex
        tag_text = _TAG.match(content, start)
        assert tag_text is not None  # the parser has seen it whole
        element = Element(tag, attributes, start, tag_text.end())
        open_ones[-1].children.append(element)
        open_ones.append(element)

    def end(tag: str) -> None:
        element = open_ones.pop()
        closed = content.endswith(b"/>", element.start, element.inside)
        element.stop = element.inside if closed else content.index(b">", parser.CurrentByteIndex) + 1

    def refuse(*_: object) -> None:
        raise ValueError(f"line {parser.CurrentLineNumber}: declares a document type; remove it")

    parser.StartElementHandler, parser.EndElementHandler = begin, end
    parser.StartDoctypeDeclHandler = refuse
    parser.Parse(content, True)
    return open_ones[0].children[0]


def with_child(content: bytes, element: Element, tag: str, text: str) -> bytes:
    """Return the bytes with the element's child of a tag replaced by a text, or with such a child."""
    child = element.child(tag)
    if child is not None:
        return content[: child.start] + text.encode() + content[child.stop :]
    before, own, after = content[: element.start], content[element.start : element.stop], content[element.stop :]
    if own.endswith(b"/>"):
        own = own[:-2].rstrip() + f"></{element.tag}>".encode()
    place = own.rindex(b"</")
    gap = b"\n" if b"\n" in own else b""
    return before + own[:place].rstrip() + gap + text.encode() + gap + own[place:] + after


def words(*values: float) -> str:
    """Return numbers as an attribute says them, to their last digit."""
    return " ".join(repr(float(value)) for value in values)


def numbers(text: str | None, count: int, where: str) -> tuple[float, ...]:
    """Return so many finite numbers of an attribute. Raises InputError, naming `where`, on anything else."""
    try:
        values = tuple(float(word) for word in (text or "").split())
    except ValueError:
        values = ()
    if len(values) != count or not all(math.isfinite(value) for value in values):
        shown = text if text is None or len(text) < 60 else f"{text[:60]}..."
        raise InputError(f'{where}: "{shown}" should be {count} finite number{"s" if count > 1 else ""}')
    return values
