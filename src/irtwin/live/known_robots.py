"""What a workspace knows of the robots that are watched: names, joints, twins, plans, and the times of their runs."""

from __future__ import annotations

from bisect import bisect_right, insort
from collections import defaultdict
from datetime import UTC
from itertools import accumulate

from sqlalchemy import select

from irtwin.announce import Announce
from irtwin.errors import InputError
from irtwin.live.joint_stream import State
from irtwin.providers.live_energy import KnownTwin, known_twin
from irtwin.providers.names import find_run
from irtwin.storage.database import Workspace
from irtwin.storage.schema import PLANNED_RUN, WATCHED_RUNS, JointRow, RobotRow, RunRow

_STEP = 2e-6  # s: the database keeps moments to the microsecond


class StoredTimes:
    """From the first sample to the last of each live run, by robot_id; times in s since 1970."""

    def __init__(self, place: Workspace) -> None:
        """Read the runs of a workspace."""
        self._runs: defaultdict[str, list[tuple[float, float, str]]] = defaultdict(list)  # by start
        self._reach: dict[str, list[tuple[float, str]]] = {}  # of each and those before: the last end, and whose
        runs = select(RunRow.robot_id, RunRow.run_id, RunRow.start_time, RunRow.run_time_s).where(
            RunRow.kind.in_(WATCHED_RUNS)
        )
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


class KnownRobots:
    """Robots of a workspace by robot_id: `joints`, base to flange, and `names`; `times` that stored runs cover.

    Twins and plans are read when they are asked for first.
    """

    def __init__(self, place: Workspace, announce: Announce) -> None:
        """Read what is known now; `announce` is told of a twin that cannot be read."""
        self._place, self._announce = place, announce
        self.joints: dict[str, list[str]] = {}
        with place.reading() as session:
            for robot_id, name in session.execute(select(JointRow.robot_id, JointRow.name).order_by(JointRow.position)):
                self.joints.setdefault(robot_id, []).append(name)
            robots = session.execute(select(RobotRow.robot_id, RobotRow.name))
            self.names = {robot_id: name for robot_id, name in robots}
        self.times = StoredTimes(place)
        self._twins: dict[str, KnownTwin | None] = {}
        self._plans: dict[tuple[str, str], str] = {}

    def twin(self, robot_id: str) -> KnownTwin | None:
        """Return a robot's twin, None where it has none, or none that can be read."""
        if robot_id not in self._twins:
            try:
                self._twins[robot_id] = known_twin(self._place, robot_id)
            except InputError as error:
                self._announce(f"{self.names[robot_id]}: watched without its twin: {error}")
                self._twins[robot_id] = None
        return self._twins[robot_id]

    def plan(self, state: State) -> str | None:
        """Return the run_id of the plan that a state says. Raises InputError where its robot has none of that name."""
        if state.performs is None:
            return None
        of = (state.robot_id, state.performs)
        if of not in self._plans:
            self._plans[of] = find_run(self._place, *of, PLANNED_RUN).run_id
        return self._plans[of]
