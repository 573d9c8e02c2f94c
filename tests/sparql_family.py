"""SPARQL texts made of a small grammar, with the words SERVICE and LOAD where a lexer may take them for another thing.

Every choice is a seed's, so that a text that fails is found again by its number.
"""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from random import Random

_KINDS = ('"', "'", '"""', "'''")
_JUNK = (
    "a",
    '"',
    "'",
    '"""',
    "'''",
    "<",
    ">",
    "{",
    "}",
    "(",
    ")",
    "\\",
    "SERVICE",
    "LOAD ",
    ":",
    "?",
    ".",
    ";",
    "#",
    "é",
)
_IN_STRINGS = (
    "a",
    "SERVICE ",
    "load",
    "\\\\",
    "\\n",
    '\\"',
    "\\'",
    "\\u0041",
    "\\U0001F916",
    "#",
    "<",
    ">",
    "{",
    "}",
    "?a",
)
_IN_IRIS = ("a", "SERVICE", "load", "?x=1", "(", ")", "'", ",", ";", "*", ":", "\\u0041", "%20")
_IN_NAMES = ("a", "SERVICE", ".SERVICE", ".load", "1", "-b", "_", "%41", "\\-", "\\'", "\\(", "\\?", ":", "é", "a.b")
_VARIABLES = ("?a", "?b", "$c", "?service", "$LOAD", "?SERVICEa", "?a1")
_NUMBERS = ("1", "1.5", ".5", "1e3", "2.5E-1", "+1", "-2")
_AROUND_A_GROUP = (
    "{group}",
    "{group}UNION{space}{group}",
    "OPTIONAL{gap}{group}",
    "MINUS{group}",
    "GRAPH{space}?g{gap}{group}",
    "FILTER NOT EXISTS{group}",
    "{{SELECT * {group}}}",
)
_OPERATORS = ("<", ">", "<=", ">=", "=", "!=", "&&", "||", "+", "-", "*", "/")
_PREFIXES = ("", "x", "service", "load", "a.service")


