"""The flow of energy through a robot as a Sankey diagram: from the supply over the bus to joints, and to effects.

What joints give back goes on the bus, where it is anybody's. Widths are energies, so each node gives on what it gets.
It is drawn as SVG: Plotly's part for bars and lines has no such figure, and all of it is three times as large.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

from irtwin.report import wording
from irtwin.report.colours import PALETTE, effect_colour
from irtwin.report.energy.figures import ROBOT_WIDE
from irtwin.report.energy.tables import is_unsure
from irtwin.report.questions import Row, effect_name

_COLUMNS = (0, 210, 380, 740)  # left edges: sources, bus, joints, effects
_GAP, _LEAST = 8, 1.0  # between two nodes, and the least height of one
_LITTLE = 0.005  # of all energy: effects that take less are drawn together
_SUPPLY, _BACK, _BUS, _OTHERS = "supply", "given back by joints", "bus", "other effects"
_PLAIN = PALETTE[6]


@dataclass(frozen=True)
class Node:
    """A bar of a column at (x, y), `height` tall, with its `name` and `energy` in words."""

    name: str
    energy: str
    x: float
    y: float
    height: float
    colour: str


@dataclass(frozen=True)
class Ribbon:
    """What flows from one node to another, as an SVG path, in words; `unsure` where half of it may not."""

    path: str
    words: str
    colour: str
    unsure: bool


@dataclass(frozen=True)
class Flows:
    """A diagram of nodes, `bar` wide, and ribbons, in a box of some `size`."""

    size: ClassVar[tuple[int, int]] = (1000, 460)
    bar: ClassVar[int] = 12

    nodes: tuple[Node, ...]
    ribbons: tuple[Ribbon, ...]


Links = Mapping[tuple[str, str], float]
Intervals = Mapping[tuple[str, str], tuple[float | None, float | None]]  # of 95 %; none of what is drawn together


def flows(rows: Sequence[Row]) -> Flows | None:
    """Return the diagram of `energy_per_joint_and_effect`'s rows; None where no energy is taken."""
    taken: dict[tuple[str, str], float] = defaultdict(float)
    colours: dict[str, str] = {}
    intervals = {_ends(row): (row["lower_j"], row["upper_j"]) for row in rows}
    back = 0.0
    for row in rows:
        if row["energy_j"] > 0:
            taken[_ends(row)] += row["energy_j"]
            colours[effect_name(row)] = effect_colour(wording.local_name(row["effect"]))
        else:
            back -= row["energy_j"]
    if (total := sum(taken.values())) <= back:
        return None
    taken = _without_crumbs(taken, _LITTLE * total)
    sources = {(name, _BUS): value for name, value in ((_SUPPLY, total - back), (_BACK, back)) if value > 0}
    places, effects = (_sums(taken, end) for end in (0, 1))
    links = (sources, {(_BUS, place): value for place, value in places.items()}, taken)
    columns = _sums(sources, 0), {_BUS: total}, places, dict(sorted(effects.items(), key=lambda item: -item[1]))
    nodes = _placed(columns, total, colours)
    ends = zip(links, nodes, nodes[1:], strict=False)
    ribbons = [ribbon for some, starts, stops in ends for ribbon in _ribbons(some, starts, stops, intervals)]
    return Flows(tuple(node for column in nodes for node in column.values()), tuple(ribbons))


def _ends(row: Row) -> tuple[str, str]:
    return row["joint"] or ROBOT_WIDE, effect_name(row)


def _without_crumbs(taken: Links, least: float) -> dict[tuple[str, str], float]:
    """Return energies by place and effect, with effects of less than the `least` in all as one."""
    effects, drawn = _sums(taken, 1), defaultdict[tuple[str, str], float](float)
    for (place, effect), value in taken.items():
        drawn[place, effect if effects[effect] >= least else _OTHERS] += value
    return drawn


def _sums(links: Links, end: int) -> dict[str, float]:
    sums: dict[str, float] = defaultdict(float)
    for ends, value in links.items():
        sums[ends[end]] += value
    return sums


def _placed(columns: Sequence[Mapping[str, float]], total: float, colours: Mapping[str, str]) -> list[dict[str, Node]]:
    """Return the nodes of each column by name: from the top, as tall as their energy."""
    scale = (Flows.size[1] - _GAP * (max(map(len, columns)) - 1)) / total
    placed = []
    for x, column in zip(_COLUMNS, columns, strict=True):
        y, nodes = 0.0, {}
        for name, value in column.items():
            height = max(value * scale, _LEAST)
            nodes[name] = Node(name, wording.energy(value), x, y, height, colours.get(name, _PLAIN))
            y += height + _GAP
        placed.append(nodes)
    return placed


def _ribbons(links: Links, starts: Mapping[str, Node], ends: Mapping[str, Node], intervals: Intervals) -> list[Ribbon]:
    """Return the ribbons of links between two columns, stacked at both ends in the order of the nodes."""
    used: dict[tuple[str, bool], float] = defaultdict(float)
    scale = sum(node.height for node in starts.values()) / sum(links.values())
    ribbons = []
    for start, end in ((start, end) for start in starts for end in ends if (start, end) in links):
        height, source, target = links[start, end] * scale, starts[start], ends[end]
        left, right = source.y + used[start, True], target.y + used[end, False]
        used[start, True] += height
        used[end, False] += height
        words, unsure = f"{start} to {end}: {wording.energy(links[start, end])}", False
        lower, upper = intervals.get((start, end), (None, None))
        if lower is not None and upper is not None:
            words += f", between {wording.energy(lower)} and {wording.energy(upper)}"
            unsure = is_unsure(links[start, end], lower, upper)
        colour = source.colour if target.colour == _PLAIN else target.colour
        ribbons.append(Ribbon(_path(source.x + Flows.bar, left, target.x, right, height), words, colour, unsure))
    return ribbons


def _path(left: float, top: float, right: float, other_top: float, height: float) -> str:
    middle = (left + right) / 2
    upper = f"M{left:.1f},{top:.1f} C{middle:.1f},{top:.1f} {middle:.1f},{other_top:.1f} {right:.1f},{other_top:.1f}"
    lower = (
        f"L{right:.1f},{other_top + height:.1f} C{middle:.1f},{other_top + height:.1f} "
        f"{middle:.1f},{top + height:.1f} {left:.1f},{top + height:.1f} Z"
    )
    return f"{upper} {lower}"
