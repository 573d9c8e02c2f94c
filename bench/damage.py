"""Files of a workspace damaged at random, then a command: `python bench/damage.py [CASES] [SEED]`.

Each case takes one file of a small workspace, deletes it, empties it, cuts it in half, flips 16 bytes or fills it with
random ones, and runs a command on what is left, in a process of its own. It must end within 5 minutes, without a
traceback, with exit status 0, or with 2 and a last line that begins with `irtwin: `. A query that is answered must be
answered as before the damage. Prints how many cases each command answered and refused, and each fault.
"""

from __future__ import annotations

import json
import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
from tests import small_robots
from tests.test_damage import DAMAGES

SLOWEST = 300.0  # s
SAMPLES = "SELECT ?run (series:mean(?run, 'power', 0, 9) AS ?mean) { ?run a irt:IR_RunProcess } ORDER BY ?run"
SLOW = ("run", "drop", "repair")  # and so drawn less often
Arguments = Callable[[Path], list[object]]


def main(cases: int, seed: int) -> int:
    draw, faults = random.Random(seed), []
    counts: Counter[tuple[str, str]] = Counter()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        base, place = folder / "base", folder / "workspace"
        first = small_robots.data_set(folder / "first", "First")
        assert call(["run", first, "--workspace", base])[0] == 0
        second = small_robots.data_set(folder / "second", "Second", seed=5)
        commands = all_commands(folder, second)
        shutil.copytree(base, place)
        whole = {kind: call(commands[kind](place), fed())[1] for kind in ("query", "samples")}
        files = sorted(file.relative_to(base) for file in base.rglob("*") if file.is_file())
        for _ in range(cases):
            file, damage = draw.choice(files), draw.choice(list(DAMAGES))
            kind = draw.choice(
                [kind for kind in commands for _ in range(1 if kind in ("run", "drop", "repair") else 3)]
            )
            shutil.rmtree(place)
            shutil.copytree(base, place)
            (folder / "kept.zip").unlink(missing_ok=True)
            if (base / file).stat().st_size or damage in ("deleted", "random"):
                DAMAGES[damage](place / file)
            status, out, err = call(commands[kind](place), fed() if kind == "live" else b"")
            counts[kind, "answered" if status == 0 else "refused"] += 1
            fault = fault_of(status, err)
            if fault is None and status == 0 and kind in whole and out != whole[kind] and not err:
                fault = f"another answer, in silence: {out[:200]}"
            if fault:
                faults.append(f"{kind} with {file} {damage}: {fault}")
                print(faults[-1], flush=True)
    for kind in commands:
        print(f"{kind}: {counts[kind, 'answered']} answered, {counts[kind, 'refused']} refused")
    print(f"{cases} cases, {len(faults)} faults")
    return len(faults)


def all_commands(folder: Path, data_set: Path) -> dict[str, Arguments]:
    return {
        "query": lambda place: ["query", "energy_per_run", "--workspace", place, "--format", "csv"],
        "samples": lambda place: ["query", SAMPLES, "--workspace", place, "--format", "csv"],
        "explain": lambda place: ["explain", "? irt:Energy_Consumption ?", "--workspace", place],
        "export": lambda place: ["export", "--owl", folder / "x.owl", "--workspace", place],
        "backup": lambda place: ["workspace", "backup", folder / "kept.zip", "--workspace", place],
        "live": lambda place: ["live", "--workspace", place],
        "run": lambda place: ["run", data_set, "--workspace", place],
        "drop": lambda place: ["workspace", "drop", "First", "--workspace", place],
        "repair": lambda place: ["workspace", "repair", "--workspace", place],
    }


def fed() -> bytes:
    """Return ten states of the robot."""
    began = time.time() - 100.0
    states = ({"robot": "First", "time": began + 0.1 * k, "position": [0.1, 0.2]} for k in range(10))
    return b"".join(json.dumps(state).encode() + b"\n" for state in states)


def fault_of(status: int, err: str) -> str | None:
    last = err.splitlines()[-1] if err else ""
    if "Traceback" in err or status not in (0, 2):
        return f"status {status}: {err[-500:]}"
    if status == 2 and not last.startswith("irtwin: "):
        return f"no line that says what happened: {err[-200:]}"
    return None


def call(arguments: list[object], given: bytes = b"") -> tuple[int, str, str]:
    command = [sys.executable, "-m", "irtwin", *map(str, arguments)]
    try:
        done = subprocess.run(command, input=given, capture_output=True, check=False, timeout=SLOWEST)
    except subprocess.TimeoutExpired:
        return -1, "", f"not ended after {SLOWEST:g} s"
    return done.returncode, done.stdout.decode(), done.stderr.decode()


if __name__ == "__main__":
    given = [int(argument) for argument in sys.argv[1:]]
    sys.exit(main(*given, *(300, 1)[len(given) :]) and 1)
