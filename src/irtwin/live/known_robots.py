"""What a workspace knows of the robots that are watched: names, joints, twins, plans, and the times of their runs."""

from __future__ import annotations

from collections.abc import Callable

from sqlalchemy import select

from irtwin.errors import InputError
from irtwin.live.joint_stream import State
from irtwin.live.stored_times import StoredTimes
from irtwin.providers.live_energy import KnownTwin, known_twin
from irtwin.providers.names import find_run
from irtwin.storage.database import Workspace
from irtwin.storage.schema import PLANNED_RUN, Joint, Robot


class KnownRobots:
    """Robots of a workspace by robot_id: `joints`, base to flange, and `names`; `times` that stored runs cover.

    Twins and plans are read when they are asked for first.
    """

    def __init__(self, place: Workspace, announce: Callable[[str], None]) -> None:
        """Read what is known now; `announce` is told of a twin that cannot be read."""
        self._place, self._announce = place, announce
        self.joints: dict[str, list[str]] = {}
        with place.reading() as session:
            for robot_id, name in session.execute(select(Joint.robot_id, Joint.name).order_by(Joint.position)):
                self.joints.setdefault(robot_id, []).append(name)
            self.names = {robot_id: name for robot_id, name in session.execute(select(Robot.robot_id, Robot.name))}
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
