"""What the graph says of an individual: its properties with their units and who says so, and what leads to it."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

from irtwin.knowledge.vocabulary import (
    GRAPH_ACTIVITY,
    GRAPH_ASSERTED,
    GRAPH_CHANGED,
    GRAPH_INFERRED,
    GRAPH_ONTOLOGY,
    GRAPH_OWL_RL,
    GRAPH_REASONED,
    GRAPH_SOURCE,
    GRAPH_VALIDATION,
    ID,
    RDF,
    shorten,
)
from irtwin.report import wording
from irtwin.report.questions import Answers, Row

TYPE = f"{RDF}type"
MOST_VALUES = 50  # of one property that are shown
MOST = 5000, 1000  # rows of said.rq and incoming.rq


@dataclass(frozen=True)
class Value:
    """What a property leads to: an individual by its IRI, or a literal; `by` who says so, in words and by IRI."""

    text: str
    iri: str | None
    by: tuple[tuple[str, str | None], ...]


@dataclass
class ShownProperty:
    """A property with its values, of which the first are shown."""

    iri: str
    label: str
    values: list[Value] = field(default_factory=list)


@dataclass(frozen=True)
class ShownIndividual:
    """An individual as its page shows it; `whole` where nothing was left out."""

    iri: str
    name: str
    types: list[ShownProperty]
    said: list[ShownProperty]
    incoming: list[ShownProperty]
    whole: bool


def individual(iri: str, answers: Answers, base: str = ID) -> ShownIndividual:
    """Make what a page shows of the answers to `reports/plant/individual/*.rq`."""
    properties = _said(answers["said"].rows, base)
    named = answers["name"].first
    return ShownIndividual(
        iri=iri,
        name=str(named["name"]) if named else wording.local_name(iri),
        types=[shown for shown in properties if shown.iri == TYPE],
        said=[shown for shown in properties if shown.iri != TYPE],
        incoming=_incoming(answers["incoming"].rows, base),
        whole=len(answers["said"].rows) < MOST[0] and len(answers["incoming"].rows) < MOST[1],
    )


def _said(rows: Iterable[Row], base: str) -> list[ShownProperty]:
    graphs: dict[tuple[str, str, bool], set[str]] = defaultdict(set)
    kept: dict[tuple[str, str, bool], Row] = {}
    for row in rows:
        key = row["property"], str(row["value"]), bool(row["leads"])
        graphs[key].add(row["graph"])
        kept.setdefault(key, row)
    return _by_property(
        (row, Value(_text(row, base), key[1] if key[2] else None, tuple(_by(iri, base) for iri in sorted(graphs[key]))))
        for key, row in sorted(kept.items(), key=lambda pair: pair[0])
    )


def _incoming(rows: Iterable[Row], base: str) -> list[ShownProperty]:
    kept = {(row["property"], row["subject"]): row for row in rows}
    return _by_property(
        (row, Value(str(row["subject_label"] or shorten(subject, base)), subject, ()))
        for (_, subject), row in sorted(kept.items())
    )


def _by_property(values: Iterable[tuple[Row, Value]]) -> list[ShownProperty]:
    """Gather values, each with a row that says its property, by that."""
    properties: dict[str, ShownProperty] = {}
    for row, value in values:
        iri = row["property"]
        properties.setdefault(iri, ShownProperty(iri, row["property_label"] or shorten(iri))).values.append(value)
    return sorted(properties.values(), key=lambda shown: (shown.label.lower(), shown.iri))


def _text(row: Row, base: str) -> str:
    value: Any = row["value"]
    if row["leads"]:
        return str(row["value_label"] or shorten(value, base))
    if isinstance(value, bool):
        text = "yes" if value else "no"
    else:
        text = f"{value:.10g}" if isinstance(value, float) else str(value)
    return "\N{NO-BREAK SPACE}".join(filter(None, (text, wording.unit_symbol(row["unit"]))))


def _by(graph: str, base: str) -> tuple[str, str | None]:
    """Say who stated what a graph holds, with the IRI of an activity."""
    if graph.startswith(GRAPH_ACTIVITY):
        name = graph.removeprefix(GRAPH_ACTIVITY)
        return f"activity {name}", f"{base}activity/{name}"
    if graph.startswith(GRAPH_INFERRED):
        return f"concluded by {'OWL' if graph == GRAPH_OWL_RL else graph.removeprefix(GRAPH_INFERRED)}", None
    if graph.startswith(GRAPH_SOURCE):
        return f"taken in ({graph.removeprefix(GRAPH_SOURCE)})", None
    known = {
        GRAPH_ONTOLOGY: "the ontology",
        GRAPH_ASSERTED: "asserted",
        GRAPH_REASONED: "noted by the reasoner",
        GRAPH_CHANGED: "noted by the reasoner",
        GRAPH_VALIDATION: "the validation",
    }
    return known.get(graph, shorten(graph)), None
