"""Commands that build twins: a data set in, a twin, a graph and a report out."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from irtwin.cli.fleet import of_many
from irtwin.cli.options import (
    FILE,
    FOLDER,
    PLACE,
    Number,
    announce,
    base_option,
    database_option,
    graph_option,
    located,
    locating,
    no_open_option,
    payload_com_option,
    payload_mass_option,
    refuse,
    say,
    show_page,
    tell_contradictions,
)
from irtwin.location import Location

if TYPE_CHECKING:
    from irtwin.signals.finding import LogFinding


@click.command()
@of_many("run", "base")
@located
@click.option("--repair", is_flag=True, help="Remove bad samples, and say how many and which.")
@base_option
def run(dataset: Path, location: Location, **asked: Any) -> None:
    """Build a twin, a graph and a report from a data set, or from many.

    DATASET is a folder with dataset.toml, a URDF and one CSV or Parquet file per run.

    The base of IRIs may stand in `plant.toml` of the workspace instead, as base_iri = "https://plant.example/energy/".
    Where statements in the graph contradict each other, nothing is concluded from these alone; they are said, and the
    exit status is 3.

    With --out, DATASET is a folder with data sets below it, or a text file with one folder a line. Each is taken by
    itself, a batch of them shares a workspace below --out, and one that is refused costs no other. What is done is not
    done again: after a crash the same command goes on, and `irtwin workspace status --workspace RESULTS` counts. The
    exit status is 3 where some were set aside.

    \b
    Example: irtwin run my_robot --workspace plant
    Example: irtwin run robots/ --out results
    """
    from irtwin.workflow import run as run_all

    click.echo(run_all(dataset, location, announce=announce, **asked))
    tell_contradictions(location)


@click.command()
@click.argument("dataset", type=PLACE)
@click.option("--json", "out", type=FILE, help="JSON file to write findings to.")
@click.option("--repair", is_flag=True, help="Remove bad samples, and say how many and which.")
def check(dataset: Path, out: Path | None, repair: bool) -> None:
    """Look for faults in a log: signs, swapped columns, units, dead channels.

    What the data leave no doubt of is mended where that is possible (never in your files). The exit status is 2 where
    something must be cured first; `run` and `diagnose` stop there, too.

    \b
    Example: irtwin check my_robot
    """
    from irtwin import modelling

    result = modelling.check_log(dataset, repair=repair, json_file=out)
    for line in result.data_set.repairs:
        say(line)
    for line in dict.fromkeys(f"{_state(finding)}: {finding.say}" for finding in result.findings):
        say(line)
    if not result.sound:
        sys.exit(2)
    faults = result.findings or result.data_set.repairs
    say("nothing that must be cured first" if faults else "no fault found")


@click.command()
@located
@base_option
@no_open_option
@click.option(
    "--case-study", is_flag=True, help="Plan, price, measure and show a motion instead, as the seed paper does."
)
@click.option("--from", "start", metavar="POSE", help="Where its process starts, as of `irtwin plan`.")
@click.option("--to", "goal", metavar="POSE", help="Where it ends.")
@click.option("--seconds", type=Number(min=0.0, min_open=True), help="How long it takes, s. Default: 1.2.")
def demo(
    location: Location,
    no_open: bool,
    case_study: bool,
    start: str | None,
    goal: str | None,
    seconds: float | None,
    **asked: Any,
) -> None:
    """Run the example data set: simulated logs of a KUKA KR6 R700. On a desktop, show its report in a browser.

    Two gaps are there to be found: the twin lacks losses that the robot has, and simulator.xml, a model for MuJoCo
    beside the logs, has a fault. The last lines say how.

    With --case-study, its twin plans a motion from an initial to a final configuration and says what it will take; that
    is kept and mapped, and read back from the graph. Then a simulated robot carries it out as you watch, and a random
    motion besides, and one page shows all of it beside the paper's figures. It needs a new workspace, and the extras
    `plan` and `mujoco`.

    \b
    Example: irtwin demo --workspace my_demo
    Example: irtwin demo --case-study --from 0,-1.57,1.57,0,0,0 --to 1,-1,1.2,0,0.5,0 --seconds 1.5 --workspace study
    """
    more: tuple[str, ...] = ()
    if case_study:
        from irtwin.case_study import case_study as carry_out
        from irtwin.case_study import task_of

        task = task_of(start, goal, seconds)
        page, question = carry_out(location, task=task, announce=announce, **asked), "planned_against_measured"
    elif (start, goal, seconds) != (None, None, None):
        raise click.UsageError("--from, --to and --seconds say what the case study does; give --case-study, too")
    else:
        from irtwin.workflow import run as run_all
        from irtwin.workflow import unpack_demo

        data_set = unpack_demo(location.folder)
        announce(f"The example data set is in {data_set}. Use it as a template for your own.")
        page, question = run_all(data_set, location, announce=announce, **asked), "energy_per_joint"
        more = _gaps_to_find(data_set, page.stem, location)
    click.echo(f"\nOpen the page in a browser: {page.resolve()}")
    if not no_open:
        show_page(page)
    click.echo(f"Ask the graph:              irtwin query {question} --workspace {location.folder}")
    for line in more:
        click.echo(line)


def _gaps_to_find(data_set: Path, robot: str, location: Location) -> tuple[str, ...]:
    """Write a simulator with a fault beside the demo's logs; return a line on each gap that is there to be found."""
    from irtwin import modelling, plans

    model, joint = data_set / "simulator.xml", "joint_a2"
    modelling.write_faulty_model(plans.robot_twin(robot, location), joint, model)
    diagnose = f"irtwin diagnose {data_set}"
    return (
        f"Find what the twin lacks:   {diagnose} --report gap.html",
        f"Mend a simulator whose {joint} has half its rotor's inertia (needs irtwin[mujoco]):",
        f"                            {diagnose} --simulator {model} --save-simulator better.xml",
    )


