"""The form by which a user says that a saving action was done: a form in, an update of the graph out."""

from __future__ import annotations

from dataclasses import dataclass

from pyoxigraph import Literal, NamedNode

from irtwin.errors import InputError
from irtwin.knowledge.vocabulary import GRAPH_ASSERTED, IRT
from irtwin.report.plant.choice import day
from irtwin.serve.protocol import Operation, Refusal, read_fields

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
    """What the form says: the action, the update, its author, and the header that the token makes."""

    action: str
    operation: Operation
    author: str
    authorization: str


def read_form(body: bytes) -> SaidDone:
    """Read a form of `action`, `day`, `by` and `token`; without a day what was said is taken back. Raises Refusal."""
    fields = read_fields(body)
    try:
        action = NamedNode(fields.get("action", ""))
        done_on = day(fields.get("day", ""))
    except InputError as error:
        raise Refusal(400, f"day: {error}") from None
    except ValueError:
        raise Refusal(400, f"action {fields.get('action', '')[:100]!r} is no IRI; take one of the list") from None
    change = _DONE if done_on else _TAKEN_BACK
    text = change.format(irt=IRT, graph=GRAPH_ASSERTED, action=action, day=Literal(done_on))
    return SaidDone(action.value, Operation("update", text), fields.get("by", ""), f"Bearer {fields.get('token', '')}")
