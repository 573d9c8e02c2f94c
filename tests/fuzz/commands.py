"""The commands on a case, each in a child with little time and memory, and what counts as a fault."""

from __future__ import annotations

import importlib
import json
import multiprocessing
import os
import pkgutil
import re
import resource
import select
import signal
import sys
import tempfile
import traceback
import warnings
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import pyarrow.parquet
from tests.fuzz import logs, spoil, streams
from tests.fuzz.case import Case

import irtwin
import irtwin.cli

for _module in pkgutil.walk_packages(irtwin.__path__, "irtwin."):  # here, once, not in each child
    if not _module.name.endswith("__main__"):
        importlib.import_module(_module.name)

SECONDS = 60  # of the processor, as others may share it
_PATIENCE = 300  # s, for what waits and does nothing
MEGABYTES = 2000  # beside what the libraries take
_SET_ASIDE = 3  # exit status of a fleet that has refused a data set
_TELLING = ("fleet", "import")
_FAILED = re.compile(r"^failed +\d|\b[1-9]\d* failed\b", re.M)
_EXCITING = 2.0  # s until Ctrl-C: the best motion so far is kept
_STOPPED = 130  # exit status after Ctrl-C
MAPPING = Path(__file__).parents[2] / "mappings" / "robot.r2rml.ttl"
WRITTEN = (
    *("gap.json", "gap.html", "predicted.parquet", "motion.csv", "plan.csv"),
    *("all.owl", "closed.ttl", "robot.nq", "kept.zip", "robot.urdf", "kept.mcap", "kept.bag", "taken.parquet"),
)
LONGEST_LINE = 2000  # characters of an error
_STEP = re.compile(  # what a command says while it works, and of the log
    r"^\s*\d+\.\d s  |^\s*\d+ s  step |^  |^\w[\w ]* \((cure first|doubtful|mended)\): "
)
_CURE = re.compile(r"^\w[\w ]* \(cure first\): ", re.M)  # all that `check` says where it refuses a log
_WARNING = re.compile(r"^.*\b\w*Warning: .*$", re.M)


@dataclass(frozen=True)
class Done:
    """What became of a command: its status (negative: the signal), what it printed, s, MB beside the libraries."""

    status: int
    out: str
    err: str


@dataclass(frozen=True)
class Fault:
    """A command that failed as none may; `kind` is the same for the same fault."""

    command: str
    kind: str
    said: str


