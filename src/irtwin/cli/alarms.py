"""The command that tells people of alarms."""

from __future__ import annotations

from pathlib import Path

import click

from irtwin.cli.options import FILE, located_graph, say
from irtwin.location import Location


@click.command()
@located_graph
@click.option("--robot", metavar="NAME", help="Of this robot only.")
@click.option("--follow", is_flag=True, help="Go on: tell each alarm when it begins, and when it is over.")
@click.option(
    "--config",
    type=FILE,
    help="Who else is told, with --follow. Default: alarms.toml in the workspace, if there.",
)
def alarms(location: Location, robot: str | None, follow: bool, config: Path | None) -> None:
    """List the alarms that are active: a gap out of its band, a robot idle for too long, a twin to identify again.

    With --follow, each is told once when it begins and once when it is over, as a line of JSON on standard output,
    and to the webhooks and MQTT brokers of alarms.toml. It runs beside `irtwin live`, which it never slows. Ctrl-C
    stops.

    \b
    Example: irtwin alarms --follow
    """
    from irtwin.alarms.tell import listed, tell

    if follow:
        tell(location, robot=robot, config=config, announce=say)
        return
    if config is not None:
        raise click.UsageError("--config goes with --follow.")
    from irtwin.report.terminal import show

    show(listed(location, robot))
