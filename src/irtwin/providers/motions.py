"""The motions of a robot's runs: conditioned once, with one cutoff, for every provider that asks."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from weakref import WeakKeyDictionary

from sqlalchemy import select

from irtwin.document.document import Cutoff
from irtwin.identification.cutoff import cutoff_for
from irtwin.providers.records import load_robot, load_run
from irtwin.robot.description import Robot
from irtwin.signals.conditioning import condition
from irtwin.signals.log import own_runs
from irtwin.signals.motion import Motion
from irtwin.storage.database import Workspace
from irtwin.storage.rows import facts
from irtwin.storage.schema import MEASURED, MEASURED_RUN, JointRow, RobotRow, RunRow, Series


@dataclass(frozen=True)
class RobotMotions:
    """A robot's motions by run_id, in the order in which they began: what was measured, neither plans nor live runs.

    `own` are those that its twin is of: a simulator's stay apart where the robot's own are there. `repeats`: name of a
    run -> name of the run whose programmed motion it repeats. `cutoff`: that of all.
    """

    robot: Robot
    motions: Mapping[str, Motion]
    own: tuple[Motion, ...]
    repeats: dict[str, str]
    cutoff: Cutoff

    @property
    def keys(self) -> dict[str, str]:
        """The run_id of each run, by its name."""
        return {motion.run: run_id for run_id, motion in self.motions.items()}


# The robot asked for last, of each workspace in use: providers go from run to run of one robot.
_kept: WeakKeyDictionary[Workspace, tuple[Hashable, RobotMotions]] = WeakKeyDictionary()


def robot_motions(workspace: Workspace, robot_id: str) -> RobotMotions:
    """Return a robot's runs, conditioned with the cutoff that its own runs need; the same object while they are.

    Raises InputError where a run's samples are gone, or cannot be conditioned.
    """
    known = _facts(workspace, robot_id)
    kept = _kept.get(workspace)
    if kept is None or kept[0] != known:
        _kept.pop(workspace, None)  # before the next takes its memory
        kept = _kept[workspace] = known, _conditioned(workspace, robot_id)
    return kept[1]


def _conditioned(workspace: Workspace, robot_id: str) -> RobotMotions:
    robot = load_robot(workspace, robot_id)
    in_order = select(RunRow.run_id).order_by(RunRow.start_time, RunRow.run_id)
    run_ids = workspace.all(in_order.where(RunRow.robot_id == robot_id, RunRow.kind == MEASURED_RUN))
    runs = {run_id: load_run(workspace, robot, run_id) for run_id in run_ids}
    own = own_runs(list(runs.values()))
    cutoff = cutoff_for(robot, own, workspace.row(RobotRow, robot_id).cutoff_hz)
    motions = {run_id: condition(run, robot, cutoff.hz) for run_id, run in runs.items()}
    own_names = {run.name for run in own}
    return RobotMotions(
        robot=robot,
        motions=motions,
        own=tuple(motion for motion in motions.values() if motion.run in own_names),
        repeats={run.name: run.repeat_of for run in runs.values() if run.repeat_of is not None},
        cutoff=cutoff,
    )


def _facts(workspace: Workspace, robot_id: str) -> Hashable:
    """Return all that the motions follow from: the robot, its joints, its runs and the checksums of their samples."""
    runs = select(RunRow).where(RunRow.robot_id == robot_id, RunRow.kind == MEASURED_RUN)
    joints = select(JointRow).where(JointRow.robot_id == robot_id)
    measured = select(Series.run_id, Series.series_id).join(RunRow)
    measured = measured.where(RunRow.robot_id == robot_id, Series.kind == MEASURED)
    with workspace.reading() as session:
        rows = [session.get_one(RobotRow, robot_id), *session.scalars(joints), *session.scalars(runs)]
        return frozenset({*map(facts, rows), *map(tuple, session.execute(measured))})
