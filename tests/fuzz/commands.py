"""The commands on a case, one after the other, each in a child, and around them what they must leave alone."""

from __future__ import annotations

import tempfile
from collections import Counter
from contextlib import nullcontext
from functools import partial
from pathlib import Path

from tests.fuzz import logs, streams
from tests.fuzz.case import Case
from tests.fuzz.child import in_child
from tests.fuzz.fault import SET_ASIDE, Fault, fault_of
from tests.fuzz.outside import SECRET, Outside
from tests.fuzz.peers import peer
from tests.fuzz.run_irtwin import run_irtwin
from tests.fuzz.sound import ROBOT, Sound
from tests.fuzz.ways import spoil_case

_CHECKING = ("check", "status")
_TELLING = ("fleet", "import")
_PATIENCE = {"excite": 2.0, "alarms follow": 2.0, "live controller": 2.0, "serve": 2.0}  # s until Ctrl-C
_STOPPED = 130  # exit status after Ctrl-C, of what had nothing to keep yet
MAPPING = Path(__file__).parents[2] / "mappings" / "robot.r2rml.ttl"
WRITTEN = (
    *("gap.json", "gap.html", "predicted.parquet", "motion.csv", "plan.csv", "docs.html", "asked.html"),
    *("all.owl", "closed.ttl", "robot.nq", "kept.zip", "robot.urdf", "taken.parquet"),
)


class Unmade(Exception):
    """The harness cannot make what a case has: a fault of its own."""


def try_case(case: Case, sound: Path, tried: Counter[str] | None = None) -> Fault | None:
    """Try the commands of a case, one after the other; return the first fault. Raises Unmade.

    `sound`: the folder of what is sound. `tried` counts how each ended.
    """
    tried = Counter() if tried is None else tried
    with tempfile.TemporaryDirectory(prefix="irtwin-fuzz-") as name:
        outside = Outside(Path(name))
        folder = outside.case
        for part in case.sound:
            Sound(sound, _moving(case)).copy(part, folder)
        made = in_child(lambda: _make(case, folder), folder)
        if made.status:
            raise Unmade(f"status {made.status}: {made.err[-3000:]}\n{case.to_json()}")
        outside.seal()
        with peer(*case.peer) if case.peer else nullcontext() as port:
            if port is not None:
                _tell(folder / "workspace", port)
            for place, command in enumerate(case.commands):
                kind, said, follows = _try(case, command, folder, port, tried)
                if kind is None and (changed := outside.changed()) is not None:
                    kind = f"{Path(changed).name} outside was changed"
                if kind is not None:
                    return Fault(f"{place + 1}: {command}", f"{command}: {kind}", said[-6000:])
                if not follows and "workspace" not in case.sound:
                    break
    return None


def _try(case: Case, command: str, folder: Path, port: int | None, tried: Counter[str]) -> tuple[str | None, str, bool]:
    """Try a command; return the kind of its fault, what it printed as an error, and whether others may follow."""
    arguments, writes = _arguments(case, command, folder, port)
    if arguments is None:
        return None, "", True
    stdin = folder / "stdin"
    stdin.write_bytes(_stream(case, folder) if command == "live" else b"")
    for file in filter(Path.is_file, writes):
        file.unlink()
    patience = _PATIENCE.get(command)
    done = in_child(partial(run_irtwin, arguments), folder, stdin, patience)
    tried[f"{command}: {'refused' if done.status else 'answered'}"] += 1
    if patience is not None and done.status == _STOPPED:
        return None, done.err, True
    checks, tells = command.startswith(_CHECKING), command.startswith(_TELLING)
    kind = fault_of(done, writes, checks=checks, tells=tells)
    if kind is None and any(SECRET in text for text in (done.out, done.err, *(_text(file) for file in writes))):
        kind = "tells what a file outside says"
    return kind, done.err, not done.status or done.status == SET_ASIDE or "Written: " in done.err


