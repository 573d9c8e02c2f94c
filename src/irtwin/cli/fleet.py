"""Commands on many data sets."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from irtwin.cli.options import FOLDER, announce, base_option, say, series_option
from irtwin.errors import InputError

if TYPE_CHECKING:
    from irtwin.fleet.fleet import Status

_SHOWN = 20  # data sets that were set aside


@click.group()
def fleet() -> None:
    """Take many data sets through `run` or `diagnose`, each by itself.

    SOURCE is a folder with data sets below it, a text file with one folder a line, or object storage such as
    s3://bucket/robots. What is done is not done again: after a crash the same command goes on. A data set that is
    refused costs no other. The exit status is 3 where some were set aside.
    """


def _options(command: Callable[..., Any]) -> Callable[..., Any]:
    for option in (
        click.option(
            "--scheduler", metavar="ADDRESS", help="Dask scheduler, as tcp://host:8786, in place of processes."
        ),
        click.option("--workers", type=click.IntRange(1, 1024), help="Processes at once. Default: one a core."),
        click.option("--out", type=FOLDER, required=True, help="Folder for the results."),
        click.argument("source"),
    ):
        command = option(command)
    return command


@fleet.command()
@_options
@click.option("--batch", type=click.IntRange(1, 1000), default=100, show_default=True, help="Robots in one workspace.")
@base_option
@series_option
def run(**asked: Any) -> None:
    """Build twins, graphs and reports: one workspace for each batch of robots."""
    _work("run", **asked)


@fleet.command()
@_options
def diagnose(**asked: Any) -> None:
    """Diagnose each data set: gap.json and twin.json in a folder of its own."""
    _work("diagnose", batch=20, **asked)


@fleet.command()
@click.argument("folder", type=FOLDER)
def status(folder: Path) -> None:
    """Show how many data sets are done, refused, failed and left."""
    from irtwin.fleet.fleet import batches_of, status_of

    batches = batches_of(folder)
    if not batches:
        raise InputError(f"{folder}: holds no fleet; name the --out of `irtwin fleet run` or `diagnose`")
    _show(status_of(batches))


def _work(kind: str, source: str, out: Path, workers: int | None, **asked: Any) -> None:
    from irtwin.fleet.fleet import work

    found = work(source, out, kind, workers=workers or os.cpu_count() or 1, announce=announce, **asked)
    _show(found)
    if found.set_aside:
        sys.exit(3)


def _show(found: Status) -> None:
    for state, number in sorted(found.counts.items()):
        click.echo(f"{state:8} {number}")
    for record in found.set_aside[:_SHOWN]:
        say(f"{record.state}: {record.data_set}: {record.said}")
    if len(found.set_aside) > _SHOWN:
        say(f"... and {len(found.set_aside) - _SHOWN} more; their records say why")
