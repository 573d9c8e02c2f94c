"""Commands that go on until they are stopped."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import click

from irtwin.cli.options import DAY, FILE, PLACE, Number, located, located_graph, say
from irtwin.location import Location

_ENDPOINT = re.compile(r'https?://[^\s<>"{}|\\^`#@/?]+([/?][^\s<>"{}|\\^`#]*)?')


def _checked_services(context: click.Context, option: click.Parameter, urls: tuple[str, ...]) -> tuple[str, ...]:
    for url in urls:
        if _ENDPOINT.fullmatch(url) is None:
            raise click.BadParameter(f"{url}: give the whole http or https address of a SPARQL endpoint, no password.")
    return urls


@click.command()
@located
@click.option("--port", type=click.IntRange(0, 65535), default=7878, show_default=True, help="0 picks a free port.")
@click.option("--host", default="127.0.0.1", show_default=True, help="Address to listen on.")
@click.option("--timeout", type=Number(0.1, DAY), default=30.0, show_default=True, help="Limit per query, s.")
@click.option(
    "--memory", type=click.IntRange(64, 1 << 20), default=1024, show_default=True, help="Limit per query, MB."
)
@click.option(
    "--allow-origin", "origins", metavar="ORIGIN", multiple=True, help="Site whose pages may ask the endpoint."
)
@click.option(
    "--allow-service",
    "services",
    metavar="URL",
    multiple=True,
    callback=_checked_services,
    help="SPARQL endpoint that queries may ask by SERVICE.",
)
@click.option("--token-file", type=PLACE, help="File with the token that permits updates.")
@click.option("--opcua", metavar="PORT", type=click.IntRange(1, 65535), help="Answer OPC UA clients on this port, too.")
@click.option(
    "--mcp", is_flag=True, help="Serve tools of the Model Context Protocol instead, on standard input and output."
)
def serve(
    location: Location,
    port: int,
    host: str,
    timeout: float,
    memory: int,
    origins: tuple[str, ...],
    services: tuple[str, ...],
    token_file: Path | None,
    opcua: int | None,
    mcp: bool,
) -> None:
    """Serve the plant's pages at / and the graph as a SPARQL endpoint at /sparql.

    A query page is at /query, live robots at /live, the ontology and each individual at the paths of their IRIs. Prices
    are shown where `plant.toml` in the workspace says price_per_kwh, currency and co2_kg_per_kwh. The endpoint is
    read-only unless you give a token for updates, in a file or in the environment variable IRTWIN_TOKEN. What an update
    asserts is kept in the database, with what `From:` of the request says for its author.

    Where a command was broken off and left the graph behind the database, answers have the header `Irtwin-Graph:
    behind` (`updating` while a command is at work on it) and pages a banner. The server catches up by itself.

    With --allow-service anybody's query may have this machine ask that endpoint, by SERVICE <URL> as written here.
    No token goes there, no redirect is followed, and the limits of time and memory hold for all of the query.

    With --graph the pages and the endpoint ask the server that keeps the graph. Functions of series are not there
    then, and a query that is cancelled may go on at that server, up to its own limit. --database is read at the
    start, as the graph must know of robots if the database does, and to catch up.

    With --opcua energy, power, state and last gap of each robot can be read by OPC UA clients, below
    Objects/Machines, by whoever reaches the port. Needs irtwin[opcua].

    With --mcp the named questions, SPARQL, explanations, diagnoses and predictions are tools that read and write
    nothing, of data sets below the current folder. Needs irtwin[mcp].

    \b
    Example: irtwin serve --workspace plant
    Example: irtwin serve --workspace plant --mcp
    """
    if mcp:
        from irtwin.serve.tools import server

        server(location, timeout).run()
        return
    if services and location.graph_url is not None:
        raise click.UsageError(
            "--allow-service is for a graph in the workspace: a server that keeps it asks by itself."
        )
    from irtwin.serve.pool import Limits
    from irtwin.serve.server import read_token
    from irtwin.serve.server import serve as serve_graph

    limits = Limits(seconds=timeout, memory=memory << 20, services=services)
    token = read_token(token_file)
    serve_graph(location, host, port, token=token, limits=limits, announce=_announce, origins=origins, opcua=opcua)


def _announce(address: str) -> None:
    click.echo(f"Serving {address}, and pages of it at {address.removesuffix('sparql')}. Press Ctrl-C to stop.")


@click.command()
@located
@click.option("--port", type=click.IntRange(0, 65535), help="Read from clients on this port of 127.0.0.1 instead.")
@click.option("--replay", type=PLACE, help="Play this log of a robot instead.")
@click.option("--opcua", metavar="URL", help="Follow a robot by its OPC UA server instead, opc.tcp://HOST:PORT.")
@click.option("--nodes", type=PLACE, help="TOML file that names its nodes where that is no OPC 40010 server.")
@click.option("--robot", metavar="NAME", help="Whose log or server it is.")
@click.option("--speed", type=Number(0.01, 1000.0), default=1.0, show_default=True, help="Of the log, times its own.")
@click.option("--performs", metavar="PLAN", help="Name of the planned run that the robot carries out.")
def live(
    location: Location,
    port: int | None,
    nodes: Path | None,
    robot: str | None,
    speed: float,
    performs: str | None,
    **of_one: Any,
) -> None:
    """Watch robots: store their samples and keep the graph up to date, with power, energy, gap and alarms.

    Reads one JSON object per line from standard input. The fields are those of ROS' JointState: robot, time (s since
    1970), position, velocity, effort, and optionally temperature, power and name; the first line may say in `performs`
    which plan is carried out. Ctrl-C stops; every sample that was read is stored. While it runs, `irtwin serve` shows
    the robots at /live.

    \b
    Example: irtwin live < states.jsonl
    Example: irtwin live --opcua opc.tcp://192.168.0.30:4840 --robot KR6
    """
    from irtwin.live.watch import watch
    from irtwin.workflow import catch_up

    given = [source for source in (port, *of_one.values()) if source is not None]
    if len(given) > 1:
        raise click.UsageError("Give one of --port, --replay and --opcua.")
    if (robot is None) != all(source is None for source in of_one.values()):
        raise click.UsageError("--robot goes with --replay or --opcua: it says whose log or server it is.")
    if speed != 1.0 and of_one["replay"] is None:
        raise click.UsageError("--speed is for --replay.")
    if nodes is not None and of_one["opcua"] is None:
        raise click.UsageError("--nodes is for --opcua.")
    if performs is not None and robot is None:
        raise click.UsageError("--performs goes with --robot; lines of a stream say it by themselves.")
    catch_up(location, say)  # while it watches, nobody else can; a fault in what extends the workspace is said here
    watch(location, port=port, nodes=nodes, robot=robot, speed=speed, performs=performs, announce=say, **of_one)


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
    and to the MQTT brokers of alarms.toml. It runs beside `irtwin live`, which it never slows. Ctrl-C
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