def _text(file: Path) -> str:
    return file.read_text(errors="replace") if file.is_file() else ""


def _make(case: Case, folder: Path) -> None:
    if "data" not in case.sound:
        logs.write(case.data, folder / "data")
    for way, seed in case.spoils:
        spoil_case(folder, way, seed)


def _tell(workspace: Path, port: int) -> None:
    """Have alarms told to who answers at a port."""
    (workspace / "alarms.toml").write_text(
        f'[[mqtt]]\nhost = "127.0.0.1"\nport = {port}\ntopic = "x"\ntimeout_s = 0.3\n'
        f'[[mqtt]]\nhost = "127.0.0.1"\nport = {port}\ntopic = "x"\ntimeout_s = 0.3\n'
    )


def _workspace(case: Case, folder: Path) -> Path:
    return folder / ("restored" if "given.zip" in case.sound else "workspace")


def _archive(folder: Path) -> Path:
    given = folder / "given.zip"
    return given if given.exists() else folder / "kept.zip"


def _arguments(case: Case, command: str, folder: Path, port: int | None) -> tuple[list[str] | None, list[Path]]:
    """Return a command's arguments, None where there is nothing to try it on, and the files it is to write."""
    data, workspace, twin = folder / "data", _workspace(case, folder), folder / "twin.json"
    restored = folder / "restored"
    out = {name: folder / name for name in WRITTEN}
    diagnose = ["diagnose", data, "--json", out["gap.json"]]
    run = min((data / "runs").iterdir(), default=data / "runs")
    here = ["--workspace", workspace]
    words, writes = {
        "check": (["check", data], []),
        "diagnose": (diagnose, [out["gap.json"]]),
        "diagnose with page and twin": (
            [*diagnose, "--report", out["gap.html"], "--save-twin", twin],
            [out["gap.json"], out["gap.html"]],
        ),
        "diagnose into workspace": ([*diagnose, *here], [out["gap.json"]]),
        "predict": (["predict", twin, run, "--out", out["predicted.parquet"]], [out["predicted.parquet"]]),
        "excite": (
            ["robot", "excite", data / "robot.urdf", "--seconds", "2", "--out", out["motion.csv"]],
            [out["motion.csv"]],
        ),
        "plan": (
            ["plan", data / "robot.urdf", *_ends(case), "--out", out["plan.csv"], "--search", "2"],
            [out["plan.csv"]],
        ),
        "robot dh": (["robot", "dh", data, "--convention", "modified"], []),
        "robot equations": (["robot", "equations", data], []),
        "robot urdf": (["robot", "urdf", data, "--out", out["robot.urdf"]], [out["robot.urdf"]]),
        "robot ros": (["robot", "ros", data, "--out", folder / "package"], []),
        "export for ROS": (["export", "--ros", folder / "ros", "--robot", _robot(folder), *here], []),
        "live replay": (["live", "--replay", run, "--robot", _robot(folder), "--speed", "1000", *here], []),
        "predict into workspace": (
            ["predict", _robot(folder), run, "--out", out["taken.parquet"], "--run", "taken", *here],
            [out["taken.parquet"]],
        ),
        "improve": (["improve", _robot(folder), _again(run, folder), *here], []),
        "import": (
            [
                *("import", *sorted((data / "runs").iterdir()), "--robot", data / "robot.urdf"),
                *("--power-at", "mains", "--out", folder / "brought"),
            ],
            [],
        ),
        "check of what was imported": (["check", folder / "brought"], []),
        "alarms": (["alarms", *here], []),
        "alarms of the robot": (["alarms", "--robot", _robot(folder), *here], []),
        "fleet diagnose": (["diagnose", _many(folder), "--workers", "1", "--out", folder / "fleet"], []),
        "fleet run": (["run", _many(folder), "--workers", "1", "--out", folder / "fleet_run"], []),
        "fleet status": (["workspace", "status", "--workspace", folder / "fleet"], []),
        "fleet status of runs": (["workspace", "status", "--workspace", folder / "fleet_run"], []),
        "run": (["run", data, "--workspace", workspace, "--repair"], []),
        "query": (["query", "energy_per_joint", *here], []),
        "export": (["export", "--owl", out["all.owl"], *here], [out["all.owl"]]),
        "live": (["live", *here], []),
        "map": (
            [
                "workspace",
                "map",
                MAPPING,
                "--database",
                f"sqlite:///{workspace / 'irtwin.db'}",
                "--out",
                out["robot.nq"],
            ],
            [out["robot.nq"]],
        ),
        "reason": (["workspace", "reason", out["all.owl"], "--out", out["closed.ttl"]], [out["closed.ttl"]]),
        "explain": (["explain", "?", "irt:Energy_Consumption", *here], []),
        "backup": (["workspace", "backup", out["kept.zip"], *here], [out["kept.zip"]]),
        "restore": (
            ["workspace", "restore", _archive(folder), "--workspace", restored],
            [restored] * (not restored.exists()),
        ),
        "repair": (["workspace", "repair", *here], []),
        "adopt": (["improve", _robot(folder), *here], []),
        "drop": (["workspace", "drop", _robot(folder), *here], []),
        "drop a run": (["workspace", "drop", _robot(folder), "--run", "live_20260301T120000000000", *here], []),
        "status": (["workspace", "status", *here], []),
        "trust": (["workspace", "trust", workspace], []),
        "query json": (["query", "SELECT * { ?s ?p ?o } LIMIT 20", "--format", "json", *here], []),
        "questions": (["query", *here], []),
        "docs": (["docs", "--ontology", out["docs.html"], "--questions", out["asked.html"], *here], [out["docs.html"]]),
        "reason into workspace": (["workspace", "reason", *here], []),
        "optimise": (["optimise", _robot(folder), run.stem, "--cycle", "20", *here], []),
        "plan into workspace": (["plan", _robot(folder), *_ends(case), "--search", "2", *here], []),
        "alarms follow": (["alarms", "--follow", *here], []),
        "live controller": (
            ["live", "--opcua", f"opc.tcp://127.0.0.1:{port or 1}", "--robot", _robot(folder), *here],
            [],
        ),
        "serve": (["serve", "--port", "0", *here], []),
        "init": (["import", "--robot", data / "robot.urdf", "--out", folder / "begun"], [folder / "begun"]),
        "run of what was imported": (["run", folder / "brought", *here], []),
    }[command]
    if command == "predict" and not twin.exists():
        return None, []
    return list(map(str, words)), writes


