"""Draws cases for FUZZ_SECONDS (600 by default), and keeps the smallest case of each fault in `kept/`, as a test.

`make fuzz`; FUZZ_SEED repeats a session. Exit status 1 where a fault was found, or a case could not be made.
"""

from __future__ import annotations

import hashlib
import os
import re
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from hypothesis import HealthCheck, Phase, given, seed, settings
from tests.fuzz.case import Case, cases
from tests.fuzz.commands import Unmade, try_case
from tests.fuzz.fault import Fault

KEPT = Path(__file__).parent / "kept"
_ROUND = 20  # draws by one seed, before it is looked which commands came seldom


class Session:
    """Draws until the time is over; `faults` counts each kind, `tried` each command, `unmade` what could not be."""

    def __init__(self, seconds: float, sound: Path) -> None:
        self.faults: dict[str, int] = {}
        self.tried: Counter[str] = Counter()
        self.draws = 0
        self.unmade = 0
        self._sound = sound
        self._seen: set[Case] = set()  # a drawing repeats itself
        self._end = time.monotonic() + seconds

    @property
    def commands(self) -> Counter[str]:
        """How often each command was tried, however it ended."""
        count: Counter[str] = Counter()
        for how, times in self.tried.items():
            count[how.rpartition(": ")[0]] += times
        return count

    @property
    def over(self) -> bool:
        """Whether the time is over."""
        return time.monotonic() >= self._end

    def take(self, case: Case) -> None:
        """Try a case, keep it where it shows a fault that none smaller shows."""
        if self.over or case in self._seen:
            return
        self._seen.add(case)
        try:
            fault = try_case(case, self._sound, self.tried)
        except Unmade as error:
            self.unmade += 1
            print(f"not made, {error}", flush=True)
            return
        self.draws += 1
        if fault is None:
            return
        self.faults[fault.kind] = self.faults.get(fault.kind, 0) + 1
        if self.faults[fault.kind] == 1:
            print(f"draw {self.draws}, {fault.kind}\n{fault.said}", flush=True)
        _keep(case, fault)


def _keep(case: Case, fault: Fault) -> None:
    words = re.sub(r"[^a-z]+", "-", fault.kind.lower()).strip("-")[:60]
    file = KEPT / f"{words}-{hashlib.sha256(fault.kind.encode()).hexdigest()[:6]}.json"
    text = case.to_json()
    if not file.exists() or len(text) < len(file.read_text()):
        KEPT.mkdir(exist_ok=True)
        file.write_text(text)


def main() -> None:
    """Run a session."""
    number = int(os.environ.get("FUZZ_SEED", time.time_ns() % 1_000_000))
    seconds = float(os.environ.get("FUZZ_SECONDS", "600"))
    with tempfile.TemporaryDirectory(prefix="irtwin-sound-") as sound:
        session, began = Session(seconds, Path(sound)), time.monotonic()
        print(f"FUZZ_SEED={number}", flush=True)
        while not session.over:
            _draw(session, number)
            number += 1
            minutes = (time.monotonic() - began) / 60
            print(
                f"{session.draws} draws, {session.draws / minutes:.0f} a minute, "
                f"{sum(session.tried.values())} commands; {len(session.faults)} kinds of fault",
                flush=True,
            )
    for how, count in sorted(session.tried.items()):
        print(f"{count:6d}  {how}")
    for kind, count in sorted(session.faults.items(), key=lambda entry: -entry[1]):
        print(f"{count:6d}  {kind}")
    print(f"{session.unmade:6d}  cases that could not be made")
    sys.exit(bool(session.faults or session.unmade))


def _draw(session: Session, number: int) -> None:
    """Draw a round of cases by a seed."""
    drawn = settings(
        max_examples=_ROUND, deadline=None, database=None, phases=[Phase.generate], suppress_health_check=[*HealthCheck]
    )
    drawn(seed(number)(given(cases(tried=session.commands))(session.take)))()


if __name__ == "__main__":
    main()
