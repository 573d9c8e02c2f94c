"""The form by which a user says a value of a robot, run, joint or limit: a form in, an update of the graph out."""

from __future__ import annotations

from dataclasses import dataclass

from pyoxigraph import Literal, NamedNode

from irtwin.serve.protocol import Operation, Refusal, read_fields


@dataclass(frozen=True)
class SaidValue:
    """What the form says: a property of an individual, its value as text, the author, and the token's header."""

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


def read_value(body: bytes) -> SaidValue:
    """Read a form of `what`, an individual's IRI and a property's, `value`, `by` and `token`. Raises Refusal."""
    fields = read_fields(body)
    try:
        about, name = (NamedNode(iri).value for iri in fields.get("what", "").split(" "))
    except ValueError:
        raise Refusal(400, f"what {fields.get('what', '')[:100]!r} is not of the list: take one of it") from None
    return SaidValue(
        about, name, fields.get("value", "").strip(), fields.get("by", ""), f"Bearer {fields.get('token', '')}"
    )
