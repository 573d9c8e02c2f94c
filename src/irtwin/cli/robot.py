"""The command group `irtwin robot`: what a robot's description says, in other forms."""

from __future__ import annotations

import csv
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
    from irtwin.robot.description import Robot

_LARGEST = 100_000_000  # bytes of a file of joint positions
_SHOWN = 16  # solutions: a pose within reach of a six-axis arm has no more, unless they are without end

_source = click.argument("source", type=PLACE)
_link = click.option("--link", metavar="NAME", help="Take this link, not the flange (the last link).")
_json = click.option("--json", "as_json", is_flag=True, help="Write JSON.")


@click.group()
def robot() -> None:
    """Take a robot's description alone: its kinematics, its equations, other forms, a motion that excites it.

    SOURCE is a URDF file, a data set's folder, or its dataset.toml. Lengths are in m, angles in rad, joint positions in
    rad (m where a joint slides). Poses are in the frame of the first link; roll, pitch and yaw turn about its x, y, z.
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


@robot.command(context_settings={"ignore_unknown_options": True})
@_source
@click.argument("q", nargs=-1, type=float)
@click.option("--file", type=PLACE, help="CSV file of joint positions: a column q_JOINT for each.")
@_link
@_json
def fk(source: Path, q: tuple[float, ...], file: Path | None, link: str | None, as_json: bool) -> None:
    """Print the flange's pose at joint positions Q.

    This is forward kinematics. SOURCE is a URDF file, a data set's folder, or its dataset.toml. Q is a number for each
    joint, base to flange, in rad (m where it slides). The poses of a file are printed as CSV.

    \b
    Example: irtwin robot fk my.urdf 0 -1.57 1.57 0 0 0
    """
    import numpy as np

    from irtwin.robot.kinematics import placements
    from irtwin.signals.log import read_robot

    described = read_robot(source)
    if (file is None) == (not q):
        raise InputError("give joint positions, or --file, not both" if q else "give joint positions, or --file")
    positions = np.array([_checked(described, q)]) if file is None else _read_positions(file, described)
    for joint, column in zip(described.joints, positions.T, strict=True):
        outside = (column < joint.lower) | (column > joint.upper)
        if outside.any():
            click.echo(
                f"irtwin: {printable(joint.name)} is at {column[outside][0]:g} {joint.unit}, "
                f"outside its limits {joint.lower:g} to {joint.upper:g}",
                err=True,
            )
    poses = placements(described, positions, link)
    documents = [_pose_document(pose) for pose in poses]
    if as_json:
        click.echo(json.dumps(documents[0] if file is None else documents, indent=1))
    elif file is None:
        click.echo("\n".join(_pose_lines(documents[0])))
    else:
        click.echo("x_m,y_m,z_m,roll_rad,pitch_rad,yaw_rad,qx,qy,qz,qw")
        for each in documents:
            click.echo(",".join(map(repr, [*each["position_m"], *each["rpy_rad"], *each["quaternion_xyzw"]])))


def _checked(described: Robot, values: tuple[float, ...] | list[float]) -> list[float]:
    """Return joint positions, one for each joint. Raises InputError where there are others."""
    names = described.joint_names
    if len(values) != len(names):
        raise InputError(
            f"{described.name} has {len(names)} moving joints ({', '.join(names)}), "
            f"and {len(values)} position{'s' if len(values) != 1 else ''} were given"
        )
    for name, value in zip(names, values, strict=True):
        if not math.isfinite(value):
            raise InputError(f"{described.name}: the position of {name} is {value}; give a finite number")
    return list(values)


def _read_positions(file: Path, described: Robot) -> np.ndarray:
    """Return the (N, n) joint positions of a CSV file's columns q_JOINT."""
    import numpy as np

    from irtwin.input_file import read_text
    from irtwin.signals.channels import CHANNELS

    lines = csv.reader(read_text(file, _LARGEST).splitlines())
    head = [name.strip() for name in next(lines, [])]
    wanted = list(CHANNELS["q"].columns(described.joint_names))
    missing = [name for name in wanted if name not in head]
    if missing:
        raise InputError(f"{file}, line 1: there is no column {missing[0]}; give one for each joint of the robot")
    places = [head.index(name) for name in wanted]
    rows = []
    for number, line in enumerate(lines, start=2):
        try:
            rows.append([float(line[place]) for place in places])
        except (ValueError, IndexError) as error:
            raise InputError(f"{file}, line {number}: a joint position is no number; correct it") from error
        if not all(map(math.isfinite, rows[-1])):
            raise InputError(f"{file}, line {number}: a joint position is not finite; correct it")
    if not rows:
        raise InputError(f"{file}: has no joint positions below its first line")
    return np.array(rows)


def _pose_document(pose: np.ndarray) -> dict[str, Any]:
    import pinocchio as pin

    turn = pose[:3, :3]
    return {
        "position_m": pose[:3, 3].tolist(),
        "rpy_rad": pin.rpy.matrixToRpy(turn).tolist(),
        "quaternion_xyzw": pin.Quaternion(turn).coeffs().tolist(),
        "rotation": turn.tolist(),
    }


