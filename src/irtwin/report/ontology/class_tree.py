"""The figure of a class hierarchy: a tree for each module, side by side in columns."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from markupsafe import escape

ROW, INDENT, COLUMN, COLUMNS = 22, 18, 450, 3  # px; how many columns
TITLE = 34  # px that a module's name takes


@dataclass(frozen=True)
class Node:
    """A class: its label, the anchor that it leads to, its superclasses elsewhere, and the classes below it."""

    label: str
    anchor: str
    beside: list[str]
    below: list[Node]


def class_tree(forests: Mapping[str, list[Node]]) -> str:
    """Return an SVG of the trees of each module; each module goes to the column that is shortest so far."""
    heights = [0] * COLUMNS
    parts = []
    for module, roots in forests.items():
        column = heights.index(min(heights))
        x, y = column * COLUMN, heights[column]
        parts.append(f'<text class="module" x="{x}" y="{y + 20}">{escape(module)}</text>')
        rows = list(_rows(roots, 0))
        for place, (depth, node) in enumerate(rows):
            parts += _drawn(node, x + depth * INDENT, y + TITLE + place * ROW)
        parts += _branches(rows, x, y + TITLE)
        heights[column] += TITLE + len(rows) * ROW + 18
    width, height = COLUMNS * COLUMN, max(heights)
    return (
        f'<svg class="tree" viewBox="0 0 {width} {height}" role="group" aria-label="Tree of the classes, by module">'
        f"{''.join(parts)}</svg>"
    )


def _rows(nodes: list[Node], depth: int) -> Iterator[tuple[int, Node]]:
    for node in nodes:
        yield depth, node
        yield from _rows(node.below, depth + 1)


def _drawn(node: Node, x: int, y: int) -> Iterator[str]:
    beside = f'<tspan class="beside" dx="6">{escape(", ".join(node.beside))}</tspan>' if node.beside else ""
    yield f'<circle cx="{x + 5}" cy="{y + 7}" r="3"/>'
    yield f'<a href="#{escape(node.anchor)}"><text x="{x + 14}" y="{y + 11}">{escape(node.label)}{beside}</text></a>'


def _branches(rows: list[tuple[int, Node]], x: int, y: int) -> Iterator[str]:
    """Yield the lines from each class to those below it."""
    for place, (depth, _) in enumerate(rows):
        last = place
        for other in range(place + 1, len(rows)):
            if rows[other][0] <= depth:
                break
            if rows[other][0] == depth + 1:
                last = other
                across = y + other * ROW + 7
                yield f'<path d="M{x + depth * INDENT + 5},{across}h{INDENT - 3}"/>'
        if last > place:
            yield f'<path d="M{x + depth * INDENT + 5},{y + place * ROW + 10}V{y + last * ROW + 7}"/>'
