"""A diagnosis in one line, for the terminal."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from irtwin.report.gap.document import largest_first
from irtwin.report.wording import listed

_CHANGED = {"reference": "{} changed since the reference runs", "simulated": "the simulator lacks {}"}


def line(diagnosis: Mapping[str, Any], against: str | None) -> str:
    """Return the verdict and its causes, the largest first; `against`: role of the runs compared with, if any."""
    words = {"missing": "the twin lacks {}", "changed": _CHANGED.get(against or "", "{} changed")}
    named: dict[str, list[str]] = {}
    for rank in largest_first(diagnosis):
        cause = diagnosis["causes"][rank - 1]
        named.setdefault(cause["scope"], []).append(_named(cause))
    said = [words[scope].format(listed(causes)) for scope, causes in named.items()]
    return f"{diagnosis['verdict']}: {'; '.join(said) or 'no cause named'}"


def _named(cause: Mapping[str, Any]) -> str:
    names = " or ".join(name.replace("_", " ") for name in (cause["effect"], *cause["indistinguishable_from"]))
    return f"{names} on {listed(cause['joints'])}" if cause["joints"] else names
