"""The command group `irtwin robot`: what a robot's description says, in other forms."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from irtwin.cli.exciting_motion import excite
from irtwin.cli.options import FILE, FOLDER, PLACE, printable, say
from irtwin.errors import InputError

if TYPE_CHECKING:
    import numpy as np

    from irtwin.robot.denavit_hartenberg import ChainTable
    from irtwin.robot.description import Joint, Robot
    from irtwin.robot.equations import EquationsOfMotion
    from irtwin.robot.recursive_equations import RecursiveEquations

_source = click.argument("source", type=PLACE)
_link = click.option("--link", metavar="NAME", help="Take this link, not the flange (the last link).")
_json = click.option("--json", "as_json", is_flag=True, help="Write JSON.")


@click.group()
def robot() -> None:
    """Take a robot's description alone: its table of joints, its equations, other forms, a motion that excites it.

    SOURCE is a URDF file, a data set's folder, or its dataset.toml. Lengths are in m, angles in rad; roll, pitch and
    yaw turn about the x, y, z of the first link's frame.
    """


robot.add_command(excite)


@robot.command()
@_source
@click.option(
    "--convention",
    type=click.Choice(["standard", "modified"]),
    default="standard",
    show_default=True,
    help="Of Denavit and Hartenberg, or modified by Craig.",
)
@_link
@_json
def dh(source: Path, convention: str, link: str | None, as_json: bool) -> None:
    """Print the Denavit-Hartenberg table of a robot.

    SOURCE is a URDF file, a data set's folder, or its dataset.toml. The table is exact for any axes: what the rows
    cannot hold stands in the transforms before the first (base) and after the last (tool).

    \b
    Example: irtwin robot dh my.urdf
    """
    from irtwin.robot.chain_table import deviation, table_of
    from irtwin.robot.kinematics import flange
    from irtwin.signals.log import read_robot

    described = read_robot(source)
    table = table_of(described, convention, link)
    apart = deviation(described, table, link)
    end = link or flange(described)
    if as_json:
        click.echo(json.dumps(_table_document(described, table, end, apart), indent=1, ensure_ascii=False))
    else:
        click.echo("\n".join(_table_lines(described, table, end, apart)))


def _table_document(described: Robot, table: ChainTable, end: str, apart: tuple[float, float]) -> dict[str, Any]:
    rows = [
        {"joint": name, "type": row.kind, "a_m": row.a, "alpha_rad": row.alpha, "d_m": row.d, "theta_rad": row.theta}
        for name, row in zip(table.joint_names, table.rows, strict=True)
    ]
    return {
        "robot": described.name,
        "link": end,
        "convention": table.convention,
        "base": table.base.tolist(),
        "rows": rows,
        "tool": table.tool.tolist(),
        "differs_by_m": apart[0],
        "differs_by_rad": apart[1],
    }


def _table_lines(described: Robot, table: ChainTable, end: str, apart: tuple[float, float]) -> Iterator[str]:
    order = {"standard": "theta, d, a, alpha", "modified": "a, alpha, theta, d"}[table.convention]
    yield f"{printable(described.name)}, base to {printable(end)}: {table.convention} convention ({order})"
    head = ["joint", "a, m", "alpha, rad", "alpha, deg", "d, m", "theta, rad", "theta, deg"]
    body = []
    for name, row in zip(table.joint_names, table.rows, strict=True):
        slides = row.kind == "prismatic"
        numbers = [row.a, row.alpha, math.degrees(row.alpha), row.d, row.theta, math.degrees(row.theta)]
        cells = [_number(value) for value in numbers]
        place = 3 if slides else 4
        cells[place] = "q" if cells[place] == "0" else f"{cells[place]} + q"
        body.append([printable(name), *cells])
    yield from _columns([head, *body])
    yield f"base: {_place_words(table.base)}"
    yield f"tool: {_place_words(table.tool)}"
    yield f"The table and the robot differ by {apart[0]:.1e} m and {apart[1]:.1e} rad at most."


@robot.command()
@_source
@click.option("--out", type=FILE, required=True, help="URDF file to write.")
def urdf(source: Path, out: Path) -> None:
    """Write a robot's description as URDF.

    SOURCE is a data set's folder or its dataset.toml. Its Denavit-Hartenberg table becomes a URDF; where it has a URDF,
    that is written.

    \b
    Example: irtwin robot urdf my_robot --out my.urdf
    """
    from irtwin.signals.log import read_robot
    from irtwin.storage.files import check_place, write

    described = read_robot(source)
    check_place(out)
    write(out, described.urdf.encode())
    click.echo(out)


@robot.command()
@_source
@click.option("--out", type=FOLDER, required=True, help="Folder to write.")
def ros(source: Path, out: Path) -> None:
    """Write a robot as a ROS package.

    SOURCE is a URDF file, a data set's folder, or its dataset.toml. The package is that of `irtwin export --ros`.

    \b
    Example: irtwin robot ros my.urdf --out my_package
    """
    from irtwin.ros.ros_package import write_package
    from irtwin.signals.log import read_robot

    for line in write_package(read_robot(source), out):
        say(f"irtwin: {line}")
    click.echo(out)


@robot.command()
@_source
@click.option("--joint", metavar="NAME", help="Of this joint alone.")
@click.option("--latex", is_flag=True, help="Write LaTeX.")
def equations(source: Path, joint: str | None, latex: bool) -> None:
    """Print the torque of a robot in symbols.

    SOURCE is a URDF file, a data set's folder, or its dataset.toml. Prints each joint's torque by position (q), speed
    (dq) and acceleration (ddq), for rigid bodies of the masses in the description, without friction and rotors. Of more
    than three joints the results of Newton and Euler's recursion are named, each a short formula (v1, v2, ...).
    Coefficients have six digits. Needs irtwin[symbolic].

    \b
    Example: irtwin robot equations my.urdf --latex
    """
    from irtwin.robot.equations import MOST_JOINTS
    from irtwin.robot.equations import equations as derive
    from irtwin.robot.recursive_equations import recursive_equations
    from irtwin.signals.log import read_robot

    described = read_robot(source)
    if joint is not None and joint not in described.joint_names:
        raise InputError(f'{described.name} has no moving joint "{joint}" (it has {", ".join(described.joint_names)})')
    asked = [place for place, axis in enumerate(described.joints) if joint in (None, axis.name)]
    titles = [_title(place + 1, described.joints[place], "%" if latex else "#") for place in asked]
    derived: EquationsOfMotion | RecursiveEquations
    if len(described.joints) > MOST_JOINTS:
        derived = recursive_equations(described)
        shown = derived if joint is None else derived.alone(asked[0])
        click.echo("\n".join([*titles, shown.latex() if latex else shown.text()]))
    else:
        derived = derive(described)
        for place, title in zip(asked, titles, strict=True):
            click.echo(f"{title}\n{derived.latex(place) if latex else derived.text(place)}\n")
    click.echo(f"These equations and Pinocchio differ by {derived.deviation:.1e} N m (N) at most.", err=True)


def _title(number: int, joint: Joint, mark: str) -> str:
    """Say which joint's torque is meant, and in which units, as a comment."""
    unit = "N" if joint.unit == "m" else "N m"
    return f"{mark} tau{number}: {printable(joint.name)}, {unit}; q{number} in {joint.unit}"


def _columns(rows: list[list[str]]) -> Iterator[str]:
    """Return rows of cells as lines, the first column to the left and the others to the right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        cells = (cell.ljust(w) if not k else cell.rjust(w) for k, (cell, w) in enumerate(zip(row, widths, strict=True)))
        yield "  ".join(cells).rstrip()


def _number(value: float) -> str:
    """Return a number in nine digits, what rounding left of zero as 0."""
    return f"{0.0 if abs(value) < 5e-13 else value:.9g}"


def _place_words(place: np.ndarray) -> str:
    import pinocchio as pin

    xyz, rpy = (", ".join(map(_number, part)) for part in (place[:3, 3], pin.rpy.matrixToRpy(place[:3, :3])))
    return f"x, y, z = {xyz} m; roll, pitch, yaw = {rpy} rad"
