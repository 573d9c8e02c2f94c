"""The command that begins a data set: of logs of others, or an empty one."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from irtwin.cli.options import PLACE, Number, database_option, graph_option, payload_com_option, printable, refuse, say
from irtwin.errors import InputError
from irtwin.location import Location

if TYPE_CHECKING:
    from irtwin.bring.doubt import DoubtError, WayOut
    from irtwin.bring.taken import LogsAlike, Taken

_WIDE = 160  # characters of a table that goes into a file


@click.command(name="import")
@click.argument("files", metavar="[FILE]...", nargs=-1, type=PLACE)
@click.option("--out", type=PLACE, help="New folder for the data set.")
@click.option(
    "--robot",
    metavar="ROBOT",
    help="URDF file, data set or its dataset.toml, or the name of a robot that is known, as kuka_kr6_r700. Left out of "
    "a meter's log, which has no joints.",
)
@click.option("--name", metavar="NAME", help="Robot's name in the data set. Default: its description's.")
@click.option(
    "--map", "maps", metavar="COLUMN=CHANNEL[:UNIT]", multiple=True,
    help="What a column is, as J1=q_joint_1:deg, or COLUMN=- to leave it out. * stands for any letters.",
)  # fmt: skip
@click.option(
    "--gear-ratio", "gear_ratios", metavar="[JOINT=]RATIO", multiple=True,
    help="Motor turns for one of the joint; makes joint angles of motor angles.",
)  # fmt: skip
@click.option("--power-at", type=click.Choice(["mains", "dc_bus"]), help="Where electrical power was measured.")
@click.option("--topic", "topics", metavar="COLUMN=TOPIC", multiple=True, help="Which topic of a bag to take.")
@click.option(
    "--fixed",
    metavar="JOINT",
    multiple=True,
    help="Joint that stood still and is not logged, as a gripper's. * stands for any letters.",
)
@click.option("--names", metavar="NAME,...", default="", help="Names of all columns, where the file has none.")
@click.option(
    "--role", "roles", metavar="[FILE=]ROLE", multiple=True,
    help="Whose log FILE is: observed, reference (the healthy past) or simulated. * stands for any letters; without "
    "FILE, of all. Default: observed.",
)  # fmt: skip
@click.option("--payload-mass", type=Number(0.0, 1e5), help="Payload of these runs, kg. Default: the log's, or 0.")
@payload_com_option
@click.option("--repair", is_flag=True, help="Drop samples whose time does not rise, and say how many.")
@click.option("--owl", type=PLACE, help="Edited file of `irtwin export --owl`; FILE: the workspace.")
@click.option("--yes", is_flag=True, help="Take the changes of --owl without asking.")
@click.option("--author", metavar="NAME", help="Who says so, with --owl. Default: the user's name here.")
@database_option
@graph_option
def import_(
    files: tuple[Path, ...],
    out: Path | None,
    robot: str | None,
    names: str,
    owl: Path | None,
    yes: bool,
    author: str | None,
    database: str | None,
    graph_url: str | None,
    **told: Any,
) -> None:
    """Make a data set of logs in other formats, a run a file, or an empty one; or take back an edited OWL file.

    FILE is a ROS bag (1, 2, MCAP), a recording of RTDE by Universal Robots, a CSV file of PlotJuggler or of anybody, a
    Parquet or an Excel file, or a folder of SAGE (control.csv and state_motor.csv). Without --robot it is a meter's:
    time, and power or energy. Units are told by names and by checks against other columns, and shown. What cannot be
    told is asked on a terminal; elsewhere the command stops and says what to give. What was written is checked, as by
    `irtwin check`: where something must be cured first, the exit status is 2.

    Without FILE the data set is empty: a folder whose dataset.toml explains each key, to fill in.

    With --owl, FILE is a workspace, and what was changed since `irtwin export --owl`, in Protégé or elsewhere, is shown
    and, once you agree, kept with its author and time: rows follow, and the next `irtwin run` fits the twin to them.
    What would contradict is refused, with the reason, and nothing changes.

    \b
    Example: irtwin import robot_data.csv --robot ur10 --out my_robot
    Example: irtwin import robot.csv sim.csv --role sim.csv=simulated --robot my.urdf --out my_robot
    Example: irtwin import --robot my.urdf --out my_robot
    """
    if owl is not None:
        if len(files) != 1 or out is not None or robot is not None:
            raise click.UsageError("--owl takes one FILE, the workspace, and neither --out nor --robot.")
        return _take_edited(owl, Location(files[0], database, graph_url), yes, author)
    if out is None:
        raise click.UsageError("Give --out, or --owl.")
    if not files:
        refuse(told.keys() - {"name"} | {"names"}, "says how to read a FILE: give one")
        return _write_empty(out, robot, told["name"])
    from irtwin.bring.bring import Options, bring, found_in

    options = Options(names=tuple(name.strip() for name in names.split(",")) if names else (), **told)
    ask = _ask if sys.stdin.isatty() and sys.stderr.isatty() else None
    forms = bring(files, out, robot, options, ask)
    _show(forms)
    findings, command = found_in(out)
    for line in (*(line for form in forms for line in form.said), *findings):
        say(f"irtwin: {line}")
    if command is None:
        say(f"Written: {out}, but it cannot be used yet. Cure what is said above, or import again into a new folder.")
        say(f"Then: irtwin check {out}")
        sys.exit(2)
    say(f"Written: {out}. Read its dataset.toml; then: {command}")


def _write_empty(out: Path, robot: str | None, name: str | None) -> None:
    from irtwin.bring.bring import init

    init(out, robot, name)
    if robot is None:
        say(f"Put the robot's URDF into {out} as robot.urdf.")
    say(f"Put runs into {out / 'runs'}, list them in {out / 'dataset.toml'}; then: irtwin check {out}")
    click.echo(out)


def _take_edited(owl: Path, location: Location, yes: bool, author: str | None) -> None:
    from getpass import getuser

    from irtwin.asserting import take_edited
    from irtwin.knowledge.asserted.edited import Edit

    def agrees(edit: Edit) -> bool:
        for line in edit.words:
            click.echo(printable(line))
        if not edit.words or yes:
            return bool(edit.words)
        if not sys.stdin.isatty():
            raise InputError(f"{owl}: nothing was taken: say --yes to take these changes")
        return click.confirm(f"Take these {len(edit.words)} changes", err=True)

    assertion = take_edited(owl, location, author=author or getuser(), agrees=agrees, announce=say)
    if assertion is None:
        say("Nothing was taken.")
    elif any(fact.place for fact in assertion.facts):
        say("Taken. Run the data set again, by `irtwin run`, to have the twin follow.")
    else:
        say("Taken.")


def _ask(doubt: DoubtError) -> WayOut:
    """Ask a person which answer is right."""
    say(doubt.question)
    for number, answer in enumerate(doubt.answers, start=1):
        say(f"  {number}  {answer.label}   ({answer.text})")
    chosen = doubt.answers[click.prompt("Which", type=click.IntRange(1, len(doubt.answers)), err=True) - 1]
    options = []
    for option, value in chosen.options:
        if value.endswith("RATIO"):
            value = value.removesuffix("RATIO") + str(click.prompt("Ratio", type=float, err=True))
        options.append((option, value))
    return replace(chosen, options=tuple(options))


def _show(forms: list[LogsAlike]) -> None:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    console = Console()
    wide = Console(width=None if console.is_terminal else _WIDE)
    for form in forms:
        files = ", ".join(log.path.name for log in form.logs[:4]) + (" ..." if len(form.logs) > 4 else "")
        title = Text(printable(f"{files}: {form.logs[0].form}"))
        table = Table("column", "channel", "unit", "conversion", "why", title=title)
        table.title_justify = "left"
        rows: dict[tuple[str, ...], list[Taken]] = {}
        for each in form.columns:
            rows.setdefault((each.unit, each.conversion, each.why) if each.channel else ("", "", each.why), []).append(
                each
            )
        for shared, columns in rows.items():
            if columns[0].channel:
                names = "\n".join(printable(each.column) for each in columns)
                channels = "\n".join(printable(each.channel) for each in columns)
                table.add_row(*map(Text, (names, channels, *map(printable, shared))))
        wide.print(table)
        for shared, columns in rows.items():
            if not columns[0].channel:
                names = ", ".join(each.column for each in columns)
                wide.print(Text(printable(f"not used, {shared[-1]}: {names}")))
