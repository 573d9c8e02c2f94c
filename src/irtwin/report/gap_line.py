"""A diagnosis in one line, for the terminal."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from irtwin.report.wording import listed

_LACKS = {"missing": "the twin lacks {}"}
_CHANGED = {"reference": "{} changed since the reference runs", "simulated": "the simulator lacks {}"}


def line(diagnosis: Mapping[str, Any], against: str | None) -> str:
    """Return the verdict and its causes; `against` is the role of the runs that the observed ones are held against."""
    said = []
    for scope, words in (_LACKS | {"changed": _CHANGED.get(against or "", "{} changed")}).items():
        causes = [_named(cause) for cause in diagnosis["causes"] if cause["scope"] == scope]
        said += [words.format(listed(causes))] if causes else []
    return f"{diagnosis['verdict']}: {'; '.join(said) or 'no cause named'}"


def _named(cause: Mapping[str, Any]) -> str:
    names = " or ".join(name.replace("_", " ") for name in (cause["effect"], *cause["indistinguishable_from"]))
    return f"{names} on {listed(cause['joints'])}" if cause["joints"] else names
