"""How the stream of a live run goes: whether good states come, and if not, why not, in words."""

from __future__ import annotations

import time
from datetime import datetime
from typing import Any

from irtwin.live.frozen_values import FROZEN
from irtwin.storage.schema import moment_of

STALE = 2.0  # s without a good state; of a slow source five times its usual pause
_PAUSES = 5.0


def seconds(by: float) -> str:
    """Say how many seconds: three digits of few, all of many."""
    return f"{by:.3g} s" if abs(by) < 1000 else f"{by:.0f} s"


class StreamHealth:
    """Told of good states and of late ones; `stale_since` is when the last good one came, None while they come.

    Good states whose values are frozen make it stale too, from when they were first the same.
    """

    def __init__(self) -> None:
        self.stale_since: datetime | None = None
        self.reason: str | None = None
        self._heard = self._began = time.monotonic()
        self._count = 0
        self._late: str | None = None
        self.frozen: str | None = None
        self._ended = False

    def good(self, frozen: str | None = None) -> None:
        """Note a state that was taken; `frozen`: why its values are none, though it came."""
        self._heard = time.monotonic()
        self._count += 1
        self._late, self.frozen = None, frozen
        if frozen is None:
            self.stale_since = self.reason = None

    def late(self, stamp: float, newest: float) -> None:
        """Note a state that is not later than the newest, times in s since 1970."""
        if stamp == newest:
            self._late = "the stream repeats the state that was taken last"
        else:
            self._late = f"the stream went back in time, by {seconds(newest - stamp)}"

    def leaps(self, by: float) -> None:
        """Note a state whose time is so many seconds away that nobody trusts it yet."""
        self._late = f"the stream's time leaps by {seconds(by)}"

    def end(self, reason: str) -> None:
        """Note why the run ends before its time."""
        self.stale_since, self.reason = moment_of(time.time() - time.monotonic() + self._heard), reason
        self._ended = True

    def look(self) -> bool:
        """Note whether the stream is stale now; return whether that is news."""
        silence = FROZEN if self.frozen else time.monotonic() - self._heard
        usual = (self._heard - self._began) / max(self._count - 1, 1)
        quiet = bool(self.frozen) or silence >= max(STALE, _PAUSES * usual)
        if self.stale_since is not None or not self._count or not quiet:
            return False
        self.stale_since = moment_of(time.time() - silence)
        self.reason = self.frozen or self._late or f"no state came for {silence:.1f} s"
        return True

    def said(self) -> dict[str, Any]:
        """Return what a row says of the stream."""
        if self.stale_since is None:
            return {"stream_state": "flowing"}
        return {"stream_state": "stale", **self._why()}

    def of_end(self) -> dict[str, Any]:
        """Return what the row of a run that is over says of why it ended before its time."""
        return self._why() if self._ended else {}

    def _why(self) -> dict[str, Any]:
        return {"stale_since": self.stale_since, "stale_reason": self.reason}
