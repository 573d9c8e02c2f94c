"""Where a diagnosis stands in database and graph: said at each field of its dataclasses, and nowhere else.

Each part of a class with an individual is a row of a table, and an individual of that class of the ontology. The fields
that are told are columns of the row and properties of the individual; what a property means, and in which unit, the
ontology says. Fields of a class without individual go with the part that holds it. `tables` reads all of this.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import MISSING, dataclass, field, fields
from typing import Any, TypeVar, cast, dataclass_transform, get_type_hints

from irtwin.document.form import goes_with

Class = TypeVar("Class", bound=type[Any])
Getter = TypeVar("Getter", bound=Callable[..., Any])

_INDIVIDUAL, _TOLD = "__individual__", "told"


@dataclass(frozen=True)
class Names:
    """A text that names an individual: its IRI, with {} for the text; the column for it, where its field names none."""

    iri: str
    column: str = ""


@dataclass(frozen=True)
class Individual:
    """What a part is: of a class of the ontology; by which property it leads to the whole, `of`.

    `table` that has its rows; `ranked`: they count from 1; `unit_of`: the column whose word says the unit of its
    numbers (`words.UNITS`); `constants`: properties with one value for all.
    """

    name: str
    table: str
    of: str
    ranked: bool
    unit_of: str
    constants: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Told:
    """What is said of a field: see `told`."""

    terms: tuple[str, ...]
    columns: tuple[str, ...]
    table: str = ""
    key: bool = False
    optional: bool = False


def told(
    *terms: str,
    column: str = "",
    table: str = "",
    key: bool = False,
    optional: bool = False,
    default: Any = MISSING,
    with_field: str = "",
) -> Any:
    """Return a field that is kept, as a property of the ontology where it has one, `terms`.

    `column` where it is not called as the field; `table` of a list of names; `key`: the rows are told apart by it;
    `optional`: rows may lack it though documents do not.
    An interval has two terms and columns, parted by a space, or those of its field with "lower" and "upper"; a list of
    names with columns stands in these. The term of a mapping is that of its keys. With the default None a field goes
    without saying in JSON, or goes `with_field`.
    """
    notes = Told(terms, tuple(column.split()), table, key, optional)
    return field(default=default, metadata={_TOLD: notes} | (goes_with(with_field) if with_field else {}))


def tells(*terms: str, key: bool = False) -> Callable[[Getter], Getter]:
    """Keep what a property of a part returns, as `told` does for a field."""

    def kept(getter: Getter) -> Getter:
        setattr(getter, _TOLD, Told(terms, (), key=key))
        return getter

    return kept


@dataclass_transform(kw_only_default=True, frozen_default=True, field_specifiers=(told, field))
def part(
    individual: str = "",
    *,
    table: str = "",
    of: str = "",
    ranked: bool = False,
    unit_of: str = "",
    constants: tuple[tuple[str, str], ...] = (),
) -> Callable[[Class], Class]:
    """Make a class a frozen dataclass; with an individual, one whose parts are that in the graph: see `Individual`."""

    def made(kind: Class) -> Class:
        own = Individual(individual, table or individual.lower(), of, ranked, unit_of, constants)
        setattr(kind, _INDIVIDUAL, own if individual else None)
        return cast(Class, dataclass(frozen=True, kw_only=True)(kind))

    return made


def individual_of(kind: Any) -> Individual | None:
    """Return what parts of a kind are in the graph."""
    own: Individual | None = getattr(kind, _INDIVIDUAL, None)
    return own


def all_told(kind: Any) -> Iterator[tuple[str, Any, Told]]:
    """Yield what is told of a kind of part: names, types, and what is said of each."""
    hints = get_type_hints(kind, include_extras=True)
    for part_field in fields(kind):
        if _TOLD in part_field.metadata:
            yield part_field.name, hints[part_field.name], part_field.metadata[_TOLD]
    for above in reversed(kind.__mro__):
        for name, member in vars(above).items():
            notes = getattr(getattr(member, "fget", None), _TOLD, None)
            if notes is not None:
                yield name, get_type_hints(member.fget, include_extras=True)["return"], notes
