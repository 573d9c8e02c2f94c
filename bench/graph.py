"""The graph beside its peers: load, twelve questions, sums, live updates and the OWL 2 RL closure, in one run.

python bench/graph.py FOLDER [ROBOTS] [RUNS]      JENA_JARS names a folder with Jena's jars; prints GRAPH.md's table

The graph is that of a workspace: a fleet's rows, mapped, reasoned over and validated as `workspace reason` does. Each
store works alone in a process of its own, on the same triples. Each answer is held against ours, row by row.
"""

from __future__ import annotations

import json
import os
import re
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
from graph_engines import ENGINES, Engine, Irtwin
from irtwin.knowledge.questions.queries import named_questions
from irtwin.knowledge.store.changes import NOT_ASSERTED
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import ID, IRT, OWL, RDFS
from irtwin.workflow import reason_again
from memory import most_used

QUESTIONS = [
    "robots", "joints", "current_state", "energy_per_robot", "energy_per_effect", "fleet_ranking", "ledger_of_last_run",
    "worst_run", "to_reidentify", "where_is_the_gap", "common_causes", "provenance",
]  # fmt: skip
_ENTRY = "?share irt:of_Effect ?effect ; irt:Energy ?energy"
_OF_RUN = f"{_ENTRY} ; irt:share_of_Run ?run . ?run"
_MONTH = "irt:Start_Time ?start BIND(SUBSTR(STR(?start), 1, 7) AS ?month)"
SUMS = {  # of all entries of the ledgers; nothing holds them ready
    "ledger by effect": f"?effect (SUM(?energy) AS ?energy_J) {{ {_ENTRY} }} GROUP BY ?effect",
    "ledger by robot and effect": (
        f"?robot ?effect (SUM(?energy) AS ?energy_J) {{ {_OF_RUN} irt:run_of ?robot }} GROUP BY ?robot ?effect"
    ),
    "ledger by month and effect": (
        f"?month ?effect (SUM(?energy) AS ?energy_J) {{ {_OF_RUN} {_MONTH} }} GROUP BY ?month ?effect"
    ),
}
KINDS = ("named.nq", "all.nt", "asserted.nt")  # of files: quads, their triples, and those that nobody inferred
PATIENCE = 60  # s for one answer
UPDATES = 200
LIVE = re.compile(rf"<{re.escape(ID)}joint_state/R000\.cycle_0001/.*<{re.escape(IRT)}Joint_(Position|Speed|Torque)> .*")
OTHER = rf"<(?!{re.escape(OWL)}|{re.escape(RDFS)})[^>]*>"
OF_INDIVIDUALS = re.compile(rf"(?!(<.*>) \S+ \1$)<{re.escape(ID)}[^>]*> {OTHER} {OTHER}$")
NUMBER = re.compile(r'"[^"]*"\^\^')
Result = dict[str, Any]


def prepare(folder: Path, robots: int, runs: int) -> dict[str, Path]:
    """Have irtwin make a fleet's graph; return files of its named graphs, its triples, and those nobody inferred."""
    place = folder / f"{robots}x{runs}"
    files = {kind: folder / f"{place.name}.{kind}" for kind in KINDS}
    if not files["asserted.nt"].exists():
        subprocess.run(["rm", "-rf", place], check=True)
        place.mkdir(parents=True)
        fleet.make_database(place, robots, runs)
        KnowledgeGraph(place / "graph").close()
        reason_again(place)
        quads = [
            quad
            for quad in Store.read_only(str(place / "graph")).quads_for_pattern(None, None, None, None)
            if not isinstance(quad.graph_name, DefaultGraph)
            and quad.predicate.value != f"{OWL}imports"  # nothing is to be fetched
        ]
        asserted = {quad.triple for quad in quads if not quad.graph_name.value.startswith(NOT_ASSERTED)}
        serialize(quads, str(files["named.nq"]), RdfFormat.N_QUADS)
        serialize({quad.triple for quad in quads}, str(files["all.nt"]), RdfFormat.N_TRIPLES)
        serialize(asserted, str(files["asserted.nt"]), RdfFormat.N_TRIPLES)
    return files


def measure(name: str, folder: Path, files: dict[str, Path], small: Path) -> Result:
    """Let one store do all of it; seconds, MB, and the answers. Ours is asked with all its named graphs."""
    result: Result = {"questions": {}}
    engine, result["load"] = _load(name, folder / "triples", lambda engine: engine.load(files["all.nt"]))
    try:
        loaded, result["load named"] = _load(
            name, folder / "quads", lambda engine: engine.load_named(files["named.nq"])
        )
        engine = loaded if isinstance(loaded, Irtwin) else engine
    except NotImplementedError as error:
        result["load named"] = {"failed": str(error)}
    for question in QUESTIONS:
        result["questions"][question] = _answer(engine, named_questions()[question].text)
    for question, plain in SUMS.items():
        result["questions"][question] = _answer(engine, f"PREFIX irt: <{IRT}> SELECT {plain}")
    result["update"] = _attempt(lambda: _updates(engine, files["all.nt"]))
    result["closure"] = _attempt(lambda: _closure(engine, small))
    result["memory_mb"] = most_used() / 2**20
    return result


