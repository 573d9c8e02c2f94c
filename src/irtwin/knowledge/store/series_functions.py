"""SPARQL functions that reach the samples of runs: `series:integral(?run, "power", 2.0, 8.0)`.

Described in `ontology/providers.ttl`. A window's ends are seconds of the log's own time or moments (xsd:dateTime); a
last argument "modelled" asks for what a twin says instead of what was measured. As SPARQL has it, a call without an
answer leaves its variable unbound.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping
from datetime import UTC, datetime
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
_ASKED: Mapping[str, Callable[[SeriesWindows, str, float, float], Answer]] = {
    "mean": lambda series, *window: series.mean(*window),
    "min": lambda series, *window: series.extreme("min", *window),
    "max": lambda series, *window: series.extreme("max", *window),
    "integral": lambda series, *window: series.integral(*window),
    "samples": lambda series, *window: series.samples(*window),
    "curve": lambda series, *window: series.curve(*window),
}


Functions = dict[NamedNode, Callable[..., Term | None]]


def series_functions(store: Store, workspace: Path, faults: dict[str, None]) -> Functions:
    """Return the functions for a query of a store whose series lie in a workspace.

    `faults` is told why calls had no answer, each reason once, in the order met.
    """
    asker = _Asker(store, workspace, faults)
    return {NamedNode(SERIES + name): asker.function(name) for name in _ASKED}


class _Asker:
    """What the functions do for the queries of one graph, whose series lie in a workspace's folder."""

    def __init__(self, store: Store, workspace: Path, faults: dict[str, None]) -> None:
        self._store = store
        self._workspace = workspace
        self._faults = faults

    def function(self, name: str) -> Callable[..., Literal | None]:
        """Return the function of a name, as Oxigraph takes it."""

        def call(*arguments: Term) -> Literal | None:
            try:
                value = self._ask(name, arguments)
            except InputError as error:
                if len(self._faults) < _MOST_FAULTS:
                    self._faults[f"series:{name}: {error}"] = None
                return None
            if isinstance(value, list):
                return Literal(json.dumps(value), datatype=_JSON)
            return None if value is None else Literal(value)

        return call

    def _ask(self, name: str, arguments: tuple[Term, ...]) -> Answer:
        if not 4 <= len(arguments) <= 5:
            raise InputError('takes a run, a channel and the two ends of a window, and "modelled" if that is meant')
        run, channel, start, end, *kind = arguments
        if not isinstance(run, NamedNode) or not isinstance(channel, Literal):
            raise InputError(f"takes a run's IRI and a channel's name, not {run} and {channel}")
        series = self._series(run, str(to_python(kind[0])) if kind else "measured")
        window = [self._seconds(run, series, moment) for moment in (start, end)]
        if not window[0] <= window[1]:
            raise InputError(f"the window from {start} to {end} ends before it begins")
        try:
            return _ASKED[name](series, channel.value, window[0], window[1])
        except InputError as error:
            raise InputError(f"{shorten(run.value)}: {error}") from None

    def _series(self, run: NamedNode, kind: str) -> SeriesWindows:
        from irtwin.storage.windows import open_series

        for series in self._subjects("series_of", run):
            if kind in map(to_python, self._objects(series, "Series_Kind")):
                for file in self._objects(series, "File"):
                    return open_series(self._workspace, str(to_python(file)))
        raise InputError(f"{shorten(run.value)}: the graph has no {kind} series of this run")

    def _seconds(self, run: NamedNode, series: SeriesWindows, moment: Term) -> float:
        """Return a moment on the clock of the run's log."""
        value: Any = to_python(moment)
        if isinstance(value, int | float) and not isinstance(value, bool):
            return float(value)
        if not isinstance(value, datetime):
            raise InputError(f"a window's end is a number of seconds or an xsd:dateTime, not {moment}")
        for start in map(to_python, self._objects(run, "Start_Time")):
            if isinstance(start, datetime):
                return series.begin + (_in_utc(value) - _in_utc(start)).total_seconds()
        raise InputError(f"{shorten(run.value)}: the graph does not know when this run began; give seconds")

    def _subjects(self, name: str, object: Any) -> Iterable[Any]:
        quads = self._store.quads_for_pattern(None, NamedNode(term(name)), object, DefaultGraph())
        return [quad.subject for quad in quads]

    def _objects(self, subject: Any, name: str) -> Iterable[Any]:
        quads = self._store.quads_for_pattern(subject, NamedNode(term(name)), None, DefaultGraph())
        return [quad.object for quad in quads]


def _in_utc(moment: datetime) -> datetime:
    return moment.replace(tzinfo=UTC) if moment.tzinfo is None else moment
