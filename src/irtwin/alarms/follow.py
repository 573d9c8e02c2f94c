"""The graph is asked for its alarms again and again; what is new is told, once, over restarts as well."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from datetime import UTC, datetime
from pathlib import Path

from irtwin.alarms.alarm import ACTIVE, Alarm, Event, message
from irtwin.announce import Announce
from irtwin.errors import InputError
from irtwin.input_file import read_text
from irtwin.json_text import parse_json
from irtwin.storage import files

EVERY = 1.0  # s between two looks
Look = Callable[[], Sequence[Alarm]]
_FOLDER, _TOLD = "alarms", "told.json"  # in the workspace
_MOST_BYTES = 100_000_000


class ToldAlarms:
    """What was told of alarms until now, kept in a file. Of alarms that were over before the first look nothing is."""

    def __init__(self, file: Path) -> None:
        """Begin with what the file holds. Raises InputError where it cannot be understood."""
        self._file = file
        self._known: dict[tuple[str | None, ...], Alarm] | None = None
        if file.exists():
            try:
                alarms = [Alarm.of(row) for row in parse_json(read_text(file, _MOST_BYTES))]
            except (ValueError, KeyError, TypeError) as error:
                raise InputError(f"{file}: cannot be understood ({error}); delete it, and all is told anew") from None
            self._known = {alarm.key: alarm for alarm in alarms}

    def news(self, alarms: Sequence[Alarm]) -> list[tuple[Event, Alarm]]:
        """Return what was not told of the alarms that there are now. One that is there no more is over."""
        now = {alarm.key: alarm for alarm in alarms}
        before = self._known
        if before is None:
            before = {key: alarm for key, alarm in now.items() if alarm.state != ACTIVE}
        news: list[tuple[Event, Alarm]] = []
        for key, alarm in now.items():
            if key not in before:
                news.append(("raised", alarm))
            if alarm.state != ACTIVE and (key not in before or before[key].state == ACTIVE):
                news.append(("cleared", alarm))
        gone = (alarm for key, alarm in before.items() if key not in now and alarm.state == ACTIVE)
        news += [("cleared", alarm) for alarm in gone]
        if news or self._known is None:
            self._known = now
            files.write(self._file, json.dumps([alarm.as_dict() for alarm in alarms], indent=1).encode())
        return news


def follow(
    look: Look,
    told: ToldAlarms,
    write: Callable[[bytes], None],
    done: threading.Event,
    announce: Announce,
    sparql: Mapping[str, str],
) -> None:
    """Write each news as a line of JSON, until it is `done`; `sparql`: of rules, by name.

    A graph that cannot be read is announced, and asked again; the first look raises InputError.
    """
    alarms, fault = look(), ""
    while True:
        for event, alarm in told.news(alarms):
            write(message(event, alarm, datetime.now(UTC), sparql.get(alarm.rule)))
        if done.wait(EVERY):
            return
        try:
            alarms, fault = look(), ""
        except InputError as error:
            if str(error) != fault:
                announce(f"alarms are not known now: {error}")
            fault = str(error)


@contextmanager
def told_in(workspace: Path) -> Iterator[ToldAlarms]:
    """Give what was told of a workspace's alarms. Raises InputError where another process tells them already."""
    folder = files.inside(workspace, _FOLDER)
    with files.told_when_full(workspace), ExitStack() as held:
        folder.mkdir(exist_ok=True)
        try:
            held.enter_context(files.locked(folder))
        except BlockingIOError:
            raise InputError(
                f"{workspace}: another `irtwin alarms --follow` tells its alarms; stop that first"
            ) from None
        yield ToldAlarms(folder / _TOLD)
