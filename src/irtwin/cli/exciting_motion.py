"""The command that designs a motion which excites every base parameter."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from pathlib import Path

import click

from irtwin.cli.options import FILE, OUT, PLACE, Number, announce, page_option, say_unchecked, speech

_LONG = 30.0  # s: of less nothing is said before


@click.command()
@click.argument("urdf", type=PLACE)
@click.option("--seconds", type=Number(min=1.0), required=True, help="Duration of the motion, s.")
@click.option("--out", type=FILE, required=True, help=OUT)
@page_option
@click.option("--rate", type=Number(min=1.0), default=100.0, show_default=True, help="Sampling rate, Hz.")
@click.option("--seed", type=int, default=0, show_default=True, help="Each seed gives another motion.")
@click.option(
    "--box",
    type=Number(-1e3, 1e3),
    nargs=6,
    metavar="X Y Z X Y Z",
    help="Keep the flange in a box, given by two corners in the base frame, m. Links always stay above the floor.",
)
@click.option(
    "--criterion",
    type=click.Choice(["condition", "determinant"]),
    default="condition",
    show_default=True,
    help="What is to be least: the condition number, or the determinant of the covariance (D-optimal).",
)
@click.option(
    "--task",
    "tasks",
    type=FILE,
    multiple=True,
    help="CSV or Parquet file of a motion whose energy is to be told best, in place of a criterion. Repeatable.",
)
def excite(
    urdf: Path,
    seconds: float,
    out: Path,
    page: Path | None,
    rate: float,
    seed: int,
    box: tuple[float, ...] | None,
    criterion: str,
    tasks: tuple[Path, ...],
) -> None:
    """Design a motion that excites every base parameter.

    The motion is a finite Fourier series. It starts and ends at rest and keeps the joint limits, between samples too.
    Links with collision shapes keep off one another, and torque by the URDF's bodies within its limits.
    With --task the variance of these motions' mechanical energy is least. Ctrl-C keeps the best motion so far.

    \b
    Example: irtwin robot excite my.urdf --seconds 20 --criterion determinant --out motion.csv
    """
    from irtwin import modelling
    from irtwin.identification import excitation
    from irtwin.identification.base_condition import determinant
    from irtwin.identification.motion_limits import Box
    from irtwin.robot.collision import CollisionModel
    from irtwin.robot.urdf import read_urdf
    from irtwin.signals.motion import Motion
    from irtwin.storage.files import check_place

    modelling.check_plan_file(out)
    if page is not None:
        check_place(page)
    described = read_urdf(urdf)
    within = None
    if box is not None:
        x, y, z, *other = box
        within = Box(
            lower=(min(x, other[0]), min(y, other[1]), min(z, other[2])),
            upper=(max(x, other[0]), max(y, other[1]), max(z, other[2])),
        )
    checks_itself = CollisionModel(described).checks_itself
    expected = excitation.expected_seconds(len(described.joints), seconds)
    if expected > _LONG:
        announce(f"  {len(described.joints)} joints: about {10 * round(expected / 10)} s of processor")
    motion = excitation.excite(
        described,
        seconds,
        rate=rate,
        seed=seed,
        box=within,
        criterion=determinant if criterion == "determinant" else None,
        tasks=[motion for task in tasks for motion in modelling.motions_of(described, task)],
        progress=_excitation_progress(),
    )
    sampled = Motion(*motion.sample(), run=out.stem)
    modelling.write_motion(sampled, described, out)
    if page is not None:
        from irtwin.planning.plan import nominal_twin
        from irtwin.report.motion import write_page

        facts = [("Condition number", f"{motion.condition_number:.1f}")]
        write_page(nominal_twin(described), sampled, out.stem, facts, page)
    say_unchecked(checks_itself)
    ended = {motion.bounded: "The search reached its limit of work. ", motion.interrupted: "Stopped. "}.get(True)
    if ended or not speech.quiet:
        click.echo(f"\n{ended}This is the best motion so far." if ended else "", err=True)
    click.echo(
        f"{out}: condition number {motion.condition_number:.1f}, "
        f"{motion.limit_margin:.1%} margin to the joint limits, "
        + ("no wall within reach" if motion.clearance == math.inf else f"{motion.clearance:.3f} m to the nearest wall")
    )


def _excitation_progress() -> Callable[[int, float, float], None]:
    """Return a progress line that is rewritten in a terminal, and said every few seconds in a log."""
    shown = [-5.0]

    def progress(iteration: int, condition: float, elapsed: float) -> None:
        if speech.quiet:
            return
        line = f"{elapsed:5.0f} s  step {iteration:4d}  condition number {condition:8.1f}"
        if sys.stderr.isatty():
            click.echo(f"\r{line}", err=True, nl=False)
        elif elapsed - shown[0] >= 5.0:
            shown[0] = elapsed
            click.echo(line, err=True)

    return progress
