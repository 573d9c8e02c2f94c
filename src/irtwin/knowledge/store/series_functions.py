"""SPARQL functions that reach the samples of runs: `series:integral(?run, "power", 2.0, 8.0)`.

Described in `ontology/providers.ttl`. A window's ends are seconds of the log's own time or moments (xsd:dateTime); a
last argument "modelled" asks for what a twin says instead of what was measured. As SPARQL has it, a call without an
answer leaves its variable unbound.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pyoxigraph import BlankNode, DefaultGraph, Literal, NamedNode, Store, Triple

from irtwin.errors import InputError
from irtwin.knowledge.store.table import to_python
from irtwin.knowledge.vocabulary import RDF, SERIES, shorten, term

if TYPE_CHECKING:
    from irtwin.storage.windows import SeriesWindows  # pyarrow: a tenth of a second, for those who ask for samples

Term = NamedNode | BlankNode | Literal | Triple
Answer = float | list[tuple[float, float]] | None

_JSON = NamedNode(f"{RDF}JSON")
_MOST_FAULTS = 20
_NAMES = ("mean", "min", "max", "integral", "samples", "curve")  # of functions, and of what `SeriesWindows` answers

Functions = dict[NamedNode, Callable[..., Term | None]]


def series_functions(store: Store, workspace: Path, faults: dict[str, None]) -> Functions:
    """Return the functions for a query of a store whose series lie in a workspace, as Oxigraph takes them.

    `faults` is told why calls had no answer, each reason once, in the order met.
    """

    def call(name: str, *arguments: Term) -> Literal | None:
        try:
            value = _ask(store, workspace, name, arguments)
        except InputError as error:
            if len(faults) < _MOST_FAULTS:
                faults[f"series:{name}: {error}"] = None
            return None
        if isinstance(value, list):
            return Literal(json.dumps(value), datatype=_JSON)
        return None if value is None else Literal(value)

    return {NamedNode(SERIES + name): partial(call, name) for name in _NAMES}


def _ask(store: Store, workspace: Path, name: str, arguments: tuple[Term, ...]) -> Answer:
    if not 4 <= len(arguments) <= 5:
        raise InputError('takes a run, a channel and the two ends of a window, and "modelled" if that is meant')
    run, channel, start, end, *kind = arguments
    if not isinstance(run, NamedNode) or not isinstance(channel, Literal):
        raise InputError(f"takes a run's IRI and a channel's name, not {run} and {channel}")
    series = _series(store, workspace, run, str(to_python(kind[0])) if kind else "measured")
    window = [_seconds(store, run, series, moment) for moment in (start, end)]
    if not window[0] <= window[1]:
        raise InputError(f"the window from {start} to {end} ends before it begins")
    try:
        answer: Answer = getattr(series, name)(channel.value, *window)
    except InputError as error:
        raise InputError(f"{shorten(run.value)}: {error}") from None
    return answer


def _series(store: Store, workspace: Path, run: NamedNode, kind: str) -> SeriesWindows:
    from irtwin.storage.windows import open_series

    for quad in store.quads_for_pattern(None, NamedNode(term("series_of")), run, DefaultGraph()):
        if kind in _values(store, quad.subject, "Series_Kind"):
            for file in _values(store, quad.subject, "File"):
                return open_series(workspace, str(file))
    raise InputError(f"{shorten(run.value)}: the graph has no {kind} series of this run")


def _seconds(store: Store, run: NamedNode, series: SeriesWindows, moment: Term) -> float:
    """Return a moment on the clock of the run's log."""
    value = to_python(moment)
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    if not isinstance(value, datetime):
        raise InputError(f"a window's end is a number of seconds or an xsd:dateTime, not {moment}")
    for start in _values(store, run, "Start_Time"):
        if isinstance(start, datetime):
            return series.begin + (_in_utc(value) - _in_utc(start)).total_seconds()
    raise InputError(f"{shorten(run.value)}: the graph does not know when this run began; give seconds")


def _values(store: Store, subject: Any, name: str) -> list[Any]:
    quads = store.quads_for_pattern(subject, NamedNode(term(name)), None, DefaultGraph())
    return [to_python(quad.object) for quad in quads]


def _in_utc(moment: datetime) -> datetime:
    return moment.replace(tzinfo=UTC) if moment.tzinfo is None else moment
