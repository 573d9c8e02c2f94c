"""The times that stored live runs cover: a sample of such a time was stored before."""

from __future__ import annotations

from bisect import bisect_right, insort
from collections import defaultdict
from datetime import UTC
from itertools import accumulate

from sqlalchemy import select

from irtwin.storage.database import Workspace
from irtwin.storage.schema import WATCHED_RUNS, Run

_STEP = 2e-6  # s: the database keeps moments to the microsecond


class StoredTimes:
    """From the first sample to the last of each live run, by robot_id; times in s since 1970."""

    def __init__(self, place: Workspace) -> None:
        """Read the runs of a workspace."""
        self._runs: defaultdict[str, list[tuple[float, float, str]]] = defaultdict(list)  # by start
        self._reach: dict[str, list[tuple[float, str]]] = {}  # of each and those before: the last end, and whose
        runs = select(Run.robot_id, Run.run_id, Run.start_time, Run.run_time_s).where(Run.kind.in_(WATCHED_RUNS))
        with place.reading() as session:
            for robot_id, run_id, began, length in session.execute(runs):
                assert began is not None  # of a run that was watched
                start = began.replace(tzinfo=UTC).timestamp()
                self.add(robot_id, run_id, start, start + length)

    def add(self, robot_id: str, run_id: str, start: float, end: float) -> None:
        """Note one more run."""
        runs = self._runs[robot_id]
        insort(runs, (start - _STEP, end + _STEP, run_id))
        self._reach[robot_id] = list(accumulate(((end, run_id) for _, end, run_id in runs), max))

    def end(self, robot_id: str) -> float:
        """Return the end of the last run of a robot; 0 where there is none."""
        return max((end for _, end, _ in self._runs[robot_id]), default=0.0)

    def run_in(self, robot_id: str, first: float, last: float) -> str | None:
        """Return a run that covers a time from the first to the last; None where none does."""
        begun = bisect_right(self._runs[robot_id], (last, float("inf"), ""))
        if not begun:
            return None
        end, run_id = self._reach[robot_id][begun - 1]
        return run_id if end >= first else None
