"""The command line: arguments in, one call, its result shown."""

from __future__ import annotations

import errno
import math
import os
import sys
from collections.abc import Callable
from io import TextIOWrapper
from pathlib import Path
from typing import Any

import click

from irtwin import __version__
from irtwin.errors import InputError
from irtwin.robot_cli import robot as robot_group

_DAY = 86400.0  # s
_WORKSPACE = Path("irtwin-workspace")
_LONGEST = 2000  # characters of an error
_NO_POWER = "energy and power are not known; the twin has seen no power"


def main() -> None:
    """Run the command line; a user's mistake is one line on standard error and exit status 2."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")  # a terminal without UTF-8 is no reason to stop
    try:
        cli.main(standalone_mode=False)
        sys.stdout.flush()
    except InputError as error:
        _say(f"irtwin: {error}"[:_LONGEST])
        sys.exit(2)
    except OSError as error:
        if error.errno not in (errno.EPIPE, errno.ENOSPC, errno.EFBIG, errno.EDQUOT):
            raise
        if error.errno != errno.EPIPE:  # else who read the answer has left, and needs no word
            _say(f"irtwin: {error.filename or 'the output'}: {error.strerror}; free some space and try again")
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # Python flushes once more at its end
        sys.exit(2)
    except click.ClickException as error:
        error.show()
        sys.exit(2)
    except (click.Abort, KeyboardInterrupt):
        click.echo("irtwin: stopped", err=True)
        sys.exit(130)


class _Number(click.FloatRange):
    """A finite number; a plain range lets NaN pass."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Return the number; fail where it is none, or not finite."""
        number = super().convert(value, param, ctx)
        if not math.isfinite(number):
            self.fail(f"{value} is not a finite number.", param, ctx)
        return float(number)


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="irtwin")
def cli() -> None:
    """Build a digital twin of an industrial robot's energy and keep it in a knowledge graph.

    Start with `irtwin demo`. It builds a twin, a graph and a report from simulated logs of a KUKA KR6 R700.
    """


cli.add_command(robot_group)

_workspace = click.option(
    "--workspace",
    type=click.Path(path_type=Path, file_okay=False),
    default=_WORKSPACE,
    show_default=True,
    help="Folder with the database, series, graph and reports.",
)
_database = click.option(
    "--database",
    metavar="URL",
    envvar="IRTWIN_DATABASE",
    help="SQLAlchemy URL of the database. Default: SQLite in the workspace.",
)
_graph = click.option(
    "--graph",
    "graph_url",
    metavar="URL",
    envvar="IRTWIN_GRAPH",
    help="Query URL of a SPARQL 1.1 server for the graph. Default: a folder in the workspace.",
)


@cli.command()
@click.argument("dataset", type=click.Path(path_type=Path))
@_workspace
@_database
@_graph
@click.option("--repair", is_flag=True, help="Remove bad samples, and say how many and which.")
def run(dataset: Path, workspace: Path, database: str | None, graph_url: str | None, repair: bool) -> None:
    """Build a twin, a graph and a report from a data set.

    DATASET is a folder with dataset.toml, a URDF and one CSV or Parquet file per run.
    """
    from irtwin.workflow import run as run_all

    report = run_all(dataset, workspace, database=database, graph_url=graph_url, repair=repair, announce=_say)
    click.echo(report)


@cli.command()
@_workspace
def demo(workspace: Path) -> None:
    """Run the example data set: simulated logs of a KUKA KR6 R700."""
    from irtwin.workflow import run as run_all
    from irtwin.workflow import unpack_demo

    data_set = unpack_demo(workspace)
    click.echo(f"The example data set is in {data_set}. Use it as a template for your own.", err=True)
    report = run_all(data_set, workspace, announce=_say)
    click.echo(f"\nOpen the report in a browser: {report.resolve()}")
    click.echo(f"Ask the graph:                irtwin query energy_per_joint --workspace {workspace}")


