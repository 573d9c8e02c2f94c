"""Commands on motions: plan one, price one, time one anew."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from irtwin.cli.options import (
    DAY,
    FILE,
    FOLDER,
    OUT,
    PLACE,
    Number,
    database_option,
    graph_option,
    located,
    locating,
    page_option,
    payload_com_option,
    payload_mass_option,
    say,
    say_unchecked,
)
from irtwin.errors import InputError
from irtwin.location import Location

if TYPE_CHECKING:
    from irtwin.planning.cycle import Cycle
    from irtwin.planning.plan import Tour
    from irtwin.plans import Kept, Timings
    from irtwin.twin.price import Figure

_PLAN = "plan"  # name of a planned run that was given none

_NO_POWER = "energy and power are not known; the twin has seen no power"


_kept = locating(
    click.option("--workspace", type=FOLDER, help="Keep it there, as a planned run."),
    click.option("--run", "name", metavar="NAME", help="Name of the planned run. Default: that of --out, or plan."),
    database_option,
    graph_option,
)


@click.command()
@click.argument("source")
@click.option("--from", "start", metavar="POSE", required=True, help="Where the motion starts.")
@click.option("--to", "goal", metavar="POSE", required=True, help="Where it ends.")
@click.option(
    "--via", metavar="POSE", multiple=True, help="Stand there on the way, in the order that takes least. Repeatable."
)
@click.option("--out", type=FILE, help=OUT)
@page_option
@click.option("--line", is_flag=True, help="Lead the flange along a straight line.")
@click.option(
    "--box",
    "boxes",
    type=Number(-1e3, 1e3),
    nargs=6,
    multiple=True,
    metavar="X Y Z SX SY SZ",
    help="Keep off a box: its centre and side lengths in the base frame, m. Repeatable.",
)
@click.option(
    "--objective",
    type=click.Choice(["time", "energy"]),
    default="time",
    show_default=True,
    help="What is to be least. Energy: in --seconds, or in the time of the fastest motion.",
)
@click.option("--seconds", type=Number(min=0.0, min_open=True), help="Duration, s. Default: the shortest.")
@click.option("--rate", type=Number(10.0, 10_000.0), default=100.0, show_default=True, help="Sampling rate, Hz.")
@click.option("--search", type=Number(0.1, DAY), default=10.0, show_default=True, help="Limit to find a path, s.")
@payload_mass_option
@payload_com_option
@_kept
def plan(
    source: str,
    start: str,
    goal: str,
    via: tuple[str, ...],
    out: Path | None,
    page: Path | None,
    boxes: tuple[tuple[float, ...], ...],
    objective: str,
    rate: float,
    location: Location | None,
    name: str | None,
    **asked: Any,
) -> None:
    """Plan a motion from pose to pose, around obstacles, and say what it costs.

    SOURCE is a twin that `irtwin diagnose --save-twin` wrote, or a URDF, or the folder of a data set, of which energy
    is not known. A POSE is joint positions, "0,-1.57,...", or a pose of the flange in the base frame,
    "pose:x,y,z,roll,pitch,yaw", in m and rad. The motion keeps to the limits of position, speed, acceleration, jerk and
    torque. With --workspace, SOURCE is the name of a robot there; its twin plans, and the plan is kept with what it
    will take, in the graph too.

    \b
    Example: irtwin plan twin.json --from 0,0,0,0,0,0 --to 1,0,0,0,0,0 --via 2,0,0,0,0,0 --via 0.5,0,0,0,0,0 --out a.csv
    Example: irtwin plan twin.json --from 0,-1.57,1.57,0,0,0 --to 1,-1,1,0,0,0 --objective energy --out plan.csv
    """
    from irtwin import modelling, plans
    from irtwin.identification.progress import telling
    from irtwin.planning.plan import Task
    from irtwin.planning.poses import read_target
    from irtwin.robot.collision import Obstacle
    from irtwin.storage.files import check_place

    _check_kept(location, name, out)
    if page is not None:
        check_place(page)
    twin = plans.robot_twin(source, location) if location else modelling.read_twin(Path(source))
    joints = len(twin.robot.joints)
    task = Task(
        start=read_target(start, joints, "--from"),
        goal=read_target(goal, joints, "--to"),
        via=[read_target(target, joints, "--via") for target in via],
        obstacles=[Obstacle((x, y, z), (a, b, c)) for x, y, z, a, b, c in boxes],
        least_energy=objective == "energy",
        **asked,
    )
    if location is None:
        with telling(say):
            made, kept = modelling.plan(twin, task, out, rate), None
    else:
        name = name or (out.stem if out else _PLAN)
        made, kept = plans.plan(source, task, location, name=name, out=out, rate=rate, announce=say)
    say_unchecked(made.checks_itself)
    if made.tour is not None:
        click.echo(_tour_text(made.tour))
    kept_off = "" if math.isinf(made.clearance) else f"{1000 * made.clearance:.1f} mm"
    cost = (kept or made).price
    if page is not None:
        from irtwin.report.motion import write_page

        facts = [("Least clearance", kept_off), ("It takes", str(cost or ""))]
        write_page(twin, made.motion, name or (out.stem if out else _PLAN), facts, page)
    clear = f", {kept_off} least clearance" if kept_off else ""
    click.echo(f"{_where(out, kept)}: {made.seconds:.3f} s{clear}; {cost or _NO_POWER}")


@click.command()
@click.argument("twin")
@click.argument("run", type=PLACE)
@click.option("--out", type=FILE, help="Parquet file to write.")
@click.option("--payload-mass", type=Number(0.0, 1e5), help="Payload mass, kg. Default: from the run's data set.")
@click.option(
    "--payload-com",
    type=Number(-10.0, 10.0),
    nargs=3,
    metavar="X Y Z",
    help="Payload's centre of mass in the flange frame, m. Default: from the run's data set.",
)
@_kept
def predict(
    twin: str, run: Path, out: Path | None, location: Location | None, name: str | None, **payload: Any
) -> None:
    """Predict torque, power and energy of a run with a saved twin.

    TWIN is a file that `irtwin diagnose --save-twin` wrote. RUN is a CSV or Parquet file with the motion: a log, or
    what `irtwin plan` or `irtwin robot excite` wrote. A motion that leaves the robot's limits or in which two links
    meet is refused. With --workspace, TWIN is the name of a robot there, and the motion is kept with what it will take,
    in the graph too.

    \b
    Example: irtwin predict twin.json motion.csv --out predicted.parquet
    """
    from irtwin import modelling, plans

    _check_kept(location, name, out)
    if location is None:
        expected, kept = modelling.expect(twin, run, out, **payload), None
    else:
        expected, kept = plans.predict(twin, run, location, name=name or run.stem, out=out, announce=say, **payload)
    say_unchecked(expected.checks_itself)
    click.echo(f"{_where(out, kept)}: {(kept or expected).price or _NO_POWER}")


@click.command()
@click.argument("robot")
@click.argument("run")
@click.option("--cycle", type=Number(0.0, DAY, min_open=True), help="Cycle time, s. Default: as long as the run.")
@click.option(
    "--pause",
    "least_pause",
    type=Number(0.0, DAY),
    help="What a pause needs, s; what is longer may go to the moves. Default: pauses stay as they are.",
)
@click.option("--base", is_flag=True, help="Look for a place where the base would stand better, too.")
@click.option("--free-order", is_flag=True, help="Look for a better order of the places where it pauses, too.")
@click.option("--out", type=FILE, help=OUT)
@located
@click.option("--run", "name", metavar="NAME", help="Name of the planned run. Default: RUN_optimised.")
def optimise(
    robot: str,
    run: str,
    base: bool,
    free_order: bool,
    out: Path | None,
    location: Location,
    name: str | None,
    **asked: Any,
) -> None:
    """Time the moves of a run so that it takes least energy, by the robot's twin.

    The way stays; each move between two pauses gets a pace of its own. Printed are the energies of other cycle times,
    and what the run saves in --cycle against the run as it was, with waiting after it where that was shorter: a robot
    that waits anyway saves so much by going slower. A move gets faster only where all joints have limits of speed and
    torque. Said, too, is what each pause of a second and more could save by waiting elsewhere, parked at a pose of its
    own, closed brakes, or off: states that the robot's logs show; and what a kilogram less at the flange saves. With
    --base the flange keeps its way through the room, the base up to 0.3 m beside. With --free-order the places between
    the first pause and the last are visited in the order that takes least, by moves as `irtwin plan` makes them. What
    stands around is not known, there or where it parks. A year is as long as plant.toml says. The motion is kept as a
    planned run, and the robot's report says what it saves.

    \b
    Example: irtwin optimise KUKA_KR6_R700 point_to_point --cycle 20
    """
    from irtwin import plans

    timings, kept = plans.optimise(
        robot, run, location, name=name, base=base, free_order=free_order, out=out, announce=say, **asked
    )
    for line in _curve_lines(timings):
        click.echo(line)
    if base:
        click.echo(_placement_text(timings))
    if free_order:
        click.echo(_order_text(timings))
    saved = _cycle_text(timings.best) + f" than {run}{_year(timings, timings.best.saved)}"
    click.echo(f"{_where(out, kept)}: {saved} (95 % interval)")


def _curve_lines(timings: Timings) -> Iterator[str]:
    """Yield the energy of each cycle time, what is new in the one that was chosen, and what its pauses could save."""
    for cycle in timings.curve:
        yield _cycle_text(cycle)
    programme = timings.programme
    time = programme.motion.time
    for section, factor in zip(programme.sections, timings.best.factors, strict=True):
        if section.kind == "move":
            yield f"move from {time[section.first]:.2f} to {time[section.last]:.2f} s: {factor:.2f} times as long"
    for proposal in timings.proposals:
        end = proposal.begin + proposal.seconds
        back = "how long coming back takes is in no log" if proposal.takes is None else f"it takes {proposal.takes:g} s"
        year = _year(timings, proposal.saved)
        yield f"pause from {proposal.begin:.2f} to {end:.2f} s: {proposal.what}, {proposal.saved} J less{year}; {back}"
    for state in timings.unseen:
        yield f"no log shows the robot {state}: what that would save in a pause is not known"
    less = timings.kilogram
    yield f"each kilogram less at the flange saves {less} J a cycle{_year(timings, less)}"


def _placement_text(timings: Timings) -> str:
    if (placement := timings.placement) is None:
        return (
            "no place of the base up to 0.3 m beside saves anything, or the arm cannot keep its flange's way from there"
        )
    shift = ", ".join(f"{value:+.2f}" for value in placement.shift)
    saved = placement.saved
    return f"base moved by {shift} m (x, y, z): {saved} J less{_year(timings, saved)}; it takes no time"


def _order_text(timings: Timings) -> str:
    if (tour := timings.tour) is None:
        return "no other order of the places between the first pause and the last takes less"
    assert tour.saved is not None
    return _tour_text(tour, "places between the first pause and the last") + _year(timings, tour.saved)


def _year(timings: Timings, saved: Figure) -> str:
    """Say what a saving of each cycle, J, comes to in a year, where `plant.toml` says how many hours that has."""
    if timings.hours is None or saved.value <= 0:
        return ""
    return f" ({saved.times(timings.hours / timings.best.seconds / 1000)} kWh in {timings.hours:g} h a year)"


def _tour_text(tour: Tour, places: str = "--via") -> str:
    saved = "" if tour.saved is None else f"{tour.saved} J and "
    order = ", ".join(map(str, tour.order))
    return f"order of {places}: {order}; saves {saved}{tour.sooner:.3f} s against the order given (95 % interval)"


def _cycle_text(cycle: Cycle) -> str:
    saved = replace(cycle.saved, value=abs(cycle.saved.value))
    return f"{cycle.seconds:.2f} s: {cycle.energy} J, {saved} J {'less' if cycle.saved.value >= 0 else 'more'}"


def _check_kept(location: Location | None, name: str | None, out: Path | None) -> None:
    if location is None and out is None:
        raise InputError("nothing says where the motion is to go; give --out FILE, --workspace FOLDER, or both")
    if location is None and name is not None:
        raise InputError("--run names a planned run of a workspace; give --workspace FOLDER too")


def _where(out: Path | None, kept: Kept | None) -> str:
    places = [str(out)] if out else []
    return " and ".join([*places, f'planned run "{kept.run}" of {kept.robot}'] if kept else places)