def try_case_apart(case: Case) -> Fault | None:
    """Try a case from a process that has opened no store: a fork lacks RocksDB's threads, and waits for them."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([__name__])
    with ProcessPoolExecutor(1, mp_context=context) as apart:
        return apart.submit(try_case, case).result()


def try_case(case: Case, tried: Counter[str] | None = None) -> Fault | None:
    """Try the commands of a case, one after the other; return the first fault. `tried` counts how each ended."""
    with tempfile.TemporaryDirectory(prefix="irtwin-fuzz-") as name:
        folder = Path(name)
        made = in_child(lambda: _make(case, folder / "data"), folder)
        if made.status:
            raise AssertionError(f"the harness cannot make the data set of this case:\n{made.err}\n{case.to_json()}")
        for place, command in enumerate(case.commands):
            arguments, writes = _arguments(case, command, folder)
            if arguments is None:
                continue
            stdin = folder / "stdin"
            stdin.write_bytes(_stream(case, folder) if command == "live" else b"")
            for file in writes:
                file.unlink(missing_ok=True)
            patience = _EXCITING if command == "excite" else None
            done = in_child(partial(_main, arguments), folder, stdin, patience)
            if tried is not None:
                tried[f"{command}: {'refused' if done.status else 'answered'}"] += 1
            if patience is not None and done.status == _STOPPED:
                continue  # before there was a motion to keep
            kind = fault_of(done, writes, checks=command.startswith("check"), tells=command.startswith(_TELLING))
            if kind is not None:
                return Fault(f"{place + 1}: {command}", f"{command}: {kind}", done.err[-6000:])
            if done.status and done.status != _SET_ASIDE and "Written: " not in done.err:
                break
    return None


def _make(case: Case, folder: Path) -> None:
    logs.write(case.data, folder)
    for way, seed in case.spoils:
        spoil.spoil(folder, way, seed)


def _arguments(case: Case, command: str, folder: Path) -> tuple[list[str] | None, list[Path]]:
    """Return a command's arguments, None where there is nothing to try it on, and the files it is to write."""
    data, workspace, twin = folder / "data", folder / "workspace", folder / "twin.json"
    out = {name: folder / name for name in WRITTEN}
    diagnose = ["diagnose", data, "--json", out["gap.json"]]
    run = next((data / "runs").iterdir())
    kept = ["--robot", _robot(folder), "--run", run.stem, "--workspace", workspace]
    words, writes = {
        "check": (["check", data], []),
        "diagnose": (diagnose, [out["gap.json"]]),
        "diagnose with page and twin": (
            [*diagnose, "--report", out["gap.html"], "--save-twin", twin],
            [out["gap.json"], out["gap.html"]],
        ),
        "diagnose into workspace": ([*diagnose, "--workspace", workspace], [out["gap.json"]]),
        "predict": (["predict", twin, run, "--out", out["predicted.parquet"]], [out["predicted.parquet"]]),
        "excite": (
            ["excite", data / "robot.urdf", "--seconds", "2", "--out", out["motion.csv"]],
            [out["motion.csv"]],
        ),
        "plan": (
            ["plan", data / "robot.urdf", *_ends(case), "--out", out["plan.csv"], "--search", "2"],
            [out["plan.csv"]],
        ),
        "robot dh": (["robot", "dh", data, "--convention", "modified"], []),
        "robot ik": (["robot", "ik", data, "--pose", "0.3", "0", "0.4", "0", "1", "0"], []),
        "robot equations": (["robot", "equations", data], []),
        "robot urdf": (["robot", "urdf", data, "--out", out["robot.urdf"]], [out["robot.urdf"]]),
        "robot ros": (["robot", "ros", data, "--out", folder / "package"], []),
        "export for ROS": (["export", "--ros", folder / "ros", *kept[:2], *kept[4:]], []),
        "export MCAP": (["export", "--mcap", out["kept.mcap"], *kept], [out["kept.mcap"]]),
        "export bag": (["export", "--bag", out["kept.bag"], *kept], [out["kept.bag"]]),
        "live replay": (
            ["live", "--replay", run, "--robot", _robot(folder), "--speed", "1000", "--workspace", workspace],
            [],
        ),
        "predict into workspace": (
            ["predict", _robot(folder), run, "--out", out["taken.parquet"], "--run", "taken", "--workspace", workspace],
            [out["taken.parquet"]],
        ),
        "improve": (["improve", _robot(folder), _again(run, folder), "--workspace", workspace], []),
        "import": (
            [
                *("import", *sorted((data / "runs").iterdir()), "--robot", data / "robot.urdf"),
                *("--power-at", "mains", "--out", folder / "brought"),
            ],
            [],
        ),
        "check of what was imported": (["check", folder / "brought"], []),
        "alarms": (["alarms", "--workspace", workspace], []),
        "alarms of the robot": (["alarms", "--robot", _robot(folder), "--workspace", workspace], []),
        "fleet diagnose": (["fleet", "diagnose", _many(folder), "--workers", "1", "--out", folder / "fleet"], []),
        "fleet run": (["fleet", "run", _many(folder), "--workers", "1", "--out", folder / "fleet_run"], []),
        "fleet status": (["fleet", "status", folder / "fleet"], []),
        "fleet status of runs": (["fleet", "status", folder / "fleet_run"], []),
        "run": (["run", data, "--workspace", workspace, "--repair"], []),
        "query": (["query", "energy_per_joint", "--workspace", workspace], []),
        "export": (["export", "--owl", out["all.owl"], "--workspace", workspace], [out["all.owl"]]),
        "live": (["live", "--workspace", workspace], []),
        "map": (
            ["map", MAPPING, "--database", f"sqlite:///{workspace / 'irtwin.db'}", "--out", out["robot.nq"]],
            [out["robot.nq"]],
        ),
        "reason": (["reason", out["all.owl"], "--out", out["closed.ttl"]], [out["closed.ttl"]]),
        "explain": (["explain", "?", "irt:Energy_Consumption", "--workspace", workspace], []),
        "backup": (["backup", out["kept.zip"], "--workspace", workspace], [out["kept.zip"]]),
        "restore": (["restore", out["kept.zip"], "--workspace", folder / "restored"], []),
        "repair": (["repair", "--workspace", workspace], []),
        "adopt": (["adopt", _robot(folder), "--workspace", workspace], []),
        "drop": (["drop", _robot(folder), "--workspace", workspace], []),
    }[command]
    if command == "predict" and not twin.exists():
        return None, []
    return list(map(str, words)), writes


def _ends(case: Case) -> list[str]:
    """Return the options of a plan's start and goal."""
    return [f"--{end}={','.join([place] * max(1, _moving(case)))}" for end, place in (("from", "0"), ("to", "0.3"))]


def _moving(case: Case) -> int:
    return sum(axis.kind not in ("fixed", "mimic") for axis in case.data.robot.axes)


def _stream(case: Case, folder: Path) -> bytes:
    return streams.lines(case.stream, _robot(folder), _moving(case))