@cli.command()
@click.argument("question", required=False)
@click.option("--robot", metavar="NAME", help="Ask about this robot only.")
@_workspace
@_graph
@click.option(
    "--format",
    "form",
    type=click.Choice(["table", "json", "csv"]),
    default="table",
    show_default=True,
    help="Output format.",
)
def query(question: str | None, robot: str | None, workspace: Path, graph_url: str | None, form: str) -> None:
    """Ask the graph a question, by name or in SPARQL.

    Without QUESTION, the named questions are listed by theme.
    """
    from irtwin import asking
    from irtwin.knowledge.questions.queries import to_csv, to_json
    from irtwin.knowledge.store.no_network import leave_network

    if question is None:
        answer = asking.questions()
    else:
        if graph_url is None:
            leave_network()
        answer = asking.ask(question, workspace, robot=robot, graph_url=graph_url)
    for fault in answer.faults:
        _say(f"irtwin: {fault}")
    if form == "table":
        from irtwin.report.terminal import show

        show(answer, in_sections=question is None)
    else:
        click.echo(to_json(answer) if form == "json" else to_csv(answer), nl=form == "json")


@cli.command()
@click.argument("dataset", type=click.Path(path_type=Path))
@click.option(
    "--json",
    "out",
    type=click.Path(path_type=Path, dir_okay=False),
    required=True,
    help="JSON file to write the diagnosis to.",
)
@click.option("--report", type=click.Path(path_type=Path, dir_okay=False), help="HTML file to write the report to.")
@click.option(
    "--save-twin",
    type=click.Path(path_type=Path, dir_okay=False),
    help="JSON file to write the twin to, with the causes added.",
)
@click.option("--withhold", metavar="EFFECT", multiple=True, help="Remove this effect from the twin first. Repeatable.")
@click.option("--seed", type=int, default=0, show_default=True, help="Seed of the random resampling.")
@click.option("--repair", is_flag=True, help="Remove bad samples, and say how many and which.")
@click.option("--workspace", type=click.Path(path_type=Path, file_okay=False), help="Also store the diagnosis there.")
@_database
@_graph
def diagnose(
    dataset: Path,
    out: Path,
    report: Path | None,
    save_twin: Path | None,
    withhold: tuple[str, ...],
    seed: int,
    repair: bool,
    workspace: Path | None,
    database: str | None,
    graph_url: str | None,
) -> None:
    """Find where a twin and its robot differ, and why.

    The diagnosis says where the gap lies, which effects cause it, and how much of it closes when the twin gets them.
    """
    from irtwin import workflow
    from irtwin.report.gap.headline import line

    found = workflow.diagnose(
        dataset,
        withhold=withhold,
        seed=seed,
        repair=repair,
        workspace=workspace,
        database=database,
        graph_url=graph_url,
        json_file=out,
        report=report,
        twin_file=save_twin,
        announce=_say,
    )
    click.echo(line(found.document, found.against))


@cli.command()
@click.argument("twin", type=click.Path(path_type=Path))
@click.argument("run", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path, dir_okay=False), required=True, help="Parquet file to write.")
@click.option("--payload-mass", type=_Number(0.0, 1e5), help="Payload mass, kg. Default: from the run's data set.")
@click.option(
    "--payload-com",
    type=_Number(-10.0, 10.0),
    nargs=3,
    metavar="X Y Z",
    help="Payload's centre of mass in the flange frame, m. Default: from the run's data set.",
)
def predict(
    twin: Path, run: Path, out: Path, payload_mass: float | None, payload_com: tuple[float, float, float] | None
) -> None:
    """Predict torque, power and energy of a run with a saved twin.

    TWIN is a file that `irtwin diagnose --save-twin` wrote. RUN is a CSV or Parquet file with the motion: a log, or
    what `plan` or `excite` wrote. A motion that leaves the robot's limits or in which two links meet is refused.
    """
    from irtwin import modelling

    expected = modelling.expect(twin, run, out, payload_mass=payload_mass, payload_com=payload_com)
    _say_unchecked(expected.checks_itself)
    click.echo(f"{out}: {expected.price or _NO_POWER}")


