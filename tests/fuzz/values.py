"""Values that nobody expects where a name, a number or a file should stand."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

DEEP = "@deep@"  # stands for a list in a list, 5,000 times: JSON of Python's cannot write it
ODD: tuple[Any, ...] = (
    *("../../../x", "../../secret", "OUTSIDE/etc/passwd", "OUTSIDE/x", "..", ".", "", "/", "a/b", "arm/../x"),
    *("x" * 300, "a\0b", "\x1b[31mred", "line\nline", "\ud800", "\u202e", "e\u0301", "名前", "%s%n", "{{7*7}}"),
    *("<script>1</script>", "x> <urn:a> <urn:b", 'x" ; DROP TABLE robot --', "https://w3id.org/irtwin#", "irt:x"),
    *("x" * 100_000, "arm2", "0000-00-00", "9999-12-31T23:59:59", "0001-01-01T00:00:00+23:59", "2026-02-30T00:00:00"),
    *(float("nan"), float("inf"), -float("inf"), 1e30, -1e30, 1e308, 5e-324, 10**30, 2**63, -1, 0, -0.0, 10**400, True),
    *(None, [], {}, [1], {"a": 1}, DEEP),
)


def odd(rng: np.random.Generator) -> Any:
    """Return one of them."""
    return ODD[rng.integers(len(ODD))]


def as_json(value: Any) -> str:
    """Return a value as JSON, of which some readers know no NaN."""
    return json.dumps(value).replace(f'"{DEEP}"', "[" * 5000 + "]" * 5000)


def some(rng: np.random.Generator, options: Any) -> Any:
    """Return one of several options, as it is."""
    there = list(options)
    return there[rng.integers(len(there))]
