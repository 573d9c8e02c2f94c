"""Commands that keep a workspace whole."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from irtwin.cli.options import FILE, located, say, series_option
from irtwin.location import Location


@click.command()
@click.argument("robot")
@click.option("--run", metavar="NAME", help="Remove this run alone: a plan that was kept, or a live run.")
@located
def drop(robot: str, run: str | None, location: Location) -> None:
    """Remove a ROBOT from the workspace.

    Its runs, twin, diagnosis, live runs and report are deleted, and everything that the graph says about it. With
    --run, one of its runs goes, and the report is written anew. Runs of a data set stay.
    """
    from irtwin import upkeep

    if run is None:
        upkeep.drop(robot, location, say)
    else:
        upkeep.drop_run(robot, run, location, say)


@click.command()
@located
def repair(location: Location) -> None:
    """Rebuild a damaged or lost graph from the database.

    Lists the series, twins and diagnoses that are missing or altered; the exit status is then 2. A damaged database
    needs `restore`.
    """
    from irtwin import upkeep

    upkeep.repair(location, say)
    click.echo(location.folder)


@click.command()
@click.argument("workspace", type=click.Path(path_type=Path, file_okay=False, exists=True))
@click.option("--withdraw", is_flag=True, help="Allow nothing of it any more.")
def trust(workspace: Path, withdraw: bool) -> None:
    """Allow what the files of a WORKSPACE ask for, and list it.

    A workspace may come from elsewhere. Rules, templates and the like in its folder, whom its alarms.toml tells, with
    which variables, and the object storage of its series.toml: none of it runs, sends or is written to before. You say
    so once; what a file asks for later is asked for again.
    """
    from irtwin import trust as word
    from irtwin import upkeep

    if withdraw:
        word.withdraw(workspace)
        click.echo(f"{workspace}: nothing is allowed")
        return
    asked = upkeep.asked(workspace)
    word.trust(workspace, asked)
    for name in asked:
        click.echo(name)
    click.echo(f"{workspace}: {'allowed' if asked else 'asks for nothing'}")


@click.command()
@located
def status(location: Location) -> None:
    """Show how a workspace stands.

    Lists robots and runs, tables, the graph's size, the files that extend what ships, and damage; where there is any,
    the exit status is 2.
    """
    from irtwin import status as of_workspace

    found = of_workspace.status(location)
    for line in found.lines():
        click.echo(line)
    if found.faults:
        sys.exit(2)


@click.command()
@click.argument("archive", type=FILE)
@located
def backup(archive: Path, location: Location) -> None:
    """Write a workspace into one ARCHIVE, even while others write to it.

    It holds graph, database (also the rows of a server), series, twins, diagnoses and reports, with checksums.
    """
    from irtwin import workflow

    workflow.backup(archive, location)
    click.echo(archive)


@click.command()
@click.argument("archive", type=FILE)
@located
@series_option
def restore(archive: Path, location: Location, series_url: str | None) -> None:
    """Create a new workspace from an ARCHIVE that `backup` wrote.

    A damaged archive restores nothing, and nothing is overwritten.
    """
    from irtwin.knowledge.store.backup import restore as restore_all

    restore_all(archive, location, series_url)
    click.echo(location.folder)
