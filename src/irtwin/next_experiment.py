"""What to log next where a twin misses the energy of a run by more than the limit: a motion to play, and in words."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from irtwin.errors import InputError
from irtwin.identification.excitation import excite
from irtwin.knowledge.questions.queries import ask
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.providers.records import load_robot, load_twin
from irtwin.robot.collision import CollisionModel
from irtwin.storage.database import Workspace
from irtwin.storage.files import write

FOLDER = "next_experiment"
_SECONDS = 20.0
_ITERATIONS = 5  # a motion that moves everything; `irtwin excite` refines one


@dataclass(frozen=True)
class NextExperiment:
    """What to log next, in words, and the files that hold it: `motion` is None where none could be designed."""

    words: tuple[str, ...]
    text: Path
    motion: Path | None


def next_experiment(place: Workspace, graph: KnowledgeGraph, robot_id: str) -> NextExperiment | None:
    """Write what to log next of a robot that the rules say is to be identified again; None of any other.

    The words are those of its diagnosis where one proposed an experiment. The motion excites every base parameter
    within the robot's limits.
    """
    robot = load_robot(place, robot_id)
    missed = [row for row in ask(graph, "to_reidentify") if row["robot"] == robot.name]
    folder = place.folder / FOLDER
    text, motion = folder / f"{robot_id}.txt", folder / f"{robot_id}.csv"
    if not missed:
        text.unlink(missing_ok=True)
        motion.unlink(missing_ok=True)
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
    folder.mkdir(exist_ok=True)
    try:
        excite(robot, _SECONDS, iterations=_ITERATIONS).write_csv(motion)
    except InputError as error:
        motion.unlink(missing_ok=True)
        words.append(
            f"No motion could be designed ({error}). Move all joints, slowly and fast, over their whole range."
        )
    else:
        itself = "" if CollisionModel(robot).checks_itself else "; whether it meets itself was not checked"
        words.append(
            f"Play {motion} on the robot, {_SECONDS:g} s from rest to rest within its limits. Check the way first: "
            f"nothing is known of what stands about it{itself}."
        )
    power = "" if load_twin(place, robot_id)[1].knows_power else "; without power nothing can be judged"
    words.append(f"Log positions, torque or motor currents, and power{power}.")
    words.append(f'Then: irtwin improve "{robot.name}" LOG --workspace {place.folder}')
    write(text, "".join(f"{line}\n" for line in words).encode())
    return NextExperiment(tuple(words), text, motion if motion.exists() else None)
