"""What makes a command on one data set take many: each by itself, with results in one folder."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from irtwin.cli.options import FOLDER, PLACE, announce, refuse, say

if TYPE_CHECKING:
    from irtwin.fleet.fleet import FleetStatus

_SHOWN = 20  # data sets that were set aside
_BATCH = {"run": 100, "diagnose": 20}  # data sets
_OF_MANY = ("out", "batch", "workers")


def of_many(kind: str, *shared: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Give a command on one data set, `run` or `diagnose`, the option --out, by which it takes all below a folder.

    Of the command's own options, `shared` alone go with that.
    """

    def decorate(command: Callable[..., Any]) -> Callable[..., Any]:
        @wraps(command)
        def either(dataset: Path, **asked: Any) -> Any:
            many = {name: asked.pop(name) for name in _OF_MANY}
            if many["out"] is None:
                refuse(_OF_MANY, "goes with --out")
                return command(dataset=dataset, **asked)
            refuse(asked.keys() - set(shared), "is for one data set, and does not go with --out")
            return _work(kind, dataset, **many, **{name: asked[name] for name in shared})

        for option in (
            click.option("--workers", type=click.IntRange(1, 1024), help="With --out: processes. Default: one a core."),
            click.option(
                "--batch",
                type=click.IntRange(1, 1000),
                default=_BATCH[kind],
                show_default=True,
                help="With --out: data sets of one batch.",
            ),
            click.option(
                "--out", type=FOLDER, help="Take every data set below DATASET; the results go to this folder."
            ),
            click.argument("dataset", type=PLACE),
        ):
            either = option(either)
        return either

    return decorate


def show(status: FleetStatus) -> None:
    """Print how many data sets are in each state, and say which were set aside."""
    for state, number in sorted(status.counts.items()):
        click.echo(f"{state:8} {number}")
    for record in status.set_aside[:_SHOWN]:
        say(f"{record.state}: {record.data_set}: {record.said}")
    if len(status.set_aside) > _SHOWN:
        say(f"... and {len(status.set_aside) - _SHOWN} more; their records say why")


def _work(kind: str, source: Path, out: Path, workers: int | None, **asked: Any) -> None:
    from irtwin.fleet.fleet import work

    status = work(source, out, kind, workers=workers or os.cpu_count() or 1, announce=announce, **asked)
    show(status)
    if status.set_aside:
        sys.exit(3)
