"""Commands killed at random moments: `python bench/kills.py [KILLS] [COMMAND ...]`; 30 kills of each by default.

`migrate` has no place here: there is no such command. A workspace is migrated when it is opened, and
`tests/storage/test_migration.py` kills that. After each kill a query must answer as before or as after, or say that the
graph is behind; the graph, once it has caught up, must be what its database makes of it; and the command done again
must lead to the state of a workspace where nothing was killed: the same answers, as many triples, every file that the
database names and no other.
"""

from __future__ import annotations

import json
import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

from pyoxigraph import CanonicalizationAlgorithm, Dataset, Quad

sys.path.insert(0, str(Path(__file__).parents[1]))
from tests import data_sets, small_robots, synthetic

from irtwin import asking, rewriting, workflow
from irtwin.knowledge.mapping import refresh
from irtwin.knowledge.questions.queries import to_csv
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_CHANGED, GRAPH_SOURCE
from irtwin.location import Location
from irtwin.providers.records import ingest
from irtwin.signals.log import read_data_set
from irtwin.storage.database import Workspace
from irtwin.storage.rows import named_files
from irtwin.storage.series import is_whole

ROBOTS = 20  # that are watched at once
QUESTION = "energy_per_run"
State = dict[str, object]


@dataclass(frozen=True)
class Command:
    """A command on a workspace, which is a copy of `base`, with what it is fed on standard input."""

    arguments: Callable[[Path], list[object]]
    base: Path
    fed: bytes = b""
    # what a killed one may rightly leave more of: journals that became runs, and their energies
    grows: tuple[str, ...] = field(default=())
    workspaces: Callable[[Path], list[Path]] = lambda place: [place]  # that it makes, or works on


def main(kills: int, names: list[str], seed: int = 1) -> int:
    moments, failures = random.Random(seed), 0
    with tempfile.TemporaryDirectory() as name:
        commands = prepared(Path(name))
        for kind in names or list(commands):
            failures += killed_often(kind, commands[kind], kills, moments, Path(name) / "tried")
    return failures


def prepared(folder: Path) -> dict[str, Command]:
    """Make a workspace of one robot, and what each command needs beside it."""
    base = folder / "base"
    first = small_robots.data_set(folder / "first", "First")
    second = small_robots.data_set(folder / "second", "Second", seed=5)
    robot = replace(synthetic.with_constants(synthetic.arm(3)), name="Third")
    motions = [synthetic.swing(robot, seed, seconds=8.0) for seed in (1, 2, 3)]
    runs = [synthetic.as_run(synthetic.measure(robot, motion, noise=0.01)) for motion in motions]
    third = data_sets.write(folder / "third", robot, runs)
    assert data_sets.irtwin("run", first, "--workspace", base).status == 0
    assert data_sets.irtwin("workspace", "backup", folder / "kept.zip", "--workspace", base).status == 0
    (folder / "none").mkdir()
    watched(first, folder / "watched")
    (folder / "fleet").mkdir()
    for data_set in (first, second):
        shutil.copytree(data_set, folder / "fleet" / data_set.name)
    lines = (
        {"robot": "First", "time": 1.7e9 + 0.01 * k, "position": [0.1, 0.2 + 1e-4 * k], "effort": [1.0, 2.0]}
        for k in range(20_000)
    )
    fed = b"".join(json.dumps(line).encode() + b"\n" for line in lines)
    of_many = (
        {"robot": f"R{number}", "time": 1.7e9 + 0.01 * k, "position": [0.1, 0.2 + 1e-4 * k], "effort": [1.0, 2.0]}
        for k in range(2_000)
        for number in range(ROBOTS)
    )
    fed_of_many = b"".join(json.dumps(line).encode() + b"\n" for line in of_many)
    grows = ("triples", "runs", "answers")
    return {
        "run": Command(lambda place: ["run", second, "--workspace", place], base),
        "live": Command(lambda place: ["live", "--workspace", place], base, fed, grows),
        "live of 20": Command(lambda place: ["live", "--workspace", place], folder / "watched", fed_of_many, grows),
        "diagnose": Command(lambda place: ["diagnose", third, "--json", folder / "d.json", "--workspace", place], base),
        "restore": Command(
            lambda place: ["workspace", "restore", folder / "kept.zip", "--workspace", place], folder / "none"
        ),
        "repair": Command(lambda place: ["workspace", "repair", "--workspace", place], base),
        "fleet": Command(
            lambda place: ["run", folder / "fleet", "--out", place, "--batch", 1, "--workers", 1],
            folder / "none",
            workspaces=lambda place: sorted(batch / "workspace" for batch in place.glob("[!.]*") if batch.is_dir()),
        ),
    }


def watched(data_set: Path, place: Path) -> None:
    """Make a workspace of many robots that have no twin."""
    known = read_data_set(data_set)
    with Workspace(place) as workspace, rewriting.rewriting(workspace) as graph:
        for number in range(ROBOTS):
            ingest(workspace, replace(known, robot=replace(known.robot, name=f"R{number}")))
        graph.load_ontology()
        rewriting.map_rows(workspace, graph)
        rewriting.conclude(graph, lambda line: None)


