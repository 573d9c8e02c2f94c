"""The commands on a case, one after the other, each in a child, and around them what they must leave alone."""

from __future__ import annotations

import re
import shlex
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
_WRITTEN = r"{>([\w.]+)}"
_HERE = " --workspace {workspace}"
_DIAGNOSE = "diagnose {data} --json {>gap.json}"
COMMANDS = {  # as they are typed; {name}: a place or a word of the case, {>name}: what is to be written in its folder
    "check": "check {data}",
    "diagnose": _DIAGNOSE,
    "diagnose with page and twin": _DIAGNOSE + " --report {>gap.html} --save-twin {folder}/twin.json",
    "diagnose into workspace": _DIAGNOSE + _HERE,
    "predict": "predict {folder}/twin.json {run} --out {>predicted.parquet}",
    "excite": "robot excite {data}/robot.urdf --seconds 2 --out {>motion.csv}",
    "plan": "plan {data}/robot.urdf --from={start} --to={goal} --out {>plan.csv} --search 2",
    "robot dh": "robot dh {data} --convention modified",
    "robot equations": "robot equations {data}",
    "robot urdf": "robot urdf {data} --out {>robot.urdf}",
    "robot ros": "robot ros {data} --out {folder}/package",
    "export for ROS": "export --ros {folder}/ros --robot {robot}" + _HERE,
    "live replay": "live --replay {run} --robot {robot} --speed 1000" + _HERE,
    "predict into workspace": "predict {robot} {run} --out {>taken.parquet} --run taken" + _HERE,
    "improve": "improve {robot} {again}" + _HERE,
    "import": "import {runs} --robot {data}/robot.urdf --power-at mains --out {folder}/brought",
    "check of what was imported": "check {folder}/brought",
    "run of what was imported": "run {folder}/brought" + _HERE,
    "alarms": "alarms" + _HERE,
    "alarms of the robot": "alarms --robot {robot}" + _HERE,
    "alarms follow": "alarms --follow" + _HERE,
    "fleet diagnose": "diagnose {list} --workers 1 --out {folder}/fleet",
    "fleet run": "run {list} --workers 1 --out {folder}/fleet_run",
    "fleet status": "workspace status --workspace {folder}/fleet",
    "fleet status of runs": "workspace status --workspace {folder}/fleet_run",
    "run": "run {data} --repair" + _HERE,
    "query": "query energy_per_joint" + _HERE,
    "query json": "query 'SELECT * { ?s ?p ?o } LIMIT 20' --format json" + _HERE,
    "questions": "query" + _HERE,
    "export": "export --owl {>all.owl}" + _HERE,
    "live": "live" + _HERE,
    "live controller": "live --opcua opc.tcp://127.0.0.1:{port} --robot {robot}" + _HERE,
    "map": "workspace map {mapping} --database sqlite:///{workspace}/irtwin.db --out {>robot.nq}",
    "reason": "workspace reason {folder}/all.owl --out {>closed.ttl}",
    "reason into workspace": "workspace reason" + _HERE,
    "explain": "explain ? irt:Energy_Consumption" + _HERE,
    "backup": "workspace backup {>kept.zip}" + _HERE,
    "restore": "workspace restore {archive} --workspace {>restored}",
    "repair": "workspace repair" + _HERE,
    "adopt": "improve {robot}" + _HERE,
    "drop": "workspace drop {robot}" + _HERE,
    "drop a run": "workspace drop {robot} --run live_20260301T120000000000" + _HERE,
    "status": "workspace status" + _HERE,
    "trust": "workspace trust {workspace}",
    "docs": "docs --ontology {>docs.html} --questions {folder}/asked.html" + _HERE,
    "optimise": "optimise {robot} {stem} --cycle 20" + _HERE,
    "plan into workspace": "plan {robot} --from={start} --to={goal} --search 2" + _HERE,
    "serve": "serve --port 0" + _HERE,
    "init": "import --robot {data}/robot.urdf --out {>begun}",
}


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
    broker = f'[[mqtt]]\nhost = "127.0.0.1"\nport = {port}\ntopic = "x"\ntimeout_s = 0.3\n'
    (workspace / "alarms.toml").write_text(2 * broker)


def _archive(folder: Path) -> Path:
    given = folder / "given.zip"
    return given if given.exists() else folder / "kept.zip"


def _arguments(case: Case, command: str, folder: Path, port: int | None) -> tuple[list[str] | None, list[Path]]:
    """Return a command's arguments, None where there is nothing to try it on, and what it is to write."""
    if command == "predict" and not (folder / "twin.json").exists():
        return None, []
    data, joints = folder / "data", max(1, _moving(case))
    runs = sorted((data / "runs").iterdir())
    run = runs[0] if runs else data / "runs"
    words = {
        "folder": folder, "data": data, "run": run, "stem": run.stem, "again": _again(run, folder),
        "workspace": folder / ("restored" if "given.zip" in case.sound else "workspace"), "robot": _robot(folder),
        "archive": _archive(folder), "list": _many(folder), "mapping": MAPPING, "port": port or 1,
        "start": ",".join(["0"] * joints), "goal": ",".join(["0.3"] * joints),
    }  # fmt: skip
    writes = [folder / name for name in re.findall(_WRITTEN, COMMANDS[command])]
    typed = re.sub(_WRITTEN, r"{folder}/\1", COMMANDS[command])
    arguments: list[str] = []
    for word in shlex.split(typed):
        arguments += map(str, runs) if word == "{runs}" else [re.sub(r"{(\w+)}", lambda it: str(words[it[1]]), word)]
    return arguments, [file for file in writes if not file.is_dir()]


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
