"""What several commands share: options, numbers, and lines on standard error."""

from __future__ import annotations

import math
import os
import sys
import webbrowser
from collections.abc import Callable, Collection
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from irtwin.location import WORKSPACE, Location

DAY = 86400.0  # s
FILE = click.Path(path_type=Path, dir_okay=False)
OUT = "File to write: .csv, .parquet, .script (URScript) or .src (KRL of KUKA)."
FOLDER = click.Path(path_type=Path, file_okay=False)
PLACE = click.Path(path_type=Path)  # of either

page_option = click.option(
    "--page", type=FILE, help="HTML file to write: the robot performs the motion, with its curves and limits."
)


class Number(click.FloatRange):
    """A finite number; a plain range lets NaN pass."""

    name = "number"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Return the number; fail where it is none, or not finite."""
        number = super().convert(value, param, ctx)
        if not math.isfinite(number):
            self.fail(f"{value} is not a finite number.", param, ctx)
        return float(number)


def _left_aside(context: click.Context, option: click.Parameter, workspace: Path) -> Path:
    """Say what of a workspace does not hold, as its user has not trusted it."""
    if workspace.is_dir() and not context.resilient_parsing:
        from irtwin.resources import resources_of
        from irtwin.trust import how

        names = [file.asked for file in resources_of(workspace).left_aside]
        if names:
            say(f"{workspace}: left aside, as nobody trusts it: {', '.join(names)}; {how(workspace)}")
    return workspace


workspace_option = click.option(
    "--workspace",
    type=FOLDER,
    default=WORKSPACE,
    show_default=True,
    callback=_left_aside,
    help="Folder with the database, series, graph and reports.",
)
database_option = click.option(
    "--database",
    metavar="URL",
    envvar="IRTWIN_DATABASE",
    help="SQLAlchemy URL of the database. Default: SQLite in the workspace.",
)


def _checked_url(context: click.Context, option: click.Parameter, url: str | None) -> str | None:
    if url is not None and "://" not in url:
        raise click.BadParameter("give the URL of a SPARQL server, or nothing for the workspace's own folder.")
    return url


graph_option = click.option(
    "--graph",
    "graph_url",
    metavar="URL",
    envvar="IRTWIN_GRAPH",
    callback=_checked_url,
    help="Query URL of a SPARQL 1.1 server for the graph. Default: a folder in the workspace.",
)


def locating(*options: Callable[[Any], Any]) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Give a command options that say where a workspace is, and what they say: `location`, None without --workspace."""

    def decorate(command: Callable[..., Any]) -> Callable[..., Any]:
        @wraps(command)
        def located(
            workspace: Path | None, database: str | None = None, graph_url: str | None = None, **values: Any
        ) -> Any:
            location = None if workspace is None else Location(workspace, database, graph_url)
            return command(location=location, **values)

        for option in reversed(options):
            located = option(located)
        return located

    return decorate


located = locating(workspace_option, database_option, graph_option)
located_graph = locating(workspace_option, graph_option)
base_option = click.option(
    "--base",
    metavar="IRI",
    help="What the IRIs of individuals begin with, as https://plant.example/energy/. It stays once a robot is there.",
)
payload_mass_option = click.option("--payload-mass", type=Number(0.0, 1e5), default=0.0, help="Payload mass, kg.")
payload_com_option = click.option(
    "--payload-com",
    type=Number(-10.0, 10.0),
    nargs=3,
    default=(0.0, 0.0, 0.0),
    metavar="X Y Z",
    help="Payload's centre of mass in the flange frame, m.",
)


@dataclass
class Speech:
    """How much is said beside results: `quiet` leaves out progress, `verbose` adds how a mistake came about."""

    quiet: bool = False
    verbose: bool = False


speech = Speech()


def say(line: str) -> None:
    """Write one line to standard error."""
    click.echo(printable(line), err=True)


def say_unchecked(checks_itself: bool) -> None:
    """Say of a motion what could not be checked of it, where that is so."""
    if not checks_itself:
        say("The URDF has no collision shapes, so it was not checked whether the robot meets itself.")


def printable(line: str) -> str:
    """Return a line without what breaks lines or steers a terminal: names that were read may hold it."""
    return "".join(sign if sign.isprintable() else repr(sign)[1:-1] for sign in line)


def refuse(names: Collection[str], why: str) -> None:
    """Raise UsageError where one of these parameters was given: what it is for was not."""
    context = click.get_current_context()
    for parameter in context.command.params:
        given = context.get_parameter_source(str(parameter.name)) is ParameterSource.COMMANDLINE
        if given and parameter.name in names:
            raise click.UsageError(f"{parameter.opts[0]} {why}.")


def tell_contradictions(location: Location) -> None:
    """Say which statements of a workspace contradict each other; where there are any, end with status 3."""
    from irtwin.asking import contradictions, open_graph

    with open_graph(location) as graph:
        lines = contradictions(graph)
    for line in lines:
        say(f"irtwin: {location.folder}: {line}")
    if lines:
        sys.exit(3)


def announce(line: str) -> None:
    """Say what a command is about to do, unless it is to be quiet."""
    if not speech.quiet:
        say(line)


def add_speech(command: click.Command) -> None:
    """Give a command, or each command of a group, the options --quiet and --verbose."""
    if isinstance(command, click.Group):
        for subcommand in command.commands.values():
            add_speech(subcommand)
        return
    command.params += [
        click.Option(
            ["-q", "--quiet"], is_flag=True, expose_value=False, callback=_set, help="Say results and mistakes alone."
        ),
        click.Option(
            ["-v", "--verbose"],
            is_flag=True,
            expose_value=False,
            callback=_set,
            help="With a mistake, say where it was noticed.",
        ),
    ]


def _set(context: click.Context, option: click.Parameter, value: bool) -> None:
    setattr(speech, str(option.name), value)


no_open_option = click.option("--no-open", is_flag=True, help="Do not show the page in a browser.")


def show_page(page: Path) -> None:
    """Open a page in the browser, where a person at a desktop asked for it."""
    if sys.stdout.isatty() and {"DISPLAY", "WAYLAND_DISPLAY"} & set(os.environ):
        webbrowser.open(page.resolve().as_uri())
