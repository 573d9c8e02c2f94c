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
        types=[one for one in properties if one.iri == TYPE],
        said=[one for one in properties if one.iri != TYPE],
        incoming=_incoming(answers["incoming"].rows, base),
        whole=len(answers["said"].rows) < MOST[0] and len(answers["incoming"].rows) < MOST[1],
    )


def _said(rows: Iterable[Row], base: str) -> list[ShownProperty]:
    properties: dict[str, ShownProperty] = {}
    graphs: dict[tuple[str, str, bool], set[str]] = defaultdict(set)
    kept: dict[tuple[str, str, bool], Row] = {}
    for row in rows:
        key = row["property"], str(row["value"]), bool(row["leads"])
        graphs[key].add(row["graph"])
        kept.setdefault(key, row)
    for key, row in sorted(kept.items(), key=lambda pair: pair[0]):
        of = properties.setdefault(
            row["property"], ShownProperty(row["property"], row["property_label"] or shorten(row["property"]))
        )
        of.values.append(
            Value(
                _text(row, base),
                row["value"] if row["leads"] else None,
                tuple(_by(graph, base) for graph in sorted(graphs[key])),
            )
        )
    return sorted(properties.values(), key=lambda one: (one.label.lower(), one.iri))


def _incoming(rows: Iterable[Row], base: str) -> list[ShownProperty]:
    properties: dict[str, ShownProperty] = {}
    for subject, row in sorted({(row["property"], row["subject"]): row for row in rows}.items()):
        of = properties.setdefault(subject[0], ShownProperty(subject[0], row["property_label"] or shorten(subject[0])))
        of.values.append(Value(str(row["subject_label"] or shorten(subject[1], base)), subject[1], ()))
    return sorted(properties.values(), key=lambda one: (one.label.lower(), one.iri))


def _text(row: Row, base: str) -> str:
    if row["leads"]:
        return str(row["value_label"] or shorten(row["value"], base))
    value: Any = row["value"]
    text = (
        f"{value:.10g}"
        if isinstance(value, float)
        else ("yes" if value else "no")
        if value in (True, False) and isinstance(value, bool)
        else str(value)
    )
    unit = wording.unit_symbol(row["unit"])
    return f"{text}\N{NO-BREAK SPACE}{unit}" if unit else text


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
