"""The graph beside its peers: load, twelve questions, live updates and the OWL 2 RL closure, in one run.

python bench/graph.py FOLDER [ROBOTS] [RUNS]      JENA_JARS names a folder with Jena's jars; writes GRAPH.md

Each store works alone in a process of its own, on the same triples. Each answer is held against ours, row by row.
"""

from __future__ import annotations

import json
import os
import re
import resource
import signal
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from pyoxigraph import DefaultGraph, RdfFormat, Store, serialize

import fleet
from graph_engines import ENGINES, Engine
from irtwin.knowledge.questions.queries import named_questions
from irtwin.knowledge.vocabulary import ID, IRT, OWL, RDFS

QUESTIONS = [
    "robots", "joints", "current_state", "energy_per_robot", "energy_per_effect", "fleet_ranking", "ledger_of_last_run",
    "worst_run", "to_reidentify", "where_is_the_gap", "common_causes", "provenance",
]  # fmt: skip
PATIENCE = 60  # s for one answer
UPDATES = 200
LIVE = re.compile(rf"<{re.escape(ID)}joint_state/R000\.cycle_0001/.*<{re.escape(IRT)}Joint_(Position|Speed|Torque)> .*")
OTHER = rf"<(?!{re.escape(OWL)}|{re.escape(RDFS)})[^>]*>"
OF_INDIVIDUALS = re.compile(rf"(?!(<.*>) \S+ \1$)<{re.escape(ID)}[^>]*> {OTHER} {OTHER}$")
NUMBER = re.compile(r'"[^"]*"\^\^')
Result = dict[str, Any]


def prepare(folder: Path, robots: int, runs: int) -> Path:
    """Write a fleet's graph as N-Triples, inferences included; return the file."""
    file = folder / f"{robots}x{runs}.nt"
    if not file.exists():
        place = folder / f"{robots}x{runs}"
        place.mkdir(parents=True)
        fleet.make_database(place, robots, runs)
        fleet.make_graph(place)
        stored = Store.read_only(str(place / "graph")).quads_for_pattern(None, None, None, DefaultGraph())
        triples = (
            quad.triple for quad in stored if quad.predicate.value != f"{OWL}imports"
        )  # nothing is to be fetched
        serialize(triples, str(file), RdfFormat.N_TRIPLES)
    return file


def measure(name: str, folder: Path, file: Path, small: Path) -> Result:
    """Let one store do all of it; seconds, MB, and the answers."""
    loads: list[float] = []
    while len(loads) < 3 and sum(loads) < 15:
        place = folder / f"{re.sub(r'[^A-Za-z0-9]+', '_', name)}_{len(loads)}"
        place.mkdir()
        engine = ENGINES[name](place)
        loads.append(_seconds(lambda engine=engine: engine.load(file)))
    result: Result = {"load": {"best": min(loads)}, "questions": {}}
    for question in QUESTIONS:
        result["questions"][question] = _answer(engine, named_questions()[question].text)
    result["update"] = _attempt(lambda: _updates(engine, file))
    result["closure"] = _attempt(lambda: _closure(engine, small))
    result["memory_mb"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return result


def _answer(engine: Engine, text: str) -> Result:
    """The first time and the best of those that follow within 3 s, and the rows."""

    def measured() -> Result:
        answers: list[Any] = []
        times = [_seconds(lambda: answers.append(engine.ask(text)))]
        began = time.perf_counter()
        while len(times) < 4 or (time.perf_counter() - began < 3 and len(times) < 50):
            times.append(_seconds(lambda: engine.ask(text)))
        rows = sorted(tuple(_plain(term) for term in row) for row in engine.rows(answers[0]))
        return {"first": times[0], "best": min(times), "rows": rows}

    return _attempt(measured)


def _updates(engine: Engine, file: Path) -> Result:
    """A robot's joints in new states, one after the other: 18 triples go, 18 come, and a query sees them."""
    now = [line for line in file.read_text().splitlines() if LIVE.match(line)]
    ask = f"SELECT ?v {{ <{ID}joint_state/R000.cycle_0001/joint_a1> <{IRT}Joint_Position> ?v }}"
    times = []
    for number in range(UPDATES):
        value = f"{(number + 1) / 64}"
        new = [NUMBER.sub(f'"{value}"^^', line) for line in now]
        removed, added = "\n".join(now), "\n".join(new)
        times.append(_seconds(lambda removed=removed, added=added: engine.change(removed, added)))
        rows = engine.rows(engine.ask(ask))
        if [float(_plain(row[0]) or "nan") for row in rows] != [float(value)]:
            raise ValueError(f"after an update to {value} the store answers {rows}")
        now = new
    return {"best": min(times), "median": statistics.median(times), "triples": 2 * len(now)}


def _closure(engine: Engine, file: Path) -> Result:
    """What is entailed of individuals, but for literals in other forms and what holds of everything."""
    times, entailed = [], set()
    for _ in range(2):
        times.append(_seconds(lambda: entailed.update(engine.close(file))))
    facts = {line.removesuffix(" .") for line in file.read_text().splitlines()}
    triples = sorted(line for line in entailed - facts if OF_INDIVIDUALS.match(line))
    return {"best": min(times), "triples": triples}


def _attempt(call: Callable[[], Result]) -> Result:
    """What a store cannot do is part of the result."""
    try:
        with _limited(PATIENCE):
            return call()
    except TimeoutError:
        return {"failed": f"over {PATIENCE} s"}
    except Exception as error:
        return {"failed": f"{type(error).__name__}: {error}".splitlines()[0][:100]}


@contextmanager
def _limited(seconds: int) -> Iterator[None]:
    def stop(*_: object) -> None:
        raise TimeoutError

    signal.signal(signal.SIGALRM, stop)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)


