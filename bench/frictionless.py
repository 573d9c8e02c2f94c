"""Measured robots beside a simulator without friction: `python frictionless.py DATASET...` prints a table (Markdown).

Each is held against its published URDF, and against the bodies and rotors of its own twin, both without friction.
Friction of every joint is to be named first.
"""

from __future__ import annotations

import re
import sys
import tempfile
from pathlib import Path

from irtwin.diagnosing import diagnose
from irtwin.document.document import Document
from irtwin.errors import InputError
from irtwin.modelling import identify
from irtwin.robot.description import Robot
from irtwin.signals.log import read_data_set
from irtwin.twin.described import text_of

BASELINE = ("rigid_body", "rotor_inertia", "coulomb_friction", "viscous_friction", "torque_offset")
DRY = "coulomb_friction"


def frictionless(data_set: Path, folder: Path) -> dict[str, Path]:
    """Write the models of a robot without friction; return their files by what they are."""
    models = {"its URDF": (folder / "urdf.urdf", read_data_set(data_set).robot.urdf)}
    models["its own bodies"] = folder / "mjcf.xml", text_of(identify(data_set, BASELINE), "mjcf")
    for file, text in models.values():
        file.write_text(re.sub(r"<dynamics[^>]*/>| (damping|frictionloss)=\"[^\"]*\"", "", text), encoding="utf-8")
    return {name: file for name, (file, _) in models.items()}


def row(name: str, simulator: str, robot: Robot, document: Document) -> str:
    """Say which cause is first, on how many joints dry friction is told, and how much of the gap closes."""
    first = next((finding for finding in document.findings if finding.matters), None)
    dry = {joint for cause in document.causes if cause.effect == DRY for joint in cause.joints}
    others = {cause.effect: cause.confidence for cause in document.mattering if cause.effect != DRY}
    sure = max((cause.confidence for cause in document.causes if cause.effect == DRY), default=0.0)
    closed = document.shrink.closed_fraction
    cells = [
        name,
        simulator,
        document.verdict,
        first.family if first else "-",
        f"{len(dry)} of {len(robot.joints)}, {sure:.2f}",
        ", ".join(f"{effect} {confidence:.2f}" for effect, confidence in others.items()) or "-",
        "-" if closed is None else f"{100 * closed.value:.0f} %",
    ]
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Diagnose each data set beside its models."""
    print("| robot | simulator | verdict | first | dry friction of joints, sure | beside | closes |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for data_set in map(Path, sys.argv[1:]):
        robot = read_data_set(data_set).robot
        with tempfile.TemporaryDirectory() as folder:
            for name, model in frictionless(data_set, Path(folder)).items():
                try:
                    print(row(data_set.name, name, robot, diagnose(data_set, simulator=model).document), flush=True)
                except InputError as error:
                    print(f"| {data_set.name} | {name} | refused: {error} |||||", flush=True)


if __name__ == "__main__":
    main()
