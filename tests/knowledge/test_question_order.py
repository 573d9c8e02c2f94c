"""Questions that a fleet's graph answers at once: what stands behind an OPTIONAL is matched with all of the graph."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from rdflib.plugins.sparql import prepareQuery
from rdflib.plugins.sparql.parserutils import CompValue
from rdflib.term import Variable

from irtwin.knowledge.questions.queries import named_questions
from irtwin.resources import folder

SHIPPED = {name: question.text for name, question in named_questions().items()}
REPORTS = {
    f"{file.parent.name}/{file.stem}": file.read_text(encoding="utf-8")
    for file in sorted(Path(folder("reports")).rglob("*.rq"))
}
# Few rows stand before: 20 ms of 20 robots, or of one robot.
MEASURED = {"ledger_of_last_run", "joint_state", "energy/joints"}


def behind_an_optional(pattern: Any) -> Iterator[str]:
    """Yield the variables of triple patterns that are joined with a group after an OPTIONAL of it."""
    if isinstance(pattern, list):
        for part in pattern:
            yield from behind_an_optional(part)
    if not isinstance(pattern, CompValue):
        return
    if pattern.name == "Join" and pattern.p2.name == "BGP":
        before = pattern.p1
        while before.name in ("Extend", "Filter"):
            before = before.p
        if before.name == "LeftJoin":
            yield from (str(triple[0]) for triple in pattern.p2.triples if isinstance(triple[0], Variable))
    for part in pattern.values():
        yield from behind_an_optional(part)


def told(text: str) -> list[str]:
    return list(behind_an_optional(prepareQuery(text).algebra))


def test_a_pattern_behind_an_optional_is_found() -> None:
    assert told("SELECT * { ?a <b:p> ?c OPTIONAL { ?a <b:q> ?d } ?c <b:r> ?e }") == ["c"]
    assert told("SELECT * { ?a <b:p> ?c . ?c <b:r> ?e OPTIONAL { ?a <b:q> ?d } }") == []


@pytest.mark.parametrize(("name", "text"), (SHIPPED | REPORTS).items(), ids=[*SHIPPED, *REPORTS])
def test_no_pattern_stands_behind_an_optional(name: str, text: str) -> None:
    assert bool(told(text)) == (name in MEASURED)
