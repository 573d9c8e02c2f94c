"""A graph that a broken-off command left behind the database is brought up to date, while it is served."""

from __future__ import annotations

import asyncio
import logging
import os
import sys

from irtwin.asking import BEHIND
from irtwin.location import Location
from irtwin.serve.asking import Asking
from irtwin.serve.protocol import Refusal

LOOK = 5.0  # s between two looks
LONGEST = 600.0  # s between two tries, where they fail
_CONTRADICTIONS = 3  # the exit status of `irtwin workspace reason` that has concluded all but what contradicts itself
_log = logging.getLogger(__name__)


async def catch_up(asking: Asking, location: Location) -> None:
    """Look again and again how the graph stands; have `irtwin workspace reason` catch up where nobody is at work on it.

    What fails is said once, and tried again ever more seldom.
    """
    pause, told = LOOK, ""
    while True:
        fault = ""
        try:
            if await asking.standing() == BEHIND:
                fault = await _caught_up(location)
        except Refusal:
            pass  # all workers are taken, or one was lost: the next look tells
        if fault and fault != told:
            _log.warning("the graph is behind the database, and cannot catch up: %s", fault)
        pause, told = (min(2 * pause, LONGEST), fault) if fault else (LOOK, "")
        await asyncio.sleep(pause)


async def _caught_up(location: Location) -> str:
    """Bring the graph up to date in a process of its own; return what hindered it, in one line."""
    places = {"IRTWIN_DATABASE": location.database, "IRTWIN_GRAPH": location.graph_url}  # a URL may hold a password
    environment = {name: value for name, value in {**os.environ, **places}.items() if value is not None}
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "irtwin", "workspace", "reason", "--quiet", "--workspace", str(location.folder)),
        stdout=asyncio.subprocess.DEVNULL,
        stderr=asyncio.subprocess.PIPE,
        env=environment,
        start_new_session=True,  # Ctrl-C in the terminal is the server's alone
    )
    try:
        _, lines = await process.communicate()
    finally:
        if process.returncode is None:
            process.kill()
            await process.wait()
    if process.returncode in (0, _CONTRADICTIONS):
        return ""
    last = lines.decode(errors="replace").strip().rpartition("\n")[2]
    return last.removeprefix("irtwin: ") or f"`irtwin workspace reason` ended with status {process.returncode}"
