"""SQL identifiers and string templates as R2RML writes them (W3C R2RML, sections 5.1, 7.3 and 11)."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from sqlalchemy.sql.compiler import IdentifierPreparer

_PART = r'(?:"(?:[^"]|"")+"|[^\W\d]\w*)'
_IDENTIFIER = re.compile(_PART)
_TABLE = re.compile(rf"{_PART}(?:\.{_PART})*")
_TOKEN = re.compile(r"\\(?P<escaped>[\\{}])|(?P<brace>[{}])|(?P<plain>[^\\{}]+|\\)")


@dataclass(frozen=True)
class Identifier:
    """A column or table name: delimited ("Name", taken as it is) or regular (folded by the database)."""

    name: str
    delimited: bool

    def __str__(self) -> str:
        return '"' + self.name.replace('"', '""') + '"' if self.delimited else self.name

    def find(self, names: Iterable[str], folded: bool) -> str | None:
        """Return the column that this identifier means, None where there is none.

        A regular identifier means a name all in upper or all in lower case, as databases fold it; where
        names are not `folded` (aliases that a query made), case does not count.
        """
        present = list(names)
        if self.delimited:
            return self.name if self.name in present else None
        forms = {self.name.upper(), self.name.lower()}
        matching = [name for name in present if name in forms or (not folded and name.lower() == self.name.lower())]
        return matching[0] if len(matching) == 1 else None


def parse_identifier(text: str) -> Identifier:
    """Read a column's name. Raises ValueError where it is none."""
    if not _IDENTIFIER.fullmatch(text):
        raise ValueError(f"{text!r} is no SQL identifier")
    if text.startswith('"'):
        return Identifier(text[1:-1].replace('""', '"'), delimited=True)
    return Identifier(text, delimited=False)


def parse_table(text: str) -> tuple[Identifier, ...]:
    """Read a table's name, with catalogue and schema before it where given. Raises ValueError where it is none."""
    if not _TABLE.fullmatch(text):
        raise ValueError(f"{text!r} is no SQL table name")
    return tuple(parse_identifier(part) for part in _IDENTIFIER.findall(text))


def parse_template(text: str) -> tuple[str | Identifier, ...]:
    """Read a template into its fixed strings and columns. Raises ValueError where braces do not pair."""
    parts: list[str | Identifier] = []
    buffer = ""
    inside = False
    for token in _TOKEN.finditer(text):
        brace = token["brace"]
        if brace is None:
            buffer += token["escaped"] or token["plain"]
            continue
        if (brace == "{") is inside:
            raise ValueError(f"unpaired {brace!r} in template {text!r}")
        if inside:
            parts.append(parse_identifier(buffer))
        elif buffer:
            parts.append(buffer)
        buffer, inside = "", not inside
    if inside:
        raise ValueError(f"unpaired '{{' in template {text!r}")
    return (*parts, buffer) if buffer else tuple(parts)


def quoted(name: str, preparer: IdentifierPreparer) -> str:
    """Return a name in the database's own quotes; SQLAlchemy's own way would double a per cent sign, too."""
    return preparer.initial_quote + name.replace(preparer.final_quote, 2 * preparer.final_quote) + preparer.final_quote
