"""Commands that go on until they are stopped."""

from __future__ import annotations

from pathlib import Path

import click

from irtwin.cli.options import DAY, Number, database_option, graph_option, say, workspace_option


@click.command()
@workspace_option
@click.option("--port", type=click.IntRange(0, 65535), default=7878, show_default=True, help="0 picks a free port.")
@click.option("--host", default="127.0.0.1", show_default=True, help="Address to listen on.")
@click.option("--timeout", type=Number(0.1, DAY), default=30.0, show_default=True, help="Limit per query, s.")
@click.option(
    "--memory", type=click.IntRange(64, 1 << 20), default=1024, show_default=True, help="Limit per query, MB."
)
@click.option("--token-file", type=click.Path(path_type=Path), help="File with the token that permits updates.")
def serve(workspace: Path, port: int, host: str, timeout: float, memory: int, token_file: Path | None) -> None:
    """Serve the graph as a SPARQL endpoint, at /sparql.

    A query page is at /, and the ontology at the paths of its IRIs. The endpoint is read-only unless you give a token
    for updates, in a file or in the environment variable IRTWIN_TOKEN.
    """
    from irtwin.serve.pool import Limits
    from irtwin.serve.server import read_token
    from irtwin.serve.server import serve as serve_graph

    limits = Limits(seconds=timeout, memory=memory << 20)
    serve_graph(workspace / "graph", host, port, token=read_token(token_file), limits=limits, announce=_announce)


def _announce(address: str) -> None:
    click.echo(f"Serving {address}. Press Ctrl-C to stop.")


@click.command()
@workspace_option
@database_option
@graph_option
@click.option("--port", type=click.IntRange(0, 65535), help="Read from clients on this port of 127.0.0.1 instead.")
@click.option("--rtde", metavar="HOST[:PORT]", help="Follow the controller of a Universal Robots arm instead.")
@click.option("--robot", metavar="NAME", help="Whose controller it is.")
def live(
    workspace: Path,
    database: str | None,
    graph_url: str | None,
    port: int | None,
    rtde: str | None,
    robot: str | None,
) -> None:
    """Watch robots: store their samples and keep the graph up to date.

    Reads one JSON object per line from standard input. The fields are those of ROS' JointState: robot, time (s since
    1970), position, velocity, effort, and optionally temperature, power and name. Ctrl-C stops; every sample that was
    read is stored.
    """
    from irtwin.live.watch import watch

    if (rtde is None) != (robot is None):
        raise click.UsageError("--rtde and --robot go together.")
    if rtde is not None and port is not None:
        raise click.UsageError("Give --port or --rtde, not both.")
    watch(workspace, database=database, graph_url=graph_url, port=port, rtde=rtde, robot=robot, announce=say)
