"""What of a plant is looked at: the days, robots that a text finds, in groups and in an order."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import date
from urllib.parse import urlencode

from irtwin.errors import InputError
from irtwin.report.questions import PageQuestion, Row

GROUPS = ("cell", "line", "type", "manufacturer")  # cell and line as the data sets' notes say them
SORTS = {  # of a line, by what a form calls it; the greatest first
    "saving": "could save a year", "energy": "energy", "standby": "standby, of energy", "standing": "stands still",
    "alarms": "alarms", "runs": "runs",
}  # fmt: skip
_OF_DAYS = ("energy", "days", "standstill", "made")  # questions that days narrow


@dataclass(frozen=True)
class Selection:
    """What is asked for; empty texts ask for all, in the order that the page has by itself."""

    first: str = ""
    last: str = ""
    find: str = ""
    group: str = ""
    sort: str = ""

    @property
    def query(self) -> str:
        """What keeps it in an address."""
        names = {"from": self.first, "to": self.last, "find": self.find, "group": self.group, "sort": self.sort}
        return urlencode({name: value for name, value in names.items() if value})

    def finds(self, robot: Row) -> bool:
        """Whether a row of `robots.rq` holds what is looked for, in its name or in what robots are grouped by."""
        return any(self.find.lower() in (robot[place] or "").lower() for place in ("name", *GROUPS))

    def of_days(self, questions: Mapping[str, PageQuestion]) -> dict[str, PageQuestion]:
        """Return a page's questions, those of energy narrowed to the runs that began on the days."""
        if not (self.first or self.last):
            return dict(questions)
        tests = [f'STR(?within) >= "{self.first}"'] if self.first else []
        tests += [f'STR(?within) < "{self.last}~"'] if self.last else []
        only = f"WHERE {{\n  ?run irt:Start_Time ?within FILTER({' && '.join(tests)})"
        return {
            name: replace(question, text=question.text.replace("WHERE {", only, 1)) if name in _OF_DAYS else question
            for name, question in questions.items()
        }


ALL = Selection()


def choice(asked: Mapping[str, str]) -> Selection:
    """Read what a form says; what it does not know is passed over. InputError where a day is none."""
    group, sort = asked.get("group", ""), asked.get("sort", "")
    return Selection(
        first=day(asked.get("from", "")),
        last=day(asked.get("to", "")),
        find=asked.get("find", "").strip(),
        group=group if group in GROUPS else "",
        sort=sort if sort in SORTS else "",
    )


def day(text: str) -> str:
    """Return a day as ISO 8601 writes it, "" for none. Raises InputError."""
    try:
        return date.fromisoformat(text.strip()).isoformat() if text.strip() else ""
    except ValueError:
        raise InputError(f"{text[:40]!r} is not a day: write it as 2026-03-02") from None
