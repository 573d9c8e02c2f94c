"""The group of commands that keep a workspace whole."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from irtwin.cli.fleet import show
from irtwin.cli.options import FILE, located, say
from irtwin.location import Location


@click.group()
def workspace() -> None:
    """Look after a workspace: how it stands, what it may do, backups, robots to remove, its conclusions."""


@workspace.command()
@click.argument("robot")
@click.option("--run", metavar="NAME", help="Remove this run alone: a plan that was kept, or a live run.")
@located
def drop(robot: str, run: str | None, location: Location) -> None:
    """Remove a ROBOT from the workspace.

    Its runs, twin, diagnosis, live runs and report are deleted, and everything that the graph says about it. With
    --run, one of its runs goes, and the report is written anew. Runs of a data set stay.

    \b
    Example: irtwin workspace drop KUKA_KR6_R700
    """
    from irtwin import upkeep

    if run is None:
        upkeep.drop(robot, location, say)
    else:
        upkeep.drop_run(robot, run, location, say)


@workspace.command()
@located
def repair(location: Location) -> None:
    """Rebuild a damaged or lost graph from the database.

    Lists the series, twins and diagnoses that are missing or altered; the exit status is then 2. A damaged database
    needs `irtwin workspace restore`.

    \b
    Example: irtwin workspace repair --workspace plant
    """
    from irtwin import upkeep

    upkeep.repair(location, say)
    click.echo(location.folder)


@workspace.command()
@click.argument("folder", metavar="WORKSPACE", type=click.Path(path_type=Path, file_okay=False, exists=True))
@click.option("--withdraw", is_flag=True, help="Allow nothing of it any more.")
def trust(folder: Path, withdraw: bool) -> None:
    """Allow what the files of a WORKSPACE ask for, and list it.

    A workspace may come from elsewhere. Rules, templates and the like in its folder, and whom its alarms.toml tells,
    with which variables: none of it runs or sends before. You say so once; what a file asks for later is asked for
    again.

    \b
    Example: irtwin workspace trust plant
    """
    from irtwin import trust as word
    from irtwin import upkeep

    if withdraw:
        word.withdraw(folder)
        click.echo(f"{folder}: nothing is allowed")
        return
    asked = upkeep.asked(folder)
    word.trust(folder, asked)
    for name in asked:
        click.echo(name)
    click.echo(f"{folder}: {'allowed' if asked else 'asks for nothing'}")


@workspace.command()
@located
def status(location: Location) -> None:
    """Show how a workspace stands.

    Lists robots and runs, tables, the graph's size, the files that extend what ships, and damage; where there is any,
    the exit status is 2. Of a folder that `irtwin run --out` or `diagnose --out` fills, it counts the data sets that
    are done, refused, failed and left.

    \b
    Example: irtwin workspace status --workspace plant
    """
    from irtwin.fleet.fleet import batches_of, status_of

    if batches := batches_of(location.folder):
        return show(status_of(batches))
    from irtwin import status as of_workspace

    standing = of_workspace.status(location)
    for line in standing.lines():
        click.echo(line)
    if standing.faults:
        sys.exit(2)


@workspace.command()
@click.argument("archive", type=FILE)
@located
def backup(archive: Path, location: Location) -> None:
    """Write a workspace into one ARCHIVE, even while others write to it.

    It holds graph, database (also the rows of a server), series, twins, diagnoses and reports, with checksums.

    \b
    Example: irtwin workspace backup plant.zip --workspace plant
    """
    from irtwin import workflow

    workflow.backup(archive, location)
    click.echo(archive)


@workspace.command()
@click.argument("archive", type=FILE)
@located
def restore(archive: Path, location: Location) -> None:
    """Create a new workspace from an ARCHIVE that `irtwin workspace backup` wrote.

    A damaged archive restores nothing, and nothing is overwritten.

    \b
    Example: irtwin workspace restore plant.zip --workspace plant_again
    """
    from irtwin.knowledge.store.backup import restore as restore_all

    restore_all(archive, location)
    click.echo(location.folder)
