"""The times that stored live runs cover: a sample of such a time was stored before."""

from __future__ import annotations

from bisect import bisect_right, insort
from collections import defaultdict
from datetime import UTC

from sqlalchemy import select

from irtwin.storage.database import Workspace
from irtwin.storage.schema import WATCHED_RUNS, Run

_STEP = 2e-6  # s: the database keeps moments to the microsecond


class StoredTimes:
    """From the first sample to the last of each live run, by robot_id; times in s since 1970."""

    def __init__(self, place: Workspace) -> None:
        """Read the runs of a workspace."""
        self._runs: defaultdict[str, list[tuple[float, float, str]]] = defaultdict(list)
        runs = select(Run.robot_id, Run.run_id, Run.start_time, Run.run_time_s).where(Run.kind.in_(WATCHED_RUNS))
        with place.reading() as session:
            for robot_id, run_id, began, length in session.execute(runs):
                assert began is not None  # of a run that was watched
                start = began.replace(tzinfo=UTC).timestamp()
                self.add(robot_id, run_id, start, start + length)

    def add(self, robot_id: str, run_id: str, start: float, end: float) -> None:
        """Note one more run."""
        insort(self._runs[robot_id], (start - _STEP, end + _STEP, run_id))

    def end(self, robot_id: str) -> float:
        """Return the end of the last run of a robot; 0 where there is none."""
        return max((end for _, end, _ in self._runs[robot_id]), default=0.0)

    def run_at(self, robot_id: str, time: float) -> str | None:
        """Return the run that covers a time; None where none does."""
        runs = self._runs[robot_id]
        place = bisect_right(runs, (time, float("inf"), "")) - 1
        if place < 0 or runs[place][1] < time:
            return None
        return runs[place][2]
