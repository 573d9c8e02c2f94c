"""The tables of a diagnosis, as the fields of its dataclasses tell them.

Of these are made the classes of the database (`storage.gap_schema`), its rows (`providers.gap_rows`) and the mapping
that makes individuals of them (`r2rml`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, is_dataclass
from functools import cached_property
from types import NoneType
from typing import Annotated, Any, get_args, get_origin

from irtwin.document.curves import Curves
from irtwin.document.document import Document
from irtwin.document.told import Individual, Names, Told, all_told, individual_of

Steps = tuple[str | int, ...]


@dataclass(frozen=True)
class Column:
    """A column: `steps` lead from the part to its value; `is_place`: it says where the part stands instead.

    `term`: its property; `names`: what its text names; `unit_of`: it is the unit of that word.
    """

    name: str
    kind: type
    steps: Steps = ()
    nullable: bool = False
    key: bool = False
    term: str = ""
    names: Names | None = None
    is_place: bool = False
    unit_of: str = ""


@dataclass(frozen=True)
class Table:
    """A table: a row for each part of a `kind`, or each name in a list of that kind; `steps` lead there from the whole.

    `place`: the column for the key of a part in a mapping, or for a name in a list.
    """

    name: str
    kind: Any
    steps: Steps = ()
    whole: Table | None = None
    place: Column | None = None

    @property
    def individual(self) -> Individual | None:
        """What its parts are; None of a list of names."""
        return individual_of(self.kind)

    @cached_property
    def columns(self) -> tuple[Column, ...]:
        """The columns that it does not share with the whole."""
        first = [self.place] if self.place else []
        if self.individual is None:
            return tuple(first)
        own = [column for member in _members(self.kind) for column in member.columns]
        if self.individual.ranked:
            keyed = any(column.key for column in own)
            first.append(Column("rank" if keyed else "number", int, key=not keyed, term="Rank", is_place=True))
        unit = [Column("unit", str, unit_of=self.individual.unit_of)] if self.individual.unit_of else []
        return (*first, *own, *unit)

    @cached_property
    def keys(self) -> tuple[str, ...]:
        """The columns that tell its rows apart, those of the whole first."""
        above = self.whole.keys if self.whole else ("diagnosis_id",)
        return (*above, *(column.name for column in self.columns if column.key))

    @cached_property
    def parts(self) -> tuple[Table, ...]:
        """The tables of what its parts are made of."""
        return _parts(self.kind, self) if self.individual else ()

    @cached_property
    def of_robot(self) -> bool:
        """Whether its rows say the robot: its parts name joints."""
        kinds = [_Type.of(hint).kind for _, hint, _ in all_told(self.kind)] if self.individual else [self.kind]
        named = [names.iri for names in map(_names, kinds) if names]
        return self.whole is not None and any("{robot_id}" in iri for iri in named)

    @property
    def iri(self) -> str:
        """The template of its individuals' IRIs; of a list of names, that of the whole."""
        if self.individual is None:
            assert self.whole is not None
            return self.whole.iri
        return "/".join((self.individual.name.lower(), *(f"{{{key}}}" for key in self.keys)))

    def all(self) -> Iterator[Table]:
        """Yield the table and all below it."""
        yield self
        for table in self.parts:
            yield from table.all()


def reached(part: Any, steps: Steps) -> Any:
    """Return what steps lead to from a part: None where there is none on the way."""
    for step in steps:
        if part is None:
            return None
        part = getattr(part, step) if isinstance(step, str) else part[step] if step < len(part) else None
    return part


@dataclass(frozen=True)
class _Type:
    """What a field holds: values of a `kind`, one or `many`, or none; `keys`: the type of a mapping's."""

    kind: Any
    many: bool = False
    missing: bool = False
    keys: Any = None

    @classmethod
    def of(cls, hint: Any) -> _Type:
        inner = [argument for argument in get_args(hint) if argument is not NoneType]
        if get_origin(hint) is Mapping:
            return cls(inner[1], many=True, keys=inner[0])
        if get_origin(hint) is tuple and inner[-1] is Ellipsis:
            return cls(inner[0], many=True)
        if get_origin(hint) is not Annotated and NoneType in get_args(hint):
            known = cls.of(inner[0])
            return cls(known.kind, known.many, True, known.keys)
        return cls(hint)


@dataclass(frozen=True)
class _Member:
    """A field that is told, that of a part's part too; `missing`: it, or the part that has it, may be None."""

    name: str
    type: _Type
    missing: bool
    told: Told
    steps: Steps

    @property
    def has_table(self) -> bool:
        return individual_of(self.type.kind) is not None or (self.type.many and not self.told.columns)

    @property
    def columns(self) -> Iterator[Column]:
        told, nullable = self.told, self.missing or self.told.optional
        if self.has_table:
            return
        if get_args(self.type.kind) == (float, float):
            base = self.name.removesuffix("interval95")
            names = told.columns or (f"{base}lower", f"{base}upper")
            terms = told.terms if len(told.terms) > 1 else (f"{told.terms[0]}_Lower", f"{told.terms[0]}_Upper")
            for end in (0, 1):
                yield Column(names[end], float, (*self.steps, end), nullable, term=terms[end])
        elif self.type.many:
            for end, (name, term) in enumerate(zip(told.columns, told.terms, strict=True)):
                missing = nullable or end > 0
                yield Column(name, str, (*self.steps, end), missing, term=term, names=_names(self.type.kind))
        else:
            named = _names(self.type.kind)
            name = next((given for given in (*told.columns, named.column if named else "") if given), self.name)
            term = next(iter(told.terms), "")
            yield Column(name, _plain(self.type.kind), self.steps, nullable, told.key, term, named)

    def table(self, whole: Table) -> Table:
        individual = individual_of(self.type.kind)
        names = _names(self.type.keys or self.type.kind)
        if names is None:
            assert individual is not None, f"{self.name}: neither parts nor names, but a list of them"
            return Table(individual.table, self.type.kind, self.steps, whole)
        place = Column(names.column, str, key=True, term=self.told.terms[0], names=names, is_place=True)
        own = individual.table if individual else f"{whole.name}_{names.column.removesuffix('_id')}"
        return Table(self.told.table or own, self.type.kind, self.steps, whole, place)


def _parts(kind: Any, whole: Table) -> tuple[Table, ...]:
    """Return the tables of what a kind of part is made of, which are of a whole."""
    return tuple(member.table(whole) for member in _members(kind) if member.has_table)


def _members(kind: Any, steps: Steps = (), *, missing: bool = False) -> Iterator[_Member]:
    """Yield what is told of a kind of part, and of the parts in it that are no individuals."""
    for name, hint, notes in all_told(kind):
        held, here = _Type.of(hint), (*steps, name)
        own = missing or held.missing
        if is_dataclass(held.kind) and individual_of(held.kind) is None:
            yield from _members(held.kind, here, missing=own)
        else:
            yield _Member(name, held, own, notes, here)


def _names(kind: Any) -> Names | None:
    """Return what texts of an annotated type name."""
    return next((annotation for annotation in getattr(kind, "__metadata__", ()) if isinstance(annotation, Names)), None)


def _plain(kind: Any) -> type:
    plain: type = get_args(kind)[0] if get_origin(kind) is Annotated else kind
    return plain


DOCUMENT = Table("gap_diagnosis", Document)
OF_CURVES = _parts(Curves, DOCUMENT)
TABLES = (*DOCUMENT.all(), *OF_CURVES)