def _seconds(call: Callable[[], Any]) -> float:
    began = time.perf_counter()
    call()
    return time.perf_counter() - began


def _plain(term: str | None) -> str:
    """A term as stores that do not tell datatypes apart can give it: numbers to nine digits, no tags."""
    if not term:
        return ""
    text = re.sub(r'^"(.*)"(@[\w-]+|\^\^\S+)?$', r"\1", term.strip("<>"), flags=re.DOTALL)
    with suppress(ValueError):
        return f"{float(text):.9g}"
    return re.sub(r"^(\d{4}-\d\d-\d\d)[ T]([\d:.]*?)0*(Z|\+00:00)$", r"\1T\2Z", text)


def report(results: dict[str, Result], title: str) -> str:
    """The table, a column for each store; ours are told equal or not to each peer's answers."""
    ours = results["irtwin"]
    lines = [title, "", "| | " + " | ".join(results) + " |", "| --- |" + " ---: |" * len(results)]

    def line(name: str, cell: Callable[[Result], str]) -> None:
        lines.append(f"| {name} | " + " | ".join(cell(result) for result in results.values()) + " |")

    def timed(found: Result, same: Callable[[Result], str]) -> str:
        return found["failed"] if "failed" in found else f"{_shown(found['best'])}{same(found)}"

    line("load", lambda result: timed(result["load"], lambda found: ""))
    for question in QUESTIONS:
        expected = ours["questions"][question].get("rows")
        line(
            f"{question} ({len(expected or [])} rows)",
            lambda result, q=question, e=expected: timed(
                result["questions"][q], lambda found: "" if found["rows"] == e else " **other answer**"
            ),
        )
    line("live update: 18 triples go, 18 come", lambda result: timed(result["update"], lambda found: ""))
    expected = set(ours["closure"].get("triples", []))
    line("closure", lambda result: timed(result["closure"], lambda found: _difference(found, expected)))
    line("memory at its highest", lambda result: f"{result['memory_mb']:.0f} MB")
    return "\n".join(lines) + "\n"


def _difference(found: Result, expected: set[str]) -> str:
    triples = set(found["triples"])
    more, fewer = len(triples - expected), len(expected - triples)
    return f" ({len(triples)} triples{f', {more} more' if more else ''}{f', {fewer} fewer' if fewer else ''})"


def _shown(seconds: float) -> str:
    return f"{seconds * 1000:.3g} ms" if seconds < 1 else f"{seconds:.3g} s"


def main(folder: Path, robots: int, runs: int) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    file, small = prepare(folder, robots, runs), prepare(folder, 2, 20)
    results = {}
    for name in ENGINES:
        place = folder / "engines"
        subprocess.run(["rm", "-rf", place], check=True)
        place.mkdir()
        child = [sys.executable, __file__, "--alone", name, place, file, small]
        done = subprocess.run([str(part) for part in child], stdout=subprocess.PIPE, check=False)
        if done.returncode == 0:
            results[name] = json.loads(done.stdout.splitlines()[-1])
        print(f"{name}: {'done' if done.returncode == 0 else 'failed'}", flush=True)
    (folder / "results.json").write_text(json.dumps(results, indent=1))
    with file.open("rb") as lines:
        count = sum(1 for _ in lines)
    print(report(results, f"{robots} robots with {runs} runs each: {count:,} triples"))


if __name__ == "__main__":
    if sys.argv[1] == "--alone":
        name, *paths = sys.argv[2:]
        out = os.fdopen(os.dup(1), "w")
        os.dup2(2, 1)  # what a store says of itself is no result
        found = measure(name, *map(Path, paths))
        out.write(json.dumps(found) + "\n")
        out.flush()
        os._exit(0)  # a Java machine or a store that is open need not be waited for
    main(Path(sys.argv[1]), *(map(int, sys.argv[2:]) if len(sys.argv) > 2 else (20, 100)))
