"""Questions to the graph: those that have a name, and any other in SPARQL."""

from __future__ import annotations

import csv
import io
import json
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from datetime import date
from difflib import get_close_matches
from functools import lru_cache
from pathlib import Path
from typing import Any

from pyoxigraph import QuerySolutions, Store

from irtwin.errors import InputError
from irtwin.input_file import read_text
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.readable import NOT_READABLE, is_readable
from irtwin.knowledge.store.table import AnswerTable
from irtwin.knowledge.vocabulary import GRAPH_ONTOLOGY, ID, IRT, PREFIXES
from irtwin.resources import MOST_BYTES, Resources, shipped

_HEADER = re.compile(r"^# (title|question|theme|of|concluded): (.+)$", re.MULTILINE)
THEMES = ("robot", "run", "joint", "energy", "ledger", "twin", "gap", "provenance", "fleet")
_TERM = re.compile(r"\birt:([A-Za-z]\w*)")
_QUERY_FORM = re.compile(r"\b(select|ask|construct|describe|prefix|base|insert|delete)\b", re.IGNORECASE)


@dataclass(frozen=True)
class NamedQuery:
    """A named SPARQL query; `question` is what it answers, in words.

    One that is `of_robot` can be asked of one robot, its variable `?arm`, instead of all. `concluded` are the classes
    and properties that it asks for and that nobody asserts: OWL and rules conclude them.
    """

    name: str
    title: str
    question: str
    theme: str
    of_robot: bool
    concluded: tuple[str, ...]
    text: str


@lru_cache(maxsize=16)
def named_questions(resources: Resources | None = None) -> Mapping[str, NamedQuery]:
    """Return the questions that have a name, in the order of their themes and names; those that ship if None."""
    questions = [read_question(file.path) for file in (resources or shipped()).of("questions")]
    questions.sort(key=lambda question: (THEMES.index(question.theme), question.name))
    return {question.name: question for question in questions}


def ask(graph: KnowledgeGraph, question: str, robot: str | None = None) -> AnswerTable:
    """Answer a named question, of all robots or of the one called `robot`, or a question in SPARQL.

    Where SPARQL has no answer, its faults name terms that the ontology lacks. InputError where the question or the
    robot is unknown, or the question is not one of a single robot.
    """
    if robot is None:
        answer = graph.query(_text(question, graph.resources))
        return answer if len(answer) else replace(answer, faults=[*answer.faults, *_unknown_terms(graph, question)])
    named = named_questions(graph.resources).get(question)
    if named is None or not named.of_robot:
        raise InputError(f"{question!r} does not ask about one robot; leave --robot out")
    return graph.query(named.text, {"arm": robot_named(graph, robot)})


def _unknown_terms(graph: KnowledgeGraph, text: str) -> Iterator[str]:
    """Say which terms of a query the ontology lacks, each with the nearest that it has."""
    terms = f"?term a ?kind FILTER(STRSTARTS(STR(?term), '{IRT}'))"
    rows = graph.query(f"SELECT DISTINCT ?term {{ GRAPH <{GRAPH_ONTOLOGY}> {{ {terms} }} }}")
    known = [row["term"].removeprefix(IRT) for row in rows]
    for name in sorted(set(_TERM.findall(text)) - set(known)):
        near = get_close_matches(name, known, 1)
        yield f"the ontology has no irt:{name}" + (f": did you mean irt:{near[0]}?" if near else "")


def robot_named(graph: KnowledgeGraph, name: str | None) -> str:
    """Return the IRI of the robot called `name`, of the only one where None.

    Raises InputError where there is none of the name, with the nearest one, or where there are others.
    """
    rows = graph.query("SELECT ?arm ?name { ?arm irt:has_Information / irt:IR_Name ?name } ORDER BY ?name")
    arms = {row["name"]: row["arm"] for row in rows}
    known = ", ".join(list(arms)[:10]) + (", ..." if len(arms) > 10 else "")
    if name is None and len(arms) == 1:
        return str(*arms.values())
    if name is None:
        raise InputError(f"say which robot by --robot; known are {known}" if arms else "the graph knows no robot")
    if name not in arms:
        near = get_close_matches(name, arms, n=1)
        raise InputError(
            f"there is no robot {name!r}: " + (f"did you mean {near[0]}?" if near else f"known are {known}")
        )
    return str(arms[name])


def to_json(table: AnswerTable) -> str:
    """Write the rows as a JSON array of objects; what is unbound or not finite is null."""
    rows = [{name: _plain(value) for name, value in row.items()} for row in table]
    return json.dumps(rows, indent=2, ensure_ascii=False, allow_nan=False)


def to_csv(table: AnswerTable) -> str:
    """Write the rows as CSV with a header (RFC 4180); what is unbound is empty."""
    out = io.StringIO()
    writer = csv.writer(out)
    writer.writerow(table.columns)
    writer.writerows(
        [row[name].isoformat() if isinstance(row[name], date) else row[name] for name in table.columns] for row in table
    )
    return out.getvalue()


def _plain(value: Any) -> Any:
    if isinstance(value, date):
        return value.isoformat()
    return None if isinstance(value, float) and not math.isfinite(value) else value


def read_question(file: Path) -> NamedQuery:
    """Read a named question. Raises InputError where it is not UTF-8, or its header lacks something."""
    text = read_text(file, MOST_BYTES)
    header = dict(_HEADER.findall(text))
    lacking = [name for name in ("title", "question", "theme") if name not in header]
    if lacking:
        raise InputError(f"{file}, line 1: a question begins with `# {lacking[0]}: ...`; add that line")
    if header["theme"] not in THEMES:
        raise InputError(f"{file}: its theme is {header['theme']!r}; take one of {', '.join(THEMES)}")
    concluded = tuple(header.get("concluded", "").split(", ")) if "concluded" in header else ()
    of_robot = header.get("of") == "robot"
    return NamedQuery(file.stem, header["title"], header["question"], header["theme"], of_robot, concluded, text)


def columns_of(text: str) -> tuple[str, ...]:
    """Return what a query selects; no data are needed for that."""
    answer = Store().query(text, base_iri=ID, prefixes=PREFIXES)
    return tuple(variable.value for variable in answer.variables) if isinstance(answer, QuerySolutions) else ()


def _text(question: str, resources: Resources) -> str:
    known = named_questions(resources)
    if question in known:
        return known[question].text
    if not is_readable(question, None):
        raise InputError(f"the query {NOT_READABLE}; make it simpler")
    if _QUERY_FORM.search(question):
        return question
    near = get_close_matches(question, known, n=1)
    hint = (
        f"did you mean {near[0]}?"
        if near
        else "`irtwin query` alone lists them; SPARQL begins with SELECT, ASK or CONSTRUCT"
    )
    raise InputError(f"there is no question {question!r}: {hint}")
