"""Planned runs: a motion is planned or priced by a robot's twin, and kept in the workspace with what it will take."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from sqlalchemy import select

from irtwin import modelling
from irtwin.announce import Announce
from irtwin.errors import InputError
from irtwin.identification.progress import telling
from irtwin.location import WORKSPACE, Location
from irtwin.modelling import Expectation
from irtwin.planning.cycle import Cycle, CycleTimes
from irtwin.planning.placement import Placement, better_placement
from irtwin.planning.plan import Plan, Task, Tour, any_order
from irtwin.planning.programme import SectionedMotion, programme_of
from irtwin.planning.waiting import PauseProposal, proposals
from irtwin.providers.energy import stored_price
from irtwin.providers.names import check_run_name, find_robot, find_run
from irtwin.providers.records import keep_run, load_run, load_twin
from irtwin.rewriting import renew, rewriting
from irtwin.robot.description import Robot
from irtwin.signals.channels import Signals
from irtwin.signals.conditioning import condition
from irtwin.signals.log import PLANNED, Run, check_plan, run_of
from irtwin.storage.database import Workspace
from irtwin.storage.energy_schema import SupplyStateRow
from irtwin.storage.files import check_place
from irtwin.storage.schema import MEASURED_RUN
from irtwin.storage.staging import staged
from irtwin.storage.tariff import read_tariff
from irtwin.twin.price import Figure, Price, kilogram_less
from irtwin.twin.twin import Twin
from irtwin.workflow import populate_apart, write_report

T = TypeVar("T")


@dataclass(frozen=True)
class Kept:
    """A planned run as it was kept: its robot and name, what it will take, and the robot's report.

    The price is None where the twin knows nothing of power.
    """

    robot: str
    run: str
    price: Price | None
    report: Path


def robot_twin(robot: str | None, location: Location) -> Twin:
    """Return the twin of a robot of a workspace, of the only one where None.

    Raises InputError where there is no such robot, or no twin of it.
    """
    with Workspace.existing(location) as place:
        return load_twin(place, find_robot(place, robot))[1]


def plan(
    robot: str,
    task: Task,
    location: Location,
    *,
    name: str,
    out: Path | None = None,
    rate: float = 100.0,
    announce: Announce = lambda line: None,
) -> tuple[Plan, Kept]:
    """Plan a motion by the twin of a robot of a workspace, and keep it there as a planned run called `name`.

    Raises InputError, and keeps nothing, where the robot is unknown or has no twin, the name is taken, or there is no
    such motion.
    """

    def make(twin: Twin) -> tuple[Plan, Run]:
        made = modelling.plan(twin, task, rate=rate)
        motion = made.motion
        signals = Signals(motion.time, motion.q, dq=motion.dq, ddq=motion.ddq)
        return made, run_of(name, signals, role=PLANNED, payload_mass=task.payload_mass, payload_com=task.payload_com)

    if out is not None:
        modelling.check_plan_file(out)
    made, kept = _keep(robot, name, make, location, announce)
    if out is not None:
        modelling.write_motion(made.motion, made.robot, out)
    return made, kept


def predict(
    robot: str,
    motion: Path,
    location: Location,
    *,
    name: str,
    out: Path | None = None,
    payload_mass: float | None = None,
    payload_com: tuple[float, float, float] | None = None,
    announce: Announce = lambda line: None,
) -> tuple[Expectation, Kept]:
    """Price a file's motion by the twin of a robot of a workspace, and keep it there as a planned run called `name`.

    Raises InputError, and keeps nothing, as `plan` and `modelling.expect` do.
    """

    def make(twin: Twin) -> tuple[Expectation, Run]:
        expected = modelling.expect(twin, motion, payload_mass=payload_mass, payload_com=payload_com)
        run = expected.run
        check_plan(run.signals, motion)
        carried = {"payload_mass": run.payload_mass, "payload_com": run.payload_com}
        return expected, run_of(name, run.signals.motion, role=PLANNED, **carried)

    if out is not None:
        check_place(out)
    expected, kept = _keep(robot, name, make, location, announce)
    if out is not None:
        modelling.write_table(expected.table, out)
    return expected, kept


@dataclass(frozen=True)
class Timings:
    """The timing of a programme that takes least in the cycle that was asked for, and those of other cycle times.

    `proposals`: what to do in the pauses of the best; `unseen`: states that no log shows, as "off"; `hours`: how many
    of a year the robot is on, None: not known; `kilogram`: what a lighter tool or payload saves, J per kg;
    `placement`: where the base would stand better, `tour`: the order of its places that takes less; None: there is
    none, or nobody asked for it.
    """

    robot: Robot
    programme: SectionedMotion
    best: Cycle
    curve: Sequence[Cycle]
    proposals: Sequence[PauseProposal]
    unseen: Sequence[str]
    hours: float | None
    kilogram: Figure
    placement: Placement | None = None
    tour: Tour | None = None


def optimise(
    robot: str,
    run: str,
    workspace: Location | Path | str = WORKSPACE,
    *,
    name: str | None = None,
    cycle: float | None = None,
    least_pause: float | None = None,
    base: bool = False,
    free_order: bool = False,
    out: Path | str | None = None,
    announce: Announce = lambda line: None,
) -> tuple[Timings, Kept]:
    """Time the moves of a robot's measured run so that it takes least energy, and keep that as a planned run.

    `name`: of the planned run, RUN_optimised if None; `cycle`: how long it may take, s, as long as the run if None;
    `least_pause`: see `CycleTimes`; `base`: whether to look for a better place of the base, too; `free_order`: whether
    the run may pause at its places in any order, between the first and the last; `out`: a file of the motion, as of
    `plan`. Raises InputError, and keeps nothing, where there is no such run or name, the run has no whole move, the
    robot cannot be so fast, or its twin knows no power.
    """
    location, name = Location.of(workspace), name or f"{run}_optimised"
    if out is not None:
        modelling.check_plan_file(Path(out))
    with Workspace.existing(location) as place:
        robot_id = find_robot(place, robot)
        run_id = find_run(place, robot_id, run, MEASURED_RUN).run_id
        off = _off_power(place, robot_id)

    def make(twin: Twin) -> tuple[Timings, Run]:
        if not twin.knows_power:
            raise InputError(
                f"{location.folder}: the robot's twin has seen no power, so it cannot say what a timing saves"
            )
        with Workspace.existing(location) as place:
            known = load_run(place, twin.robot, run_id)
        programme = programme_of(condition(known, twin.robot, twin.cutoff), str(location.folder))
        times, was = CycleTimes(twin, programme, least_pause), float(programme.seconds.sum())
        best = times.in_time(cycle or was)
        made = run_of(
            name,
            best.motion,
            role=PLANNED,
            payload_mass=known.payload_mass,
            payload_com=known.payload_com,
            time_scaling_of=known.name,
            time_scale=best.seconds / was,
        )
        shown = {"off": off is not None, "with closed brakes": twin.stack.drives_on(best.motion) is not None}
        timings = Timings(
            twin.robot,
            programme,
            best,
            times.curve(),
            tuple(proposals(twin, programme.timed(best.factors), off)),
            [state for state, seen in shown.items() if not seen],
            read_tariff(location.folder).hours,
            kilogram_less(twin, best.motion),
            better_placement(twin, best.motion) if base else None,
            any_order(twin, programme) if free_order else None,
        )
        return timings, made

    timings, kept = _keep(robot, name, make, location, announce)
    if out is not None:
        modelling.write_motion(timings.best.motion, timings.robot, Path(out))
    return timings, kept


def _off_power(place: Workspace, robot_id: str) -> float | None:
    """Return the mean power, W, that logs of a robot show while it was off; None where none does."""
    state = SupplyStateRow
    with place.reading() as session:
        asked = select(state.seconds, state.power_w).where(state.robot_id == robot_id, state.state == "off")
        seen = [(seconds, power) for seconds, power in session.execute(asked) if power is not None]
    total = sum(seconds for seconds, _ in seen)
    return sum(seconds * power for seconds, power in seen) / total if total else None


def _keep(
    robot: str, name: str, make: Callable[[Twin], tuple[T, Run]], location: Location, announce: Announce
) -> tuple[T, Kept]:
    with Workspace.existing(location) as place:
        robot_id = find_robot(place, robot)
        check_run_name(place, robot_id, name)
        _, twin = load_twin(place, robot_id)
        with telling(announce):
            made, run = make(twin)
        with rewriting(place, announce) as graph:
            with staged(place, robot_id) as apart:
                run_id = keep_run(apart, robot_id, twin.robot.joint_names, run)
                populate_apart(apart, announce)
            renew(place, graph, announce)
        report = write_report(place, robot_id)
        return made, Kept(robot_id, name, stored_price(place, run_id), report)
