"""A diagnosis in one line, for the terminal."""

from __future__ import annotations

from irtwin.gap.document.document import Cause, Document
from irtwin.report.wording import listed

_CHANGED = {"reference": "{} changed since the reference runs", "simulated": "the simulator lacks {}"}


def line(diagnosis: Document, against: str | None) -> str:
    """Return the verdict and its causes, the largest first; `against`: role of the runs compared with, if any."""
    words = {"missing": "the twin lacks {}", "changed": _CHANGED.get(against or "", "{} changed")}
    named: dict[str, list[str]] = {}
    for cause in diagnosis.largest_first:
        named.setdefault(cause.scope, []).append(_named(cause))
    said = [words[scope].format(listed(causes)) for scope, causes in named.items()]
    return f"{diagnosis.verdict}: {'; '.join(said) or 'no cause named'}"


def refused(diagnosis: Document) -> list[str]:
    """Return a line for each effect that was refused as a cause."""
    return [
        f"refused: {one.effect.replace('_', ' ')}{f' on {listed(one.joints)}' if one.joints else ''}: {one.why}"
        for one in diagnosis.refused or ()
    ]


def _named(cause: Cause) -> str:
    names = " or ".join(name.replace("_", " ") for name in (cause.effect, *cause.indistinguishable_from))
    return f"{names} on {listed(cause.joints)}" if cause.joints else names
