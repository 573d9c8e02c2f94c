"""What a client may ask of the endpoint: SPARQL 1.1 Protocol, sections 2.1 and 2.2."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING
from urllib.parse import parse_qs

from pyoxigraph import NamedNode

if TYPE_CHECKING:  # a worker has no need of it
    from starlette.requests import Request

SERVER_FAILS = "the server that keeps the graph does not answer this: try again later, or ask for less"
FORM = "application/x-www-form-urlencoded"
QUERY = "application/sparql-query"
UPDATE = "application/sparql-update"

_DATASET = {"query": ("default-graph-uri", "named-graph-uri"), "update": ("using-graph-uri", "using-named-graph-uri")}
_MOST_PARAMETERS = 1000


class Refusal(Exception):
    """A request that is not answered: an HTTP status and one line that says why."""

    def __init__(self, status: int, message: str, headers: Mapping[str, str] | None = None):
        super().__init__(message)
        self.status = status
        self.message = message
        self.headers = dict(headers or {})


@dataclass(frozen=True)
class Operation:
    """A query or an update, with the graphs that the request chose as its dataset."""

    kind: str  # "query" or "update"
    text: str
    default_graphs: tuple[str, ...] = ()
    named_graphs: tuple[str, ...] = ()


async def read_body(request: Request, most: int, seconds: float) -> bytes:
    """Read a request's body of at most so many bytes, within so many seconds. Raises Refusal."""
    body = bytearray()
    try:
        async with asyncio.timeout(seconds):
            async for piece in request.stream():
                body += piece
                if len(body) > most:
                    raise Refusal(413, f"a request has at most {most:,} bytes")
    except TimeoutError:
        raise Refusal(408, "the request did not come in time") from None
    return bytes(body)


def read_get(query_string: str) -> Operation | None:
    """Read a GET request; None where it asks nothing, so that the service describes itself."""
    parameters = read_parameters(query_string)
    if "update" in parameters:
        raise Refusal(400, "an update is sent by POST, not by GET")
    return _operation("query", parameters) if "query" in parameters else None


def read_post(content_type: str, query_string: str, body: bytes) -> Operation:
    """Read a POST request: a form, or a query or an update as it is."""
    kind, _, rest = content_type.partition(";")
    kind = kind.strip().lower()
    if "charset" in rest.lower() and "utf-8" not in rest.lower():
        raise Refusal(415, "the charset of a request is UTF-8")
    if kind == FORM:
        return _form(read_parameters(_text(body)))
    if kind in (QUERY, UPDATE):
        parameters = read_parameters(query_string)
        name = "query" if kind == QUERY else "update"
        if "query" in parameters or "update" in parameters:
            raise Refusal(400, f"the {name} is in the body: leave it out of the address")
        return _operation(name, {**parameters, name: [_text(body)]})
    raise Refusal(415, f"POST takes {FORM}, {QUERY} or {UPDATE}, not {kind or 'a body without Content-Type'}")


def _form(parameters: Mapping[str, Sequence[str]]) -> Operation:
    given = [name for name in ("query", "update") if name in parameters]
    if len(given) != 1:
        raise Refusal(400, "a form holds one of `query` and `update`")
    return _operation(given[0], parameters)


def _operation(name: str, parameters: Mapping[str, Sequence[str]]) -> Operation:
    texts = parameters[name]
    if len(texts) > 1:
        raise Refusal(400, f"the request holds {len(texts)} times `{name}`: send one at a time")
    default, named = (tuple(parameters.get(key, ())) for key in _DATASET[name])
    return Operation(name, texts[0], default, named)


def read_parameters(encoded: str) -> dict[str, list[str]]:
    """Read the parameters of an address or a form."""
    try:
        return parse_qs(encoded, keep_blank_values=True, errors="strict", max_num_fields=_MOST_PARAMETERS)
    except UnicodeDecodeError:
        raise Refusal(400, "the parameters are not UTF-8") from None
    except ValueError:
        raise Refusal(400, f"more than {_MOST_PARAMETERS} parameters") from None


def read_fields(body: bytes) -> dict[str, str]:
    """Read a form that a page sends: the last value of each field."""
    return {name: values[-1] for name, values in read_parameters(body.decode("ascii", errors="replace")).items()}


def named(iri: str, status: int, why: str) -> NamedNode:
    """Return the node that an IRI names. Raises Refusal, with a status and why, where it is none."""
    try:
        return NamedNode(iri)
    except ValueError:
        raise Refusal(status, why) from None


def _text(body: bytes) -> str:
    try:
        return body.decode()
    except UnicodeDecodeError as error:
        raise Refusal(400, f"the body is not UTF-8, from byte {error.start} on") from None