class Family:
    """The texts of one seed, in which a clause reads from `url`; harmless ones where there is none."""

    def __init__(self, seed: int, url: str | None):
        self._random = Random(seed)
        self._url = url
        self._fresh = 0

    def query(self) -> str:
        """A SELECT, ASK, CONSTRUCT or DESCRIBE."""
        head = self._one(
            ("SELECT *", "SELECT*", "ASK", "DESCRIBE * WHERE", "CONSTRUCT{?a ?b $c}WHERE", "SELECT * WHERE")
        )
        return self._prologue() + head + self._space() + self._outer_group() + self._space()

    def update(self) -> str:
        """One to three operations, one of which may be a LOAD."""
        operations = [self._operation() for _ in range(self._random.randint(1, 3))]
        if self._url is not None and self._random.random() < 0.7:
            silent = self._one(("", "SILENT" + self._space()))
            load = f"{self._one(('LOAD', 'load', 'Load'))}{self._space()}{silent}{self._target()}"
            operations.insert(self._random.randint(0, len(operations)), load)
        return self._prologue() + f"{self._space()};{self._space()}".join(operations) + self._space()

    def _operation(self) -> str:
        data = f"{{{self._space()}<http://e/s> <http://e/p> {self._literal()}{self._space()}}}"
        where = "WHERE" + self._space() + (self._outer_group() if self._random.random() < 0.5 else self._group(1))
        return self._one((f"INSERT{self._space()}DATA{data}", f"INSERT{{?a ?b 1}}{where}", f"DELETE{data}{where}"))

    def _prologue(self) -> str:
        said = [f"PREFIX {name}:{self._space()}<http://e/{name}#>{self._space()}" for name in _PREFIXES]
        if self._url is not None:
            said.append(f"PREFIX l: <{self._url}>{self._space()}")
        self._random.shuffle(said)
        return self._space() + "".join(said)

    def _outer_group(self) -> str:
        if self._url is None:
            return self._group(2)
        # A clause that reads from elsewhere comes first, or after what gives it something to join with.
        before = "" if self._random.random() < 0.25 else self._binding()
        return f"{{{self._space()}{before}{self._gap()}{self._service()}{self._gap()}{self._elements(1)}}}"

    def _service(self) -> str:
        word = self._one(("SERVICE", "service", "Service"))
        silent = self._one(("", "SILENT", "silent")) + self._gap()
        return f"{word}{self._gap()}{silent}{self._target()}{self._gap()}{{?s ?p ?o}}"

    def _target(self) -> str:
        return self._one((f"<{self._url}>", f"<{self._url}>", f"l:{self._one(('x', '', 'x.SERVICE'))}"))

    def _group(self, depth: int) -> str:
        return f"{{{self._space()}{self._elements(depth)}{self._space()}}}"

    def _elements(self, depth: int) -> str:
        return self._space().join(self._element(depth) for _ in range(self._random.randint(0, 3)))

    def _element(self, depth: int) -> str:
        if depth == 0:
            return self._triples()
        form = self._random.choice((self._triples, self._binding, self._binding, *_AROUND_A_GROUP))
        if not isinstance(form, str):
            return form()
        return form.format(group=self._group(depth - 1), space=self._space(), gap=self._gap())

    def _triples(self) -> str:
        self._fresh += 1
        subject = self._made(self._name, self._iri, lambda: f"_:b{self._fresh}.SERVICE", lambda: "?s")
        verb = self._made(self._iri, self._name, lambda: "a", lambda: "?p")
        return f"{subject}{self._space()}{verb} {self._term()}{self._one((' .', ' ;.', '.', ' .'))}{self._space()}"

    def _binding(self) -> str:
        """What binds or filters, with an end that a lexer may take for the beginning of something else."""
        self._fresh += 1
        new = f"?new{self._fresh}"
        return self._made(
            lambda: f"FILTER({self._expression(2)})",
            lambda: f"FILTER({self._one(_VARIABLES)}<{self._one(_VARIABLES)})",
            lambda: f"BIND({self._expression(2)}AS{self._gap()}{new})",
            lambda: f"VALUES {new}{{{self._value()}{self._space()}{self._value()}}}",
            lambda: f"BIND({self._string()}AS {new})",
            lambda: f"BIND({self._name()} AS {new})",
            lambda: f"FILTER({self._one(_NUMBERS)}<={self._string()})",
        )

    def _expression(self, depth: int) -> str:
        if depth == 0 or self._random.random() < 0.3:
            return f"{self._term()} "
        left, right = self._expression(depth - 1), self._expression(depth - 1)
        return self._made(
            lambda: f"({left}{self._one(_OPERATORS)}{self._space()}{right})",
            lambda: f"{self._one(_VARIABLES)}<{self._one(_VARIABLES)}",
            lambda: f"STR({left})",
            lambda: f"IF({left},{right},{left})",
            lambda: f"CONTAINS({self._string()},{self._string()})",
            lambda: f"COALESCE({left},{right})",
            lambda: f"({left}IN({right}))",
            lambda: f"!({left})",
        )

    def _term(self) -> str:
        return self._made(
            lambda: self._one(_VARIABLES),
            lambda: self._one(_NUMBERS),
            self._literal,
            self._iri,
            self._name,
            lambda: "true",
        )

    def _value(self) -> str:
        return self._made(lambda: self._one(_NUMBERS), self._literal, self._iri, lambda: "UNDEF")

    def _literal(self) -> str:
        return self._string() + self._one(("", "", "@en", "@en-service", "^^<http://e/load>"))

    def _string(self) -> str:
        quotes = self._one(_KINDS)
        inside = [*_IN_STRINGS, *({'"', "'"} - {quotes[0]})]
        if len(quotes) == 3:
            inside += ["\n", "\r", f"{quotes[0]}b", f"{quotes[:2]}SERVICE"]
        text = "".join(self._random.choices(inside, k=self._random.randint(0, 5)))
        return f"{quotes}{text}{quotes}"

    def _iri(self) -> str:
        inside = "".join(self._random.choices(_IN_IRIS, k=self._random.randint(0, 4)))
        return f"<http://e/{inside}{self._one(('', '', '#SERVICE'))}>"

    def _name(self) -> str:
        local = "".join(self._random.choices(_IN_NAMES, k=self._random.randint(0, 3))).lstrip(".-")
        return f"{self._one(_PREFIXES)}:{local}"

    def _space(self) -> str:
        """Something between two words: comments too, ended by CR, LF or both."""
        if self._random.random() < 0.6:
            return self._one((" ", "\n", "\t", "\r", "\r\n"))
        junk = "".join(self._random.choices(_JUNK, k=self._random.randint(0, 4)))
        return f" #{junk}{self._one((chr(13), chr(10), chr(13) + chr(10)))}"

    def _gap(self) -> str:
        """Something, or nothing, between two words that are told apart without."""
        return self._one(("", self._space()))

    def _one(self, choices: tuple[str, ...]) -> str:
        return self._random.choice(choices)

    def _made(self, *choices: Callable[[], str]) -> str:
        """Make one of several texts, and none of the others."""
        return self._random.choice(choices)()


class Listener:
    """Counts who connects to an address of this machine, and answers that there is nothing."""

    def __init__(self) -> None:
        self._socket = socket.create_server(("127.0.0.1", 0), backlog=200)
        self.url = f"http://127.0.0.1:{self._socket.getsockname()[1]}/"
        self._connections = 0
        threading.Thread(target=self._listen, daemon=True).start()

    def connections(self) -> int:
        """Return how many have come, those included that come while this asks: it comes last itself."""
        before = self._connections
        with socket.create_connection(self._socket.getsockname()) as own:
            own.recv(1)  # all before it have been counted
        self._connections -= 1
        assert self._connections >= before
        return self._connections

    def close(self) -> None:
        self._socket.close()

    def _listen(self) -> None:
        while True:
            try:
                connection, _ = self._socket.accept()
            except OSError:
                return
            self._connections += 1
            with connection, suppress(OSError):
                connection.sendall(b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\nConnection: close\r\n\r\n")


@contextmanager
def listener() -> Iterator[Listener]:
    """A listener that is closed in the end."""
    listening = Listener()
    try:
        yield listening
    finally:
        listening.close()