def _load(name: str, folder: Path, load: Callable[[Engine], None]) -> tuple[Engine, Result]:
    """Load up to three times, each into a store of its own; return the last one, and the best time."""
    times: list[float] = []
    processor: list[float] = []
    while len(times) < 3 and sum(times) < 15:
        place = folder / str(len(times))
        place.mkdir(parents=True)
        engine = ENGINES[name](place)
        before = time.process_time()
        times.append(_seconds(lambda engine=engine: load(engine)))
        processor.append(time.process_time() - before)
    return engine, {"best": min(times), "processor": min(processor)}


def _answer(engine: Engine, text: str) -> Result:
    """The first time and the best of those that follow within 3 s, and the rows."""

    def measured() -> Result:
        answers: list[Any] = []
        times = [_seconds(lambda: answers.append(engine.ask(text)))]
        began = time.perf_counter()
        while len(times) < 4 or (time.perf_counter() - began < 3 and len(times) < 50):
            times.append(_seconds(lambda: engine.ask(text)))
        rows = sorted(tuple(_plain(term) for term in row) for row in engine.rows(answers[0]))
        found = {"first": times[0], "best": min(times[1:]), "rows": rows}
        with suppress(NotImplementedError):
            engine.ask_again(text)
            found["kept"] = min(_seconds(lambda: engine.ask_again(text)) for _ in range(20))
        return found

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

    def timed(found: Result, more: Callable[[Result], str]) -> str:
        return found["failed"] if "failed" in found else f"{_shown(found['best'])}{more(found)}"

    def answered(found: Result, expected: Any, first: bool) -> str:
        kept = f"; kept {_shown(found['kept'])}" if "kept" in found and not first else ""
        after = f"; first {_shown(found['first'])}" if first else ""
        return f"{after}{kept}{'' if found['rows'] == expected else ' **other answer**'}"

    for kind in ("load", "load named"):
        line(
            {"load": "load, triples alone", "load named": "load, named graphs"}[kind],
            lambda result, kind=kind: timed(result[kind], lambda found: f" ({_shown(found['processor'])})"),
        )
    for question in ours["questions"]:
        expected = ours["questions"][question].get("rows")
        line(
            f"{question} ({len(expected or [])} rows)",
            lambda result, q=question, e=expected: timed(
                result["questions"].get(q, {"failed": ""}), lambda found: answered(found, e, q not in QUESTIONS)
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


def _lines(file: Path) -> int:
    with file.open("rb") as lines:
        return sum(1 for _ in lines)


def _shown(seconds: float) -> str:
    return f"{seconds * 1000:.3g} ms" if seconds < 1 else f"{seconds:.3g} s"


def main(folder: Path, robots: int, runs: int) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    files, small = prepare(folder, robots, runs), prepare(folder, 2, 20)["asserted.nt"]
    results = {}
    for name in ENGINES:
        place = folder / "engines"
        subprocess.run(["rm", "-rf", place], check=True)
        place.mkdir()
        child = [sys.executable, __file__, "--alone", name, place, *files.values(), small]
        done = subprocess.run([str(part) for part in child], stdout=subprocess.PIPE, check=False)
        if done.returncode == 0:
            results[name] = json.loads(done.stdout.splitlines()[-1])
        print(f"{name}: {'done' if done.returncode == 0 else 'failed'}", flush=True)
    (folder / "results.json").write_text(json.dumps(results, indent=1))
    triples, quads = (_lines(files[kind]) for kind in ("all.nt", "named.nq"))
    graphs = len({line.rsplit(" ", 2)[1] for line in files["named.nq"].read_text().splitlines()})
    title = f"{robots} robots with {runs} runs each: {triples:,} triples, {quads:,} in {graphs:,} named graphs"
    print(report(results, f"{title}; for the closure {_lines(small):,}"))


if __name__ == "__main__":
    if sys.argv[1] == "--alone":
        name, place, *paths, small = sys.argv[2:]
        out = os.fdopen(os.dup(1), "w")
        os.dup2(2, 1)  # what a store says of itself is no result
        found = measure(name, Path(place), dict(zip(KINDS, map(Path, paths), strict=True)), Path(small))
        out.write(json.dumps(found) + "\n")
        out.flush()
        os._exit(0)  # a Java machine or a store that is open need not be waited for
    main(Path(sys.argv[1]), *(map(int, sys.argv[2:]) if len(sys.argv) > 2 else (20, 100)))
