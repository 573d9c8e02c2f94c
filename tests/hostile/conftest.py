"""A guard that runs hostile input in processes with little time and memory."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

MOST_SECONDS = 10.0  # of processor time, for a case
MOST_MEGABYTES = 900.0  # resident, the readers' libraries among them


@pytest.fixture(scope="session")
def guard() -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, str(Path(__file__).parent / "guard.py")]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdin is not None and process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        yield process
        process.stdin.close()


@pytest.fixture
def refused(guard: subprocess.Popen[str], tmp_path: Path) -> Callable[..., str]:
    """Give a function that runs a room on its arguments, holds it to its bounds, and returns what it said."""

    def run(room: str, *arguments: str) -> str:
        assert guard.stdin is not None and guard.stdout is not None
        print(json.dumps({"room": room, "arguments": arguments}), file=guard.stdin, flush=True)
        answer = json.loads(guard.stdout.readline())
        assert answer["outcome"] == "refused", answer
        assert answer["seconds"] < MOST_SECONDS, answer
        assert answer["megabytes"] < MOST_MEGABYTES, answer
        assert "\n" not in answer["message"] and len(answer["message"]) < 1000, answer
        assert not [file for file in tmp_path.iterdir() if file.name.startswith("out.")], "something was written"
        return str(answer["message"])

    return run