def _ends(case: Case) -> list[str]:
    """Return the options of a plan's start and goal."""
    return [f"--{end}={','.join([place] * max(1, _moving(case)))}" for end, place in (("from", "0"), ("to", "0.3"))]


def _moving(case: Case) -> int:
    """Return how many joints move: of what is sound as many as the controllers have that are followed, else two."""
    if case.sound:
        return 6 if case.peer and "live controller" in case.commands else 2
    return sum(axis.kind not in ("fixed", "mimic") for axis in case.data.robot.axes)


def _stream(case: Case, folder: Path) -> bytes:
    return streams.lines(case.stream, _robot(folder), _moving(case))


def _robot(folder: Path) -> str:
    """Return the robot in the workspace."""
    pages = sorted((folder / "workspace" / "reports").glob("*.html"))
    return pages[0].stem if pages else ROBOT


def _many(folder: Path) -> Path:
    """Return a list of data sets: the drawn one, and one that is none."""
    bad = folder / "bad"
    bad.mkdir(exist_ok=True)
    (bad / "dataset.toml").write_text("[robot\n")
    listed = folder / "sets.txt"
    listed.write_text(f"{folder / 'data'}\n{bad}\n")
    return listed


def _again(run: Path, folder: Path) -> Path:
    """Return the run under another name, as a new log."""
    copy = folder / f"again{run.suffix}"
    copy.write_bytes(run.read_bytes())
    return copy