def _pose_lines(document: dict[str, Any]) -> Iterator[str]:
    def words(values: list[float]) -> str:
        return "  ".join(f"{_number(value):>13}" for value in values)

    yield f"x, y, z, m                {words(document['position_m'])}"
    yield f"roll, pitch, yaw, rad     {words(document['rpy_rad'])}"
    yield f"quaternion x, y, z, w     {words(document['quaternion_xyzw'])}"
    for number, row in enumerate(document["rotation"]):
        yield f"{'rotation matrix' if not number else '':25} {words(row)}"


@robot.command()
@_source
@click.option(
    "--pose", type=float, nargs=6, required=True, metavar="X Y Z R P Y", help="Position, m; roll, pitch, yaw, rad."
)
@click.option("--from", "start", metavar="Q,Q,...", help="Joint positions to stay near, rad (m). Default: zero.")
@_link
@_json
def ik(source: Path, pose: tuple[float, ...], start: str | None, link: str | None, as_json: bool) -> None:
    """Print joint positions that bring the flange to a pose.

    This is inverse kinematics. SOURCE is a URDF file, a data set's folder, or its dataset.toml. Lists all that a
    search within the joint limits finds, the nearest first; those that differ by whole turns of a joint count as one.
    Where the pose is out of reach, says by how much.

    \b
    Example: irtwin robot ik my.urdf --pose 0.4 0 0.6 0 1.57 0
    """
    import numpy as np
    import pinocchio as pin

    from irtwin.robot.inverse_kinematics import solve
    from irtwin.signals.log import read_robot

    described = read_robot(source)
    if not all(map(math.isfinite, pose)):
        raise InputError("--pose: give six finite numbers")
    place = pin.SE3(pin.rpy.rpyToMatrix(np.array(pose[3:])), np.array(pose[:3])).homogeneous
    near = None if start is None else np.array(_checked(described, _split(start)))
    solved = solve(described, place, start=near, link=link)
    if not len(solved.solutions):
        raise InputError(f"{described.name}: {_missed(solved.distance, solved.angle)}")
    if as_json:
        rows = [dict(zip(described.joint_names, row, strict=True)) for row in solved.solutions.tolist()]
        click.echo(json.dumps(rows, indent=1, ensure_ascii=False))
        return
    head = [f"{printable(joint.name)}, {joint.unit}" for joint in described.joints]
    body = [[_number(value) for value in row] for row in solved.solutions[:_SHOWN]]
    click.echo("\n".join(_columns([head, *body])))
    if solved.redundant or len(solved.solutions) > _SHOWN:
        click.echo(f"There are more without end; these are the {len(body)} nearest of {len(solved.solutions)} found.")


def _split(text: str) -> list[float]:
    try:
        return [float(word) for word in text.replace(",", " ").split()]
    except ValueError as error:
        raise InputError(f'--from: "{text[:60]}" should be numbers with commas between them') from error


def _missed(distance: float, angle: float) -> str:
    if math.isnan(angle):
        return f"the pose is out of reach: within its joint limits the flange comes no nearer than {distance:.4g} m"
    return (
        "the position can be reached, but not in this orientation: "
        f"the nearest found is {angle:.4g} rad ({math.degrees(angle):.3g} deg) away"
    )


@robot.command()
@_source
@click.option("--joint", metavar="NAME", help="Of this joint alone.")
@click.option("--latex", is_flag=True, help="Write LaTeX.")
def equations(source: Path, joint: str | None, latex: bool) -> None:
    """Print the torque of a small robot in symbols.

    SOURCE is a URDF file, a data set's folder, or its dataset.toml, of a robot of up to three joints. Prints each
    joint's torque by position (q), speed (dq) and acceleration (ddq), for rigid bodies of the masses in the
    description, without friction and rotors. Coefficients have six digits. Needs irtwin[symbolic].

    \b
    Example: irtwin robot equations my.urdf --latex
    """
    from irtwin.robot.equations import equations as derive
    from irtwin.signals.log import read_robot

    described = read_robot(source)
    if joint is not None and joint not in described.joint_names:
        raise InputError(f'{described.name} has no moving joint "{joint}" (it has {", ".join(described.joint_names)})')
    derived = derive(described)
    for place, each in enumerate(described.joints):
        if joint in (None, each.name):
            unit = "N" if each.unit == "m" else "N m"
            title = (
                f"{'%' if latex else '#'} tau{place + 1}: {printable(each.name)}, {unit}; q{place + 1} in {each.unit}"
            )
            click.echo(f"{title}\n{derived.latex(place) if latex else derived.text(place)}\n")
    click.echo(f"These equations and Pinocchio differ by {derived.deviation:.1e} N m (N) at most.", err=True)


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
    document = _pose_document(place)
    xyz, rpy = (", ".join(map(_number, document[key])) for key in ("position_m", "rpy_rad"))
    return f"x, y, z = {xyz} m; roll, pitch, yaw = {rpy} rad"