@click.command()
@of_many("diagnose")
@click.option("--json", "json_file", type=FILE, help="JSON file to write the diagnosis to.")
@click.option("--report", type=FILE, help="HTML file to write the report to.")
@click.option("--save-twin", "twin_file", type=FILE, help="JSON file to write the twin to, with the causes added.")
@click.option("--save-motion", "motion_file", type=FILE, help="CSV file to write the motion of the next experiment to.")
@click.option(
    "--twin",
    type=FILE,
    help="Twin that --save-twin wrote, to hold the data against: its effects are the baseline, its numbers the prior.",
)
@click.option(
    "--simulator",
    metavar="MODEL.xml",
    type=FILE,
    help="Model of the robot, MJCF, URDF, SDF or USD, to hold the data against: what differs is said. Logs with "
    "commands are played through it where it has servos. Needs irtwin[mujoco], and irtwin[usd] for USD.",
)
@click.option(
    "--joints",
    metavar="NAME,NAME",
    help="What that model calls the robot's joints, in the robot's order, where it calls them otherwise.",
)
@click.option(
    "--play",
    "only_played",
    is_flag=True,
    help="Play the commands through that model as it is, and say how far it is from the robot: nothing is fitted.",
)
@click.option(
    "--save-simulator",
    "simulator_file",
    type=FILE,
    help="File to write that model to, with the numbers that the robot has; all else stays as it is.",
)
@click.option(
    "--save-sysid",
    "sysid_file",
    metavar="FILE.py",
    type=FILE,
    help="Script to write that fits the numbers that differ by MuJoCo's own system identification, mujoco.sysid.",
)
@click.option(
    "--draws",
    type=click.IntRange(0, 10_000),
    default=0,
    metavar="N",
    help="Also write N models with these numbers as they could be, FILE-1 and so on: for domain randomisation.",
)
@click.option("--withhold", metavar="EFFECT", multiple=True, help="Remove this effect from the twin first. Repeatable.")
@click.option(
    "--trust",
    metavar="FAMILY",
    multiple=True,
    help="Hold these to be right, as bodies, masses (bodies without rotors) or friction, or one effect: no cause is "
    "looked for there. Repeatable.",
)
@click.option(
    "--held-out",
    metavar="RUN",
    multiple=True,
    help="Fit played logs without this run, and tell the tracking error of such runs alone. Repeatable.",
)
@click.option(
    "--cutoff",
    type=Number(min=0.0, min_open=True),
    metavar="HZ",
    help="Cutoff of the low-pass filter that all runs pass. Default: that of dataset.toml, else it is found.",
)
@click.option("--seed", type=int, default=0, show_default=True, help="Seed of the random resampling, and of draws.")
@click.option("--repair", is_flag=True, help="Remove bad samples, and say how many and which.")
@locating(
    click.option("--workspace", type=FOLDER, help="Also store the diagnosis there."), database_option, graph_option
)
def diagnose(
    dataset: Path,
    simulator: Path | None,
    joints: str | None,
    only_played: bool,
    simulator_file: Path | None,
    location: Location | None,
    **asked: Any,
) -> None:
    """Find where a twin, or a simulator, and its robot differ, and why.

    The diagnosis says where the gap lies, which effects cause it, and how much of it closes when the twin gets them.
    A summary is printed; --report and --json write all of it.

    With --out, every data set below the folder DATASET is diagnosed, as `irtwin run --out` takes many: gap.json and
    twin.json go to a folder for each.

    \b
    Example: irtwin diagnose my_robot --report gap.html
    Example: irtwin diagnose robots/ --out results
    """
    from irtwin.diagnosing import diagnose as judge
    from irtwin.report.gap import summary
    from irtwin.report.terminal import show
    from irtwin.simulator.differences import not_held

    for option, file in (
        ("--joints names those of", joints),
        ("--play plays", only_played),
        ("--save-simulator writes", simulator_file),
        ("--save-sysid fits", asked["sysid_file"]),
    ):
        if file and not simulator:
            raise click.UsageError(f"{option} the model of --simulator: give that too")
    if asked["draws"] and not simulator_file:
        raise click.UsageError("--draws writes models beside that of --save-simulator: give that too")
    called = joints.split(",") if joints else ()
    if simulator and only_played:
        _play(dataset, simulator, called, asked)
        return
    diagnosis = judge(
        dataset,
        simulator=simulator,
        joints=called,
        simulator_file=simulator_file,
        workspace=location,
        announce=announce,
        **asked,
    )
    click.echo(summary.line(diagnosis.document, diagnosis.against))
    for line in (*summary.refused(diagnosis.document), *summary.filtered(diagnosis.document)):
        click.echo(line)
    for table in (
        summary.gap(diagnosis.document),
        summary.runs(diagnosis.curves),
        summary.horizons(diagnosis.document),
        summary.causes(diagnosis.document, diagnosis.against),
    ):
        if table:
            click.echo()
            show(table, counted=False)
    kept = summary.not_held(not_held(diagnosis.document), diagnosis.document) if simulator else []
    for line in summary.meanings(diagnosis.document):
        click.echo(line)
    for some in filter(None, (kept, summary.next_steps(diagnosis.document))):
        click.echo("\n" + "\n".join(some))


