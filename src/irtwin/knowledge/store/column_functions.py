"""SPARQL functions that sum over individuals by columns: `column:sum(irt:Energy, irt:of_Effect, ?effect)`.

Described in `ontology/providers.ttl`. What is summed, and what an individual must lead to: both are a property or, in a
string, properties one after the other (`"irt:share_of_Run/irt:run_of"`), at last `year`, `month` or `day` of a time. A
call where no individual fits leaves its variable unbound, and counts 0. All named
graphs count, whatever FROM says.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from operator import attrgetter

from pyoxigraph import Literal, NamedNode

from irtwin.errors import InputError
from irtwin.knowledge.store.columns import Columns, Groups, Path, Term, Totals
from irtwin.knowledge.vocabulary import COLUMN

_ASKED: Mapping[str, Callable[[Totals], float | int]] = {
    "sum": attrgetter("sum"),
    "mean": attrgetter("mean"),
    "min": attrgetter("min"),
    "max": attrgetter("max"),
    "count": attrgetter("count"),
}
_STEP = r"(?:<([^<>\s]+)>|([A-Za-z][\w.-]*):([A-Za-z_][\w-]*))"
_PARTS_OF_TIME = {"year": 4, "month": 7, "day": 10}  # letters of an xsd:dateTime
_PATH = re.compile(rf"\s*{_STEP}(?:\s*/\s*{_STEP})*(?:\s*/\s*(?P<part>{'|'.join(_PARTS_OF_TIME)}))?\s*")
_MOST_FAULTS = 20


def column_functions(
    columns: Columns, prefixes: Mapping[str, str], faults: dict[str, None]
) -> dict[NamedNode, Callable[..., Term | None]]:
    """Return the functions for a query. `faults` is told why calls had no answer, each reason once."""
    asker = _Asker(columns, prefixes, faults)
    return {NamedNode(COLUMN + name): asker.function(name) for name in _ASKED}


class _Asker:
    """What the functions do for one query; of each way to ask the groups are found once."""

    def __init__(self, columns: Columns, prefixes: Mapping[str, str], faults: dict[str, None]) -> None:
        self._columns = columns
        self._prefixes = prefixes
        self._faults = faults
        self._found: dict[tuple[Term, ...], Groups] = {}

    def function(self, name: str) -> Callable[..., Literal | None]:
        """Return the function of a name, as Oxigraph takes it."""
        asked, of_none = _ASKED[name], Literal(0) if name == "count" else None

        def call(*arguments: Term) -> Literal | None:
            paths = (*arguments[:1], *arguments[1::2])
            groups = self._found.get(paths)
            if groups is None or not len(arguments) % 2:
                try:
                    groups = self._found[paths] = self._groups(arguments, paths)
                except InputError as error:
                    if len(self._faults) < _MOST_FAULTS:
                        self._faults[f"column:{name}: {error}"] = None
                    return None
            totals = groups.get(arguments[2::2])
            return of_none if totals is None else Literal(asked(totals))

        return call

    def _groups(self, arguments: tuple[Term, ...], paths: tuple[Term, ...]) -> Groups:
        if not len(arguments) % 2:
            raise InputError("takes a property, and pairs of a property and the value that it must lead to")
        of, *by = (_path(argument, self._prefixes) for argument in paths)
        return self._columns.groups(of, tuple(by))


def _path(argument: Term, prefixes: Mapping[str, str]) -> Path:
    """Read a property, or properties in a string; InputError where it is neither."""
    if isinstance(argument, NamedNode):
        return Path((argument,))
    found = _PATH.fullmatch(argument.value) if isinstance(argument, Literal) else None
    if found is None:
        raise InputError(f'{argument} is no property, nor properties in a string: "irt:share_of_Run/irt:run_of"')
    try:
        properties = [
            NamedNode(iri or _whole(prefix, name, prefixes)) for iri, prefix, name in re.findall(_STEP, found[0])
        ]
    except ValueError as error:
        raise InputError(f"{argument}: {error}") from None
    return Path(tuple(properties), _PARTS_OF_TIME.get(found["part"]))


def _whole(prefix: str, name: str, prefixes: Mapping[str, str]) -> str:
    if prefix not in prefixes:
        raise InputError(f"{prefix}: is no usual prefix; write the property's whole IRI: <https://...>")
    return prefixes[prefix] + name
