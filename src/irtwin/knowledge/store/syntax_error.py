"""What is wrong with a SPARQL text, in one short line made of the parser's own."""

from __future__ import annotations

import re

from irtwin.knowledge.vocabulary import PREFIXES

_ERROR = re.compile(r"error at (\d+):(\d+): (?:expected (?:one of )?)?(.*)", re.DOTALL)
_CLASSES = re.compile(r"\[[^\]]*\]")  # of characters that could go on
_ITEM = re.compile(r'"((?:[^"\\]|\\.)*)"|([^",]+)')  # a token in quotes, or a keyword or reason without
_PREFIX_BEFORE = re.compile(r"([^\s:<>{}().;,?$^|/'\"]*):[^\s]*$")
_MOST = 8  # tokens named
_SHOWN = 20  # characters of what stands there


def in_words(error: SyntaxError, text: str) -> str:
    """Return where the text fails, what stands there, and what could: "error at 1:9: found X, expected one of Y Z"."""
    match = _ERROR.fullmatch(str(error))
    if match is None:
        return str(error)
    line, column = int(match[1]), int(match[2])
    lines = text.split("\n")
    own = lines[line - 1] if line <= len(lines) else ""
    at = f"error at {line}:{column}"
    if "Prefix not found" in match[3]:
        name = _PREFIX_BEFORE.search(own[: column - 1])
        prefix = "" if name is None else name[1]
        return f'{at}: the prefix "{prefix}:" is not declared; write PREFIX, or use one of {", ".join(PREFIXES)}'
    items = [(quoted or bare).strip() for quoted, bare in _ITEM.findall(_CLASSES.sub("", match[3]))]
    reasons = [item for item in items if " " in item]
    if reasons:
        return f"{at}: {reasons[0]}"
    tokens = [item.replace('\\"', '"') for item in items if item]
    message = f"{at}: found {_found(own, column, line == len(lines))}"
    some = " ".join(tokens[:_MOST]) + (" ..." if len(tokens) > _MOST else "")
    return f"{message}, expected {'one of ' * (len(tokens) > 1)}{some}" if tokens else message


def _found(line: str, column: int, last: bool) -> str:
    rest = line[column - 1 :].split(maxsplit=1)
    if not rest:
        return "the end" if last else "the end of the line"
    return f'"{rest[0][:_SHOWN]}"'