@cli.command()
@click.argument("source", type=click.Path(path_type=Path))
@click.option("--from", "start", metavar="POSE", required=True, help="Where the motion starts.")
@click.option("--to", "goal", metavar="POSE", required=True, help="Where it ends.")
@click.option("--out", type=click.Path(path_type=Path, dir_okay=False), required=True, help="CSV or Parquet file.")
@click.option("--line", is_flag=True, help="Lead the flange along a straight line.")
@click.option(
    "--box",
    "boxes",
    type=_Number(-1e3, 1e3),
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
@click.option("--seconds", type=_Number(min=0.0, min_open=True), help="Duration, s. Default: the shortest.")
@click.option("--rate", type=_Number(10.0, 10_000.0), default=100.0, show_default=True, help="Sampling rate, Hz.")
@click.option("--search", type=_Number(0.1, _DAY), default=10.0, show_default=True, help="Limit to find a path, s.")
@click.option("--payload-mass", type=_Number(0.0, 1e5), default=0.0, help="Payload mass, kg.")
@click.option(
    "--payload-com",
    type=_Number(-10.0, 10.0),
    nargs=3,
    default=(0.0, 0.0, 0.0),
    metavar="X Y Z",
    help="Payload's centre of mass in the flange frame, m.",
)
def plan(
    source: Path,
    start: str,
    goal: str,
    out: Path,
    line: bool,
    boxes: tuple[tuple[float, ...], ...],
    objective: str,
    seconds: float | None,
    rate: float,
    search: float,
    payload_mass: float,
    payload_com: tuple[float, float, float],
) -> None:
    """Plan a motion from pose to pose, around obstacles, and say what it costs.

    SOURCE is a twin that `irtwin diagnose --save-twin` wrote, or a URDF, or the folder of a data set, of which energy
    is not known. A POSE is joint positions, "0,-1.57,...", or a pose of the flange in the base frame,
    "pose:x,y,z,roll,pitch,yaw", in m and rad. The motion keeps to the limits of position, speed, acceleration, jerk and
    torque.
    """
    from irtwin import modelling
    from irtwin.planning.plan import Task
    from irtwin.planning.poses import read_target
    from irtwin.robot.collision import Obstacle

    twin = modelling.read_twin(source)
    joints = len(twin.robot.joints)
    task = Task(
        start=read_target(start, joints, "--from"),
        goal=read_target(goal, joints, "--to"),
        obstacles=[Obstacle((x, y, z), (a, b, c)) for x, y, z, a, b, c in boxes],
        line=line,
        least_energy=objective == "energy",
        seconds=seconds,
        search=search,
        payload_mass=payload_mass,
        payload_com=payload_com,
    )
    made = modelling.plan(twin, task, out, rate)
    _say_unchecked(made.checks_itself)
    clear = "" if math.isinf(made.clearance) else f", {1000 * made.clearance:.1f} mm least clearance"
    click.echo(f"{out}: {made.seconds:.3f} s{clear}; {made.price or _NO_POWER}")


@cli.command()
@click.argument("robot")
@_workspace
@_database
@_graph
def adopt(robot: str, workspace: Path, database: str | None, graph_url: str | None) -> None:
    """Replace a robot's twin by the one of its diagnosis.

    The energy in the graph is then computed with the new twin, and the energy report is written again.
    """
    from irtwin import workflow

    click.echo(workflow.adopt(robot, workspace, database=database, graph_url=graph_url))


@cli.command()
@_workspace
@_graph
@click.option("--owl", type=click.Path(path_type=Path, dir_okay=False), required=True, help="RDF/XML file to write.")
def export(workspace: Path, graph_url: str | None, owl: Path) -> None:
    """Write the whole graph as one OWL file for Protégé.

    The file holds ontology, individuals and inferences in RDF/XML.
    """
    from irtwin import asking

    asking.export(owl, workspace, graph_url=graph_url)
    click.echo(owl)


@cli.command()
@click.argument("urdf", type=click.Path(path_type=Path))
@click.option("--seconds", type=_Number(min=1.0), required=True, help="Duration of the motion, s.")
@click.option("--out", type=click.Path(path_type=Path, dir_okay=False), required=True, help="CSV file to write.")
@click.option("--rate", type=_Number(min=1.0), default=100.0, show_default=True, help="Sampling rate, Hz.")
@click.option("--seed", type=int, default=0, show_default=True, help="Each seed gives another motion.")
@click.option(
    "--box",
    type=_Number(-1e3, 1e3),
    nargs=6,
    metavar="X Y Z X Y Z",
    help="Keep the flange in a box, given by two corners in the base frame, m. Links always stay above the floor.",
)
def excite(urdf: Path, seconds: float, out: Path, rate: float, seed: int, box: tuple[float, ...] | None) -> None:
    """Design a motion that excites every base parameter.

    The motion is a finite Fourier series. It starts and ends at rest and keeps the joint limits, between samples too.
    Links with collision shapes keep off one another, and torque by the URDF's bodies within its limits.
    Ctrl-C keeps the best motion so far.
    """
    from irtwin.identification import excitation
    from irtwin.identification.motion_limits import Box
    from irtwin.robot.collision import CollisionModel
    from irtwin.robot.urdf import read_urdf

    robot = read_urdf(urdf)
    within = None
    if box is not None:
        x, y, z, *other = box
        within = Box(
            lower=(min(x, other[0]), min(y, other[1]), min(z, other[2])),
            upper=(max(x, other[0]), max(y, other[1]), max(z, other[2])),
        )
    checks_itself = CollisionModel(robot).checks_itself
    motion = excitation.excite(robot, seconds, rate=rate, seed=seed, box=within, progress=_excitation_progress())
    motion.write_csv(out)
    _say_unchecked(checks_itself)
    ended = {motion.bounded: "The search reached its limit of work. ", motion.interrupted: "Stopped. "}.get(True)
    click.echo(f"\n{ended}This is the best motion so far." if ended else "", err=True)
    click.echo(
        f"{out}: condition number {motion.condition_number:.1f}, "
        f"{motion.limit_margin:.1%} margin to the joint limits, "
        + ("no wall within reach" if motion.clearance == math.inf else f"{motion.clearance:.3f} m to the nearest wall")
    )


@cli.command()
@click.option(
    "--out",
    type=click.Path(path_type=Path, dir_okay=False),
    default=Path("irtwin-ontology.html"),
    show_default=True,
    help="HTML file to write.",
)
def docs(out: Path) -> None:
    """Write the ontology's documentation as one HTML page."""
    from irtwin.report.ontology.page import write_page

    write_page(out)
    click.echo(out)


@cli.command("map")
@click.argument("mapping", type=click.Path(path_type=Path))
@click.option("--database", metavar="URL", required=True, help="SQLAlchemy URL of the database to map.")
@click.option("--out", type=click.Path(path_type=Path, dir_okay=False), required=True, help="N-Quads file to write.")
@click.option("--timeout", type=_Number(min=0.1), default=600.0, show_default=True, help="Limit per triples map, s.")
def map_database(mapping: Path, database: str, out: Path, timeout: float) -> None:
    """Map a database to triples with an R2RML document.

    Works with any R2RML document and any database that SQLAlchemy supports.
    """
    from irtwin.knowledge.mapping import map_to_file

    map_to_file(mapping, database, out, seconds=timeout)


@cli.command()
@_workspace
@click.option("--port", type=click.IntRange(0, 65535), default=7878, show_default=True, help="0 picks a free port.")
@click.option("--host", default="127.0.0.1", show_default=True, help="Address to listen on.")
@click.option("--timeout", type=_Number(0.1, _DAY), default=30.0, show_default=True, help="Limit per query, s.")
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


@cli.command()
@click.argument("source", type=click.Path(path_type=Path), required=False)
@click.option("--out", type=click.Path(path_type=Path, dir_okay=False), help="RDF file to write, with SOURCE.")
@click.option(
    "--engine",
    type=click.Choice(["native", "owlrl", "hermit"]),
    default="native",
    show_default=True,
    help="Who draws the conclusions, see above.",
)
@_workspace
@_database
@_graph
def reason(
    source: Path | None, out: Path | None, engine: str, workspace: Path, database: str | None, graph_url: str | None
) -> None:
    """Draw all conclusions from the graph, or from an RDF file.

    Without SOURCE, the conclusions in the workspace's graph are drawn again. With SOURCE, OUT gets what SOURCE says
    and all that follows; the file suffixes decide the formats. If it contradicts itself, nothing is written and the
    exit status is 3.

    \b
    native  OWL 2 RL by the rules that ship. Takes under 1 s for 10,000 triples.
            Finds nothing that needs unnamed individuals or a choice of cases.
    owlrl   The same rules by the Python package owlrl, to check the native engine.
            Takes 10 s for 10,000 triples, twice for a workspace; 300,000 at most.
            Compares no literals.
    hermit  OWL 2 DL by HermiT, and what OWL 2 RL concludes from its results.
            Also finds what native cannot. Takes 5 s for 10,000 triples. Needs Java
            and an ontology that is OWL 2 DL.
    """
    from irtwin.knowledge.owl_rl.closure import Contradiction

    if (source is None) != (out is None):
        raise click.UsageError("SOURCE and --out go together." if source is None else "Missing option '--out'.")
    try:
        if source is not None and out is not None:
            from irtwin.knowledge.owl_rl.file import close_file

            click.echo(f"{out}: {close_file(source, out, engine)} triples inferred by {engine}")
        else:
            from irtwin.workflow import reason_again

            reason_again(workspace, engine=engine, database=database, graph_url=graph_url, announce=_say)
    except Contradiction as clash:
        _say(f"irtwin: {source or workspace}: {clash}")
        sys.exit(3)


@cli.command()
@click.argument("triple", nargs=-1, required=True)
@_workspace
@_graph
@click.option("--json", "as_json", is_flag=True, help="Write nested JSON objects instead of an outline.")
def explain(triple: tuple[str, ...], workspace: Path, graph_url: str | None, as_json: bool) -> None:
    """Explain where a triple of the graph comes from.

    The explanation names the rule, mapping or provider and the facts it used, down to runs, files and checksums.
    TRIPLE is subject, predicate and object: prefixed names, IRIs or literals. `?` or a missing part matches anything.
    """
    import json

    from irtwin import asking
    from irtwin.knowledge.explain.explanation import to_json, to_text

    found = asking.explain(" ".join(triple), workspace, graph_url=graph_url)
    if as_json:
        click.echo(json.dumps([to_json(each) for each in found], indent=2, ensure_ascii=False))
    else:
        click.echo("\n\n".join(map(to_text, found)))


@cli.command()
@_workspace
@_database
@_graph
@click.option("--port", type=click.IntRange(0, 65535), help="Read from clients on this port of 127.0.0.1 instead.")
def live(workspace: Path, database: str | None, graph_url: str | None, port: int | None) -> None:
    """Watch robots: store their samples and keep the graph up to date.

    Reads one JSON object per line from standard input. The fields are those of ROS' JointState: robot, time (s since
    1970), position, velocity, effort, and optionally temperature, power and name. Ctrl-C stops; every sample that was
    read is stored.
    """
    from irtwin.live.watch import watch

    watch(workspace, database=database, graph_url=graph_url, port=port, announce=_say)


@cli.command()
@click.argument("robot")
@_workspace
@_database
@_graph
def drop(robot: str, workspace: Path, database: str | None, graph_url: str | None) -> None:
    """Remove a ROBOT from the workspace.

    Its runs, twin, diagnosis, live runs and report are deleted, and everything that the graph says about it.
    """
    from irtwin import upkeep

    upkeep.drop(robot, workspace, database=database, graph_url=graph_url)


@cli.command()
@_workspace
@_database
def repair(workspace: Path, database: str | None) -> None:
    """Rebuild a damaged graph from the database.

    Lists the series, twins and diagnoses that are missing or altered; the exit status is then 2. A damaged database
    needs `restore`.
    """
    from irtwin import upkeep

    upkeep.repair(workspace, database=database, announce=_say)
    click.echo(workspace)


@cli.command()
@click.argument("archive", type=click.Path(path_type=Path, dir_okay=False))
@_workspace
@_database
@_graph
def backup(archive: Path, workspace: Path, database: str | None, graph_url: str | None) -> None:
    """Write a workspace into one ARCHIVE, even while others write to it.

    It holds graph, database (also the rows of a server), series, twins, diagnoses and reports, with checksums.
    """
    from irtwin import workflow

    workflow.backup(archive, workspace, database=database, graph_url=graph_url)
    click.echo(archive)


@cli.command()
@click.argument("archive", type=click.Path(path_type=Path, dir_okay=False))
@_workspace
@_database
@_graph
def restore(archive: Path, workspace: Path, database: str | None, graph_url: str | None) -> None:
    """Create a new workspace from an ARCHIVE that `backup` wrote.

    A damaged archive restores nothing, and nothing is overwritten.
    """
    from irtwin.knowledge.store.backup import restore as restore_all

    restore_all(archive, workspace, database, graph_url)
    click.echo(workspace)


def _say_unchecked(checks_itself: bool) -> None:
    if not checks_itself:
        _say("The URDF has no collision shapes, so it was not checked whether the robot meets itself.")


def _say(line: str) -> None:
    """Write one line to standard error: names that were read may hold what breaks lines or steers a terminal."""
    click.echo("".join(sign if sign.isprintable() else repr(sign)[1:-1] for sign in line), err=True)


def _excitation_progress() -> Callable[[int, float, float], None]:
    """Return a progress line that is rewritten in a terminal, and said every few seconds in a log."""
    shown = [-5.0]

    def progress(iteration: int, condition: float, elapsed: float) -> None:
        line = f"{elapsed:5.0f} s  step {iteration:4d}  condition number {condition:8.1f}"
        if sys.stderr.isatty():
            click.echo(f"\r{line}", err=True, nl=False)
        elif elapsed - shown[0] >= 5.0:
            shown[0] = elapsed
            click.echo(line, err=True)

    return progress
