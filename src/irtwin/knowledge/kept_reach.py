"""How far queries of rules look, kept in a file beside the graph: to work it out takes 0.5 s of each process."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib.metadata import version
from pathlib import Path
from typing import Any

from irtwin.errors import InputError
from irtwin.input_file import read_text
from irtwin.json_text import parse_json
from irtwin.knowledge import locality
from irtwin.knowledge.locality import Reach
from irtwin.knowledge.vocabulary import PREFIXES

FILE = "irtwin-reach.json"  # {"made_by": digest, "queries": {text: Reach}, "digest": of the queries}

_MOST_BYTES = 100_000_000


@contextmanager
def kept(folder: Path | None) -> Iterator[None]:
    """Let `locality` know what is kept in a graph's folder, and keep what it works out meanwhile."""
    if folder is None:
        yield
        return
    found = _read(folder / FILE)
    locality.KNOWN.update(found)
    yield
    if locality.KNOWN.keys() - found.keys():
        with suppress(OSError):  # it is another user's, or full: next time it is worked out again
            _write(folder)


def _read(file: Path) -> dict[str, Reach]:
    """Return what a file keeps; nothing where other software made it, or it was altered."""
    try:
        said = parse_json(read_text(file, _MOST_BYTES))
        if said["made_by"] == _made_by() and said["digest"] == _digest(said["queries"]):
            queries = said["queries"].items()
            return {text: Reach(**{name: frozenset(iris) for name, iris in reach.items()}) for text, reach in queries}
    except (InputError, ValueError, KeyError, TypeError):
        pass
    return {}


def _write(folder: Path) -> None:
    queries = {
        text: {name: sorted(iris) for name, iris in vars(reach).items()} for text, reach in locality.KNOWN.items()
    }
    temporary = folder / f".{FILE}"
    temporary.write_text(json.dumps({"made_by": _made_by(), "queries": queries, "digest": _digest(queries)}))
    temporary.replace(folder / FILE)


def _made_by() -> str:
    return _digest([Path(locality.__file__).read_text(), version("rdflib"), PREFIXES])


def _digest(what: Any) -> str:
    return hashlib.sha256(json.dumps(what, sort_keys=True).encode()).hexdigest()
