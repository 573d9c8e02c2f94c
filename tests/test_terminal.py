"""What the command line writes to terminals, pipes and disks that are not as one wishes."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from tests.data_sets import irtwin

pytestmark = pytest.mark.slow

COMMAND = [sys.executable, "-m", "irtwin"]


def called(*arguments: str, **settings: str) -> subprocess.CompletedProcess[str]:
    surroundings = {**os.environ, **settings}
    return subprocess.run([*COMMAND, *arguments], capture_output=True, text=True, check=False, env=surroundings)


@pytest.mark.parametrize("settings", [{"LC_ALL": "C", "PYTHONIOENCODING": "ascii"}, {"PYTHONIOENCODING": "latin-1"}])
def test_a_terminal_without_utf_8_is_no_reason_to_stop(settings, tmp_path):
    said = called("diagnose", "名前/Ж", "--json", str(tmp_path / "gap.json"), **settings)
    assert said.returncode == 2
    assert len(said.stderr.splitlines()) == 2  # what it does, and what is wrong
    listed = called("query", **settings)
    assert listed.returncode == 0
    assert "energy_per_joint" in listed.stdout
    assert "Traceback" not in said.stderr + listed.stderr


def test_a_full_disk_under_the_answer_is_one_line():
    with Path("/dev/full").open("w") as full:
        done = subprocess.run([*COMMAND, "query", "--format", "csv"], stdout=full, stderr=subprocess.PIPE, text=True)
    assert done.stderr == "irtwin: the output: No space left on device; free some space and try again\n"
    assert done.returncode == 2


def test_a_reader_that_leaves_needs_no_word():
    done = subprocess.run(f"{sys.executable} -m irtwin query --format csv | head -1", shell=True, capture_output=True)
    assert done.stderr == b""
    assert done.stdout.startswith(b"theme,name")


def test_a_system_that_is_not_posix_is_told_in_one_line(monkeypatch):
    monkeypatch.setattr("irtwin.cli.command_line.os", SimpleNamespace(name="nt"))
    said = irtwin("demo")
    line = "irtwin: this system is not supported: irtwin runs on Linux; on Windows, install it in WSL\n"
    assert (said.status, said.out, said.err) == (2, "", line)


def test_names_neither_break_the_line_nor_steer_the_terminal(tmp_path):
    (tmp_path / "dataset.toml").write_text('[robot]\nname = "x"\nurdf = "a\\nirtwin: all is well\\u001b[2J"\n')
    said = irtwin("diagnose", tmp_path, "--json", tmp_path / "gap.json")
    assert said.status == 2
    assert r'"a\nirtwin: all is well\x1b[2J": there is no such file' in said.err.splitlines()[-1]


@pytest.mark.parametrize("value", ["nan", "inf", "-inf", "1e999"])
@pytest.mark.parametrize(
    "arguments",
    [
        ["predict", "twin.json", "run.csv", "--out", "out.parquet", "--payload-mass"],
        ["predict", "twin.json", "run.csv", "--out", "out.parquet", "--payload-com", "0", "0"],
        ["excite", "robot.urdf", "--out", "out.csv", "--seconds"],
        ["excite", "robot.urdf", "--out", "out.csv", "--seconds", "5", "--rate"],
        ["excite", "robot.urdf", "--out", "out.csv", "--seconds", "5", "--box", "0", "0", "0", "1", "1"],
        ["serve", "--timeout"],
        ["map", "m.ttl", "--database", "sqlite://", "--out", "out.nq", "--timeout"],
    ],
    ids=lambda words: " ".join(words[:1] + words[-3:]),
)
def test_options_take_finite_numbers(arguments, value):
    said = irtwin(*arguments, value)
    assert said.status == 2
    assert "Invalid value for" in said.err
