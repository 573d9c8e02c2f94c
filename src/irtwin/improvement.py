"""The seed's "not satisfied, repeat": a robot's twin is fitted again beside a new log, until it is good enough."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from irtwin.announce import Announce
from irtwin.location import Location
from irtwin.modelling import sound
from irtwin.next_experiment import NextExperiment, next_experiment
from irtwin.providers.improvement import improve as improve_twin
from irtwin.providers.names import check_run_name, find_robot
from irtwin.providers.records import keep_run, load_robot, load_twin
from irtwin.rewriting import fill, rewriting
from irtwin.signals.log import read_log
from irtwin.storage.database import Workspace
from irtwin.storage.schema import ImprovementRound
from irtwin.storage.staging import staged
from irtwin.workflow import populate_apart, write_report


@dataclass(frozen=True)
class Improvement:
    """How it ended: the rounds, whether the twin is within the limit (%) on every run, else what to log next.

    report: the robot's energy report.
    """

    rounds: tuple[ImprovementRound, ...]
    within: bool
    limit: float
    next: NextExperiment | None
    report: Path


def improve(
    robot: str,
    new_log: Path,
    location: Location,
    *,
    payload_mass: float = 0.0,
    payload_com: tuple[float, float, float] = (0.0, 0.0, 0.0),
    performs: str | None = None,
    repair: bool = False,
    announce: Announce = lambda line: None,
) -> Improvement:
    """Take a new log of a robot into its workspace, and better its twin by it where that can be.

    payload_mass kg, payload_com m in the flange frame; performs: name of the planned run that the log carried out. The
    log stays beside the runs of the robot's data set; where the twin is no better, the earlier one stays.
    Raises InputError, and changes nothing, where the robot is unknown or has no twin, the log is none of it, its name
    is taken, or it has no power to judge by.
    """
    with Workspace.existing(location) as place:
        robot_id = find_robot(place, robot)
        load_twin(place, robot_id)
        known = load_robot(place, robot_id)
        logged = read_log(
            new_log, known, payload_mass=payload_mass, payload_com=payload_com, performs=performs, repair=repair
        )
        for run in logged.runs:
            check_run_name(place, robot_id, run.name)
        runs = sound(logged, announce).runs
        with rewriting(place, announce) as graph:
            graph.load_ontology()
            (row,) = graph.query("SELECT ?limit { limit:energy_error irt:Limit_Value ?limit }")
            limit = float(row["limit"])
            with staged(place, robot_id) as apart:
                for run in runs:
                    keep_run(apart, robot_id, known.joint_names, run)
                rounds, within = improve_twin(apart, robot_id, [run.name for run in runs], limit, announce)
                populate_apart(apart, announce)
            fill(place, graph, announce)  # live runs by the new twin
            following = next_experiment(place, graph, robot_id)
        report = write_report(place, robot_id)
        return Improvement(rounds, within, limit, following, report)
