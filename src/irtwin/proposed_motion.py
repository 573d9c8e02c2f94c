"""The motion that a next experiment plays: written as CSV, and in words how it is played."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from irtwin.document.experiment import Experiment, Programme
from irtwin.effects.catalogue import catalogue
from irtwin.errors import InputError
from irtwin.gap.diagnosis import Diagnosis
from irtwin.planning.admission import check_motion
from irtwin.planning.plan import nominal_twin
from irtwin.robot.collision import CollisionModel
from irtwin.robot.description import Robot
from irtwin.signals.channels import Signals, csv_text
from irtwin.signals.motion import Motion
from irtwin.storage.files import write


def save_motion(diagnosis: Diagnosis, out: Path) -> str:
    """Write the motion of a diagnosis' next experiment as CSV; say what to do with it, or why there is none.

    Raises InputError where the file cannot be written.
    """
    proposed, motion = diagnosis.experiment, diagnosis.planned
    if proposed is None or proposed.programme is None or motion is None:
        return f"{out} was not written: {by_hand(proposed)}"
    twin = diagnosis.twin or nominal_twin(diagnosis.description)
    collisions = CollisionModel(twin.robot)
    try:
        for mass in sorted(set(proposed.programme.payload_mass)):
            com = proposed.programme.payload_com or (0.0, 0.0, 0.0)
            check_motion(twin, replace(motion, payload_mass=mass, payload_com=com), collisions, out)
    except InputError as error:
        return f"The motion of the next experiment was not written, as the robot cannot make it: {error}"
    write(out, _csv(motion, twin.robot).encode())
    return " ".join(how_to_play(proposed.programme, out, collisions.checks_itself))


def motion_text(diagnosis: Diagnosis) -> str | None:
    """Return the motion of a diagnosis' next experiment as CSV, None where there is none."""
    return None if diagnosis.planned is None else _csv(diagnosis.planned, diagnosis.description)


def _csv(motion: Motion, robot: Robot) -> str:
    return csv_text(Signals(motion.time - motion.time[0], motion.q, dq=motion.dq, ddq=motion.ddq), robot.joint_names)


def by_hand(proposed: Experiment | None) -> str:
    """Say why an experiment plays no motion."""
    if proposed is None:
        return "the diagnosis proposes no experiment"
    tests = "; ".join(proposed.motions)
    return f"it is done by hand ({tests})" if tests else f"no motion helps ({proposed.note or proposed.purpose})"


def how_to_play(programme: Programme, motion: Path, checks_itself: bool) -> list[str]:
    """Say how a programme's motion is played, run by run."""
    seconds = programme.seconds / len(programme.payload_mass)
    off = [catalogue()[name].taken_off for name in programme.taken_off]
    runs = [_of_run(programme, number) for number in range(len(programme.payload_mass))]
    words = [play(motion, f"{seconds:.3g}", checks_itself)]
    if off:
        words.append(f"Play it {', '.join(filter(None, off))}.")
    if any(runs):
        words.append(f"Play it {len(runs)} times, each a log of its own: {'; '.join(runs)}.")
    return words


def _of_run(programme: Programme, number: int) -> str:
    """Say what is different in one of a programme's runs; nothing where nothing is."""
    commands = []
    if any(programme.payload_mass):
        mass, com = programme.payload_mass[number], programme.payload_com or (0.0, 0.0, 0.0)
        at = " ".join(f"{value:g}" for value in com)
        load = f"with {mass:g} kg at the flange, as the controller is told (--payload-mass {mass:g} --payload-com {at})"
        commands.append(load if mass else "without load")
    if programme.temperatures:
        state = "cold" if number == 0 else f"warm, after {programme.set_up_seconds / 60:g} minutes of work"
        commands.append(f"{state}, joints at some {programme.temperatures[number]:g} degC, their temperatures logged")
    return ", ".join(commands)


def play(motion: Path, seconds: str, checks_itself: bool) -> str:
    """Say how a motion is played; `checks_itself`: whether the robot was held to keep off itself."""
    itself = "" if checks_itself else "; whether it meets itself was not checked"
    return (
        f"Play {motion} on the robot, {seconds} s from rest to rest within its limits. Check the way first: "
        f"nothing is known of what stands about it{itself}."
    )
