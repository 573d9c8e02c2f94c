"""What to log next where a twin misses the energy of a run by more than the limit: a motion to play, and in words."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from sqlalchemy import select

from irtwin.document import form
from irtwin.document.experiment import Experiment
from irtwin.errors import InputError
from irtwin.identification.excitation import excite
from irtwin.json_text import parse_json
from irtwin.knowledge.questions.queries import ask
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.modelling import expect, write_motion
from irtwin.proposed_motion import by_hand, how_to_play, play
from irtwin.providers.records import load_robot, load_twin
from irtwin.robot.collision import CollisionModel
from irtwin.robot.description import Robot
from irtwin.signals.motion import Motion
from irtwin.storage.database import Workspace
from irtwin.storage.files import InsidePath, remove, write
from irtwin.storage.gap_schema import GapDiagnosis

_FOLDER = "next_experiment"
_SECONDS = 20.0
_ITERATIONS = 5  # a motion that moves everything; `irtwin robot excite` refines one


@dataclass(frozen=True)
class _Proposed:
    """What is read of a stored diagnosis: what made it may have judged causes by another criterion."""

    next_experiment: Experiment | None


@dataclass(frozen=True)
class NextExperiment:
    """What to log next, in words, and the files that hold it: `motion` is None where none could be designed."""

    words: tuple[str, ...]
    text: Path
    motion: Path | None


def next_experiment(place: Workspace, graph: KnowledgeGraph, robot_id: str) -> NextExperiment | None:
    """Write what to log next of a robot that the rules say is to be identified again; None of any other.

    Where its diagnosis proposed an experiment, the words are its, and the motion is that of its programme; none where
    that is done by hand. Else the motion excites every base parameter within the robot's limits.
    """
    robot = load_robot(place, robot_id)
    missed = [row for row in ask(graph, "to_reidentify") if row["robot"] == robot.name]
    text, motion = proposal_files(place, robot_id)
    if not missed:
        remove(text)
        remove(motion)
        return None
    words = [
        f"The twin misses the energy of {row['run']} by {row['error_percent']:.3g} %, beyond the limit of "
        f"{row['limit_percent']:g} %."
        for row in missed
    ]
    words += [
        f"Its diagnosis proposes: {row['experiment']}."
        for row in ask(graph, "next_experiment")
        if row["robot"] == robot.name and row["experiment"]
    ]
    text.parent.mkdir(exist_ok=True)
    words += _designed(place, robot_id, motion) or _exciting(robot, motion)
    power = "" if load_twin(place, robot_id)[1].knows_power else "; without power nothing can be judged"
    words.append(f"Log positions, torque or motor currents, and power{power}.")
    words.append(f'Then: irtwin improve "{robot.name}" LOG --workspace {place.folder}')
    write(text, "".join(f"{line}\n" for line in words).encode())
    return NextExperiment(tuple(words), text, motion if motion.exists() else None)


def proposal_files(place: Workspace, robot_id: str) -> tuple[InsidePath, InsidePath]:
    """Return where the words of what to log next of a robot lie, and the motion to play."""
    return place.file(f"{_FOLDER}/{robot_id}.txt"), place.file(f"{_FOLDER}/{robot_id}.csv")


def _designed(place: Workspace, robot_id: str, out: InsidePath) -> list[str]:
    """Write the motion of the diagnosis' programme; return how to play it. Nothing where no diagnosis designed any."""
    row = place.first(select(GapDiagnosis).where(GapDiagnosis.robot_id == robot_id))
    if row is None:
        return []
    document = parse_json(place.read_document(row.file, row.sha256))
    proposed = form.from_json(_Proposed, document, "diagnosis").next_experiment
    if proposed is None:
        return []
    if proposed.programme is None or row.motion_file is None or row.motion_sha256 is None:
        remove(out)
        return [f"No motion is written: {by_hand(proposed)}."]
    twin = load_twin(place, robot_id)[1]
    write(out, place.read_document(row.motion_file, row.motion_sha256))
    try:
        for mass in sorted(set(proposed.programme.payload_mass)):
            com = proposed.programme.payload_com or (0.0, 0.0, 0.0)
            checked = expect(twin, out, payload_mass=mass, payload_com=com)
    except InputError as error:
        return [f"The robot cannot make the motion of that ({error}).", *_exciting(twin.robot, out)]
    return how_to_play(proposed.programme, out, checked.checks_itself)


def _exciting(robot: Robot, motion: InsidePath) -> list[str]:
    """Write a motion that excites every base parameter; return how to play it, or what to do where there is none."""
    try:
        found = excite(robot, _SECONDS, iterations=_ITERATIONS)
        write_motion(Motion(*found.sample(), run=motion.stem), robot, motion)
    except InputError as error:
        remove(motion)
        return [f"No motion could be designed ({error}). Move all joints, slowly and fast, over their whole range."]
    return [play(motion, f"{_SECONDS:g}", CollisionModel(robot).checks_itself)]