def _robot(folder: Path) -> str:
    """Return the robot in the workspace."""
    pages = sorted((folder / "workspace" / "reports").glob("*.html"))
    return pages[0].stem if pages else "arm"


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


def _main(arguments: list[str]) -> None:
    sys.argv = ["irtwin", *arguments]
    irtwin.cli.main()


def in_child(work: Callable[[], None], folder: Path, stdin: Path | None = None, patience: float | None = None) -> Done:
    """Do some work in a child process with little time and memory; Ctrl-C comes after `patience` s."""
    out, err = folder / "stdout", folder / "stderr"
    child = os.fork()
    if child == 0:
        _child(work, stdin or Path(os.devnull), out, err)
    end = os.pidfd_open(child)
    try:
        if patience is not None and not select.select([end], [], [], patience)[0]:
            os.kill(child, signal.SIGINT)
        if not select.select([end], [], [], _PATIENCE)[0]:
            os.kill(child, signal.SIGKILL)
        _, status = os.waitpid(child, 0)
    finally:
        os.close(end)
    said = (file.read_bytes().decode(errors="replace") for file in (out, err))
    return Done(os.waitstatus_to_exitcode(status), *said)


def _child(work: Callable[[], None], stdin: Path, out: Path, err: Path) -> None:
    status = 1
    try:
        signal.signal(signal.SIGINT, signal.default_int_handler)  # which a session in the background has not
        for number, file, flags in ((0, stdin, os.O_RDONLY), (1, out, os.O_WRONLY), (2, err, os.O_WRONLY)):
            os.dup2(os.open(file, flags | (os.O_CREAT | os.O_TRUNC if flags else 0), 0o600), number)
        sys.stdin, sys.stdout, sys.stderr = open(0), open(1, "w"), open(2, "w")  # noqa: SIM115
        warnings.resetwarnings()
        for kind in (DeprecationWarning, PendingDeprecationWarning, ImportWarning, ResourceWarning):
            warnings.simplefilter("ignore", kind)
        warnings.showwarning = lambda said, kind, file, line, *_: print(
            f"{file}:{line}: {kind.__name__}: {said}", file=sys.stderr
        )
        pages = int(Path("/proc/self/statm").read_text().split()[5]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_DATA, (pages + (MEGABYTES << 20),) * 2)
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS))
        work()
        status = 0
    except SystemExit as stop:
        status = stop.code if isinstance(stop.code, int) else 0 if stop.code is None else 1
    except BaseException:
        traceback.print_exc()
    finally:
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
        os._exit(status)


def fault_of(done: Done, writes: list[Path], *, checks: bool = False, tells: bool = False) -> str | None:
    """Say what is wrong with how a command ended; None where nothing is.

    One that `checks` may say findings alone; one that `tells` of several things may need as many lines.
    """
    if done.status == -signal.SIGKILL:
        return f"hang of {SECONDS} s"
    if "Traceback (most recent call last)" in done.err:
        return _where(done.err)
    if done.status not in (0, 2, 3):
        return f"exit status {done.status}"
    if found := _WARNING.search(done.err):
        return re.sub(r"^.*/(src|site-packages)/", "", found[0])[:200]
    if tells and _FAILED.search(done.out + done.err):
        return "a data set failed that was neither done nor refused"
    if done.status and not (tells and (done.status == _SET_ASIDE or "Written: " in done.err)):
        lines = [line for line in done.err.splitlines() if line.strip() and not _STEP.match(line)]
        if len(lines) != 1 and not (checks and not lines and _CURE.search(done.err)):
            return f"{len(lines)} lines of error"
        if max(map(len, lines), default=0) > LONGEST_LINE:
            return "an error of many characters"
        return next((f"{file.name} written beside an error" for file in writes if file.exists()), None)
    return next((f"{file.name} is not whole" for file in writes if not _whole(file)), None)


def _where(err: str) -> str:
    """Return the last line of irtwin's in a traceback, and the error's kind: what tells two faults apart."""
    places = re.findall(r'File "[^"]*/src/(irtwin/[^"]*)", line (\d+), in (\S+)', err)
    ends = re.findall(r"^(\w[\w.]*(?:Error|Exception|Interrupt|Exit|Warning)\w*|[a-z_]+\.\w+)\b", err, re.M)
    place = f"{places[-1][0]} in {places[-1][2]}" if places else "?"
    return f"{ends[-1] if ends else 'error'} at {place}"


def _whole(file: Path) -> bool:
    if not file.exists():
        return False
    if file.suffix == ".json":
        json.loads(file.read_text(), parse_constant=_no_constant)
    if file.suffix == ".parquet":
        pyarrow.parquet.read_table(file)
    return file.stat().st_size > 0


def _no_constant(text: str) -> None:
    raise AssertionError(f"{text} is no JSON")
