"""An alarm as the graph says it, and the message that tells of it."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from typing import Any, Literal, Self

from irtwin.knowledge.questions.queries import ask
from irtwin.knowledge.rules.files import all_rules
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.table import AnswerTable
from irtwin.resources import Resources

Event = Literal["raised", "cleared"]
ACTIVE = "active"
CONTRADICTION = "contradiction"  # what stands in the place of a rule
_QUESTION = "alarms"
_CONTRADICTIONS = """SELECT ?robot ?reason {
  ?of irt:Contradiction ?reason OPTIONAL { ?of irt:has_Information / irt:IR_Name ?robot }
  FILTER(BOUND(?robot) || NOT EXISTS { ?any irt:Contradiction ?reason ; irt:has_Information ?known })
} ORDER BY ?robot ?reason"""


@dataclass(frozen=True)
class Alarm:
    """One row of the question `alarms`, or a contradiction; times in ISO 8601, None where the graph says none."""

    robot: str | None
    run: str | None
    rule: str  # name of the rule that raised it, or CONTRADICTION
    since: str | None
    channel: str | None
    joint: str | None
    until: str | None
    state: str  # "active" or "cleared"
    reason: str

    @classmethod
    def of(cls, row: Mapping[str, Any]) -> Self:
        """Take a row of the question's answer, or what `as_dict` returned."""
        fields: dict[str, Any] = {name: _plain(row[name]) for name in cls.__dataclass_fields__}
        return cls(**fields)

    def as_dict(self) -> dict[str, str | None]:
        """Return the fields by name."""
        return asdict(self)

    @property
    def key(self) -> tuple[str | None, ...]:
        """What makes it this alarm and no other, whatever has become of it."""
        return self.robot, self.run, self.rule, self.since, self.channel, self.joint


def alarms(graph: KnowledgeGraph, robot: str | None = None) -> list[Alarm]:
    """Return all alarms that a graph knows, of all robots or of the one of this name; active or not."""
    return [*map(Alarm.of, ask(graph, _QUESTION, robot)), *_contradictions(graph, robot)]


def _contradictions(graph: KnowledgeGraph, robot: str | None) -> Iterator[Alarm]:
    """Yield an alarm for each contradiction of a robot; of none, if the ontology is what contradicts itself."""
    for row in graph.query(_CONTRADICTIONS):
        if robot is None or row["robot"] in (None, robot):
            yield Alarm(row["robot"], None, CONTRADICTION, None, None, None, None, ACTIVE, row["reason"])


def active(alarms: list[Alarm]) -> AnswerTable:
    """Return the alarms that are active, for people."""
    columns = ("since", "robot", "run", "reason", "rule")
    rows = ({name: alarm.as_dict()[name] for name in columns} for alarm in alarms if alarm.state == ACTIVE)
    return AnswerTable(columns, tuple(rows))


def message(event: Event, alarm: Alarm, at: datetime, sparql: str | None) -> bytes:
    """Return one line of JSON: what happened and when it was seen, the alarm, and the rule's SPARQL."""
    values = {name: value for name, value in alarm.as_dict().items() if name != "state"}
    return json.dumps(
        {"event": event, "at": at.astimezone(UTC).isoformat(timespec="seconds"), **values, "sparql": sparql},
        ensure_ascii=False,
    ).encode()


def sparql_of_rules(resources: Resources) -> dict[str, str]:
    """Return the CONSTRUCT of each rule that holds for a workspace, by the rule's name."""
    return {rule.name.rsplit("/", 1)[-1]: rule.construct for rule in all_rules(resources)}


def _plain(value: Any) -> str | None:
    return value.isoformat() if isinstance(value, datetime) else value