def _play(dataset: Path, simulator: Path, joints: Sequence[str], asked: Mapping[str, Any]) -> None:
    from irtwin.diagnosing import play
    from irtwin.report.gap import summary
    from irtwin.report.terminal import show

    own = ("json_file", "repair")
    refuse({*asked, "simulator_file", "workspace"} - {*own}, "is of a diagnosis, and does not go with --play")
    log = play(dataset, simulator, joints=joints, announce=announce, **{name: asked[name] for name in own})
    for place, table in enumerate(summary.played(log)):
        if place:
            click.echo()
        show(table, counted=False)


@click.command()
@click.argument("robot")
@click.argument("new_log", metavar="[LOG]", type=PLACE, required=False)
@located
@payload_mass_option
@payload_com_option
@click.option("--performs", metavar="PLAN", help="Name of the planned run that the log carried out.")
@click.option("--repair", is_flag=True, help="Remove bad samples, and say how many and which.")
def improve(robot: str, new_log: Path | None, location: Location, **asked: Any) -> None:
    """Better a robot's twin: by the causes that its diagnosis found, or by a new log.

    Without LOG, the twin of the robot's last diagnosis (`irtwin diagnose --workspace`) becomes the robot's: energy is
    computed with it, and the energy report is written again.

    LOG is a CSV or Parquet file, such as of the motion that `irtwin run` proposed. The twin is fitted again, with the
    effects that it lacks where that is needed. The earlier twin stays unless the new one is better on what neither was
    fitted to.

    \b
    Example: irtwin improve KUKA_KR6_R700
    Example: irtwin improve KUKA_KR6_R700 monday.csv --payload-mass 2.5
    """
    if new_log is None:
        refuse(asked, "says how LOG was made, and goes with it")
        from irtwin import workflow

        click.echo(workflow.adopt(robot, location, announce=say))
        return
    from irtwin import improvement

    improved = improvement.improve(robot, new_log, location, announce=announce, **asked)
    for number, trial in enumerate(improved.rounds, start=1):
        click.echo(
            f"round {number}, {trial.tried}: {trial.error_before_percent:.3g} % before, "
            f"{trial.error_after_percent:.3g} % after; {trial.outcome}"
        )
    if improved.within:
        click.echo(f"The twin is within the limit of {improved.limit:g} % on every run.")
    else:
        click.echo(f"Nothing helps yet: the twin is beyond the limit of {improved.limit:g} %. What to log next:")
        for line in improved.next.words if improved.next else ():
            click.echo(line)


def _state(finding: LogFinding) -> str:
    state = "mended" if finding.mended else "cure first" if finding.stops else "doubtful"
    return f"{finding.fault.replace('_', ' ')} ({state})"
