"""The forms of the plant's pages: what a user says was done, or is so, comes in; an update of the graph goes out."""

from __future__ import annotations

from dataclasses import dataclass

from pyoxigraph import Literal, NamedNode

from irtwin.errors import InputError
from irtwin.knowledge.vocabulary import GRAPH_ASSERTED, IRT
from irtwin.report.plant.choice import day
from irtwin.serve.protocol import Operation, Refusal, named, read_fields

KNOWN = f"?action a <{IRT}Saving_Action> ; <{IRT}saves_at> ?robot"  # what an action must be to be done
_TAKEN_BACK = "DELETE WHERE {{ GRAPH <{graph}> {{ {action} ?said ?of_it }} }}"
_DONE = """PREFIX irt: <{irt}>
DELETE {{ GRAPH <{graph}> {{ {action} irt:Done_On ?before }} }}
INSERT {{ GRAPH <{graph}> {{
  {action} a irt:Saving_Action ; irt:saves_at ?robot ; irt:applies_Remedy ?remedy ; irt:Done_On {day}
}} }}
WHERE {{
  {action} irt:saves_at ?robot
  OPTIONAL {{ {action} irt:applies_Remedy ?remedy }} OPTIONAL {{ {action} irt:Done_On ?before }}
}}"""


@dataclass(frozen=True)
class SaidDone:
    """That a saving action was done: the action, the update, its author, and the header that the token makes."""

    action: str
    operation: Operation
    author: str
    authorization: str


@dataclass(frozen=True)
class SaidValue:
    """What a robot, run, joint or limit has: a property, its value as text, the author, and the token's header."""

    about: str
    property: str
    value: str
    author: str
    authorization: str

    def operation(self, datatype: str) -> Operation:
        """Return the update that says the value as a literal of a datatype; without one nothing is said any more."""
        said = f"<{self.about}> <{self.property}>"
        if not self.value:
            return Operation("update", f"DELETE WHERE {{ {said} ?value }}")
        return Operation("update", f"INSERT DATA {{ {said} {Literal(self.value, datatype=NamedNode(datatype))} }}")


def read_done(body: bytes) -> SaidDone:
    """Read a form of `action`, `day`, `by` and `token`; without a day what was said is taken back. Raises Refusal."""
    fields = read_fields(body)
    said = fields.get("action", "")
    action = named(said, 400, f"action {said[:100]!r} is no IRI; take one of the list")
    try:
        done_on = day(fields.get("day", ""))
    except InputError as error:
        raise Refusal(400, f"day: {error}") from None
    change = _DONE if done_on else _TAKEN_BACK
    text = change.format(irt=IRT, graph=GRAPH_ASSERTED, action=action, day=Literal(done_on))
    return SaidDone(action.value, Operation("update", text), *_who(fields))


def read_value(body: bytes) -> SaidValue:
    """Read a form of `what`, an individual's IRI and a property's, `value`, `by` and `token`. Raises Refusal."""
    fields = read_fields(body)
    try:
        about, name = (NamedNode(iri).value for iri in fields.get("what", "").split(" "))
    except ValueError:
        raise Refusal(400, f"what {fields.get('what', '')[:100]!r} is not of the list: take one of it") from None
    return SaidValue(about, name, fields.get("value", "").strip(), *_who(fields))


def _who(fields: dict[str, str]) -> tuple[str, str]:
    return fields.get("by", ""), f"Bearer {fields.get('token', '')}"