def killed_often(kind: str, command: Command, kills: int, moments: random.Random, place: Path) -> int:
    copied(command.base, place)
    began = time.perf_counter()
    done = call(command.arguments(place), command.fed)
    assert done.returncode == 0, done.stderr.decode()
    length, clean = time.perf_counter() - began, states(command, place)
    before = None if command.base.name == "none" else state_of_base(command.base)
    said: list[str] = []
    killed = 0
    for _ in range(kills):
        copied(command.base, place)
        moment = moments.uniform(0.0, 1.1 * length)
        killed += kill(command, place, moment)
        said += [f"{kind} killed after {moment:.2f} s: {fault}" for fault in faults(command, place, before, clean)]
    print(
        f"{kind}: {killed} of {kills} killed within {length:.1f} s, {len(said)} faults", *said, sep="\n  ", flush=True
    )
    return len(said)


def faults(command: Command, place: Path, before: State | None, clean: list[State]) -> list[str]:
    found = []
    for workspace, of in zip(command.workspaces(place), clean, strict=False):
        if (workspace / "graph/CURRENT").exists():
            found += faults_of_answer(command, workspace, [before, of])
    if command.base.name != "none" or command.workspaces(place) != [place] or not any(place.glob("*")):
        done = call(command.arguments(place), command.fed)
        if done.returncode != 0:
            return [*found, f"not done again: {done.stderr.decode()[-300:]}"]
    for after, of in zip(states(command, place), clean, strict=True):
        different = [key for key in of if after[key] != of[key] and key not in command.grows]
        found += [f"{key} is {str(after[key])[:100]}, not {str(of[key])[:100]}" for key in different]
    return found


def faults_of_answer(command: Command, workspace: Path, states: list[State | None]) -> list[str]:
    """Ask a workspace that a kill left, then let its graph catch up, and hold it against its database."""
    asked = call(["query", QUESTION, "--workspace", workspace, "--format", "csv"])
    if asked.returncode != 0:
        return [f"no answer: {asked.stderr.decode()[-300:]}"]
    if command.grows:
        return []
    found = []
    is_behind = b"behind the database" in asked.stderr
    if not is_behind and None not in states and asked.stdout not in [of["answers"] for of in states if of]:
        found.append("another answer, and not a word of it")
    if is_behind:
        workflow.catch_up(Location(workspace))
        if (differ := len(quads(workspace) ^ made_anew(workspace))) > 0:
            found.append(f"{differ} quads differ from what the database makes")
    return found


def quads(workspace: Path) -> set[Quad]:
    with Workspace.existing(workspace) as place, KnowledgeGraph.of_workspace(place) as graph:
        return compared(graph)


def made_anew(workspace: Path) -> set[Quad]:
    with (
        tempfile.TemporaryDirectory() as folder,
        Workspace.existing(workspace) as place,
        KnowledgeGraph(None, workspace, place.resources, place.base) as graph,
    ):
        graph.load_ontology()
        refresh(graph, place.engine, graph.resources.paths("mappings"), Path(folder) / "rows.db")
        rewriting.conclude(graph, lambda line: None)
        return compared(graph)


def compared(graph: KnowledgeGraph) -> set[Quad]:
    """Return what a graph says, but for notes, names that are drawn, and how blank nodes are called."""
    apart = (GRAPH_CHANGED, f"{GRAPH_SOURCE}version")
    found = Dataset(quad for quad in graph.quads() if str(quad.graph_name)[1:-1] not in apart)
    found.canonicalize(CanonicalizationAlgorithm.UNSTABLE)
    return set(found)


def states(command: Command, place: Path) -> list[State]:
    return [state(workspace) for workspace in command.workspaces(place)]


@cache
def state_of_base(base: Path) -> State:
    """Return the state that the commands on a base begin with, read from a copy."""
    with tempfile.TemporaryDirectory() as folder:
        copied(base, Path(folder) / "copy")
        return state(Path(folder) / "copy")


def state(place: Path) -> State:
    answers = to_csv(asking.ask(QUESTION, place)).encode()
    with Workspace.existing(place) as workspace, workspace.reading() as session:
        named = named_files(session.connection())
        lost = [file.path for file in named if not is_whole(place, file.path, file.sha256)]
        with KnowledgeGraph.of_workspace(workspace) as graph:
            # What is still to be reasoned over or validated is a note of the store, and goes with the next run.
            triples = len(graph.triples(*(name for name in graph.graphs() if name != GRAPH_CHANGED)))
    paths = {file.path for file in named}
    files = {f"{folder}/{file.name}" for folder in ("series", "twins", "diagnoses") for file in glob(place / folder)}
    hidden = [path.name for path in place.glob(".*")]
    return {
        "answers": answers, "triples": triples, "lost": lost, "orphans": sorted(files - paths), "hidden": hidden,
        "runs": len(paths), "beside": [path.name for path in place.parent.glob(".irtwin-*")],
    }  # fmt: skip


def glob(folder: Path) -> list[Path]:
    return list(folder.glob("*")) if folder.is_dir() else []


def kill(command: Command, place: Path, moment: float) -> bool:
    with tempfile.TemporaryFile() as fed:
        fed.write(command.fed)
        fed.seek(0)
        with subprocess.Popen(
            started(command.arguments(place)), stdin=fed, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        ) as process:
            try:
                process.wait(moment)
            except subprocess.TimeoutExpired:
                process.kill()
                return True
    return False


def copied(base: Path, place: Path) -> None:
    shutil.rmtree(place, ignore_errors=True)
    shutil.copytree(base, place)


def call(arguments: list[object], fed: bytes = b"") -> subprocess.CompletedProcess[bytes]:
    return subprocess.run(started(arguments), input=fed, capture_output=True, check=False)


def started(arguments: list[object]) -> list[str]:
    return [sys.executable, "-m", "irtwin", *map(str, arguments)]


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 30, sys.argv[2:]) and 1)
