"""What the command line writes to terminals, pipes and disks that are not as one wishes."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import click
import pytest
from click.shell_completion import ShellComplete

from irtwin.cli import cli
from irtwin.knowledge.store.table import AnswerTable
from irtwin.report.terminal import show
from tests.data_sets import irtwin, refused

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
        ["robot", "excite", "robot.urdf", "--out", "out.csv", "--seconds"],
        ["robot", "excite", "robot.urdf", "--out", "out.csv", "--seconds", "5", "--rate"],
        ["robot", "excite", "robot.urdf", "--out", "out.csv", "--seconds", "5", "--box", "0", "0", "0", "1", "1"],
        ["serve", "--timeout"],
        ["workspace", "map", "m.ttl", "--database", "sqlite://", "--out", "out.nq", "--timeout"],
    ],
    ids=lambda words: " ".join(words[:1] + words[-3:]),
)
def test_options_take_finite_numbers(arguments, value):
    assert "Invalid value for" in refused(*arguments, value)


ANSWER = AnswerTable(
    ("robot", "joint", "a_rather_long_name_W", "energy_J", "share_of_energy"),
    tuple(
        {"robot": "KUKA_KR6_R700", "joint": f"joint_{n}", "a_rather_long_name_W": -1.23456789e-5 * n}
        | {"energy_J": 1234567.0 + n, "share_of_energy": 0.123456 + n}
        for n in range(3)
    ),
)


def shown(monkeypatch, capsys, columns: int | None) -> str:
    for name in ("FORCE_COLOR", "COLUMNS", "NO_COLOR"):
        monkeypatch.delenv(name, raising=False)
    if columns is not None:
        monkeypatch.setenv("FORCE_COLOR", "1")  # as in a terminal
        monkeypatch.setenv("NO_COLOR", "1")
        monkeypatch.setenv("COLUMNS", str(columns))
    show(ANSWER)
    return capsys.readouterr().out


@pytest.mark.parametrize("columns", [None, 200, 80, 60, 40, 20])
def test_a_table_keeps_its_numbers_whole_however_narrow(monkeypatch, capsys, columns):
    lines = re.sub(r"\x1b\[[\d;]*m", "", shown(monkeypatch, capsys, columns)).splitlines()
    for row in ANSWER:
        for value in (row["a_rather_long_name_W"], row["energy_J"], row["share_of_energy"]):
            assert any(f"{value:.6g}" in line for line in lines)
    if columns is not None and columns >= 60:
        assert max(map(len, lines)) <= columns
    assert lines[-1] == "3 rows"


def test_a_pipe_gets_neither_colour_nor_folds(monkeypatch, capsys):
    told = shown(monkeypatch, capsys, None)
    assert "\x1b" not in told
    assert told.count("KUKA_KR6_R700 │ joint_") == 3


def test_no_color_is_heeded(monkeypatch, capsys):
    assert not re.search(r"\x1b\[[\d;]*[34]\d", shown(monkeypatch, capsys, 80))


def test_quiet_leaves_out_progress_and_verbose_says_where_a_mistake_was_noticed(tmp_path):
    usual, quiet = irtwin("diagnose", tmp_path), irtwin("diagnose", tmp_path, "--quiet")
    assert usual.err.splitlines()[-1:] == quiet.err.splitlines()
    assert len(usual.err.splitlines()) == 2
    wordy = irtwin("diagnose", tmp_path, "-v")
    assert "Traceback" in wordy.err
    assert wordy.err.splitlines()[-1] == usual.err.splitlines()[-1]
    assert (usual.status, quiet.status, wordy.status) == (2, 2, 2)


def test_every_command_can_be_quiet():
    def options(command: click.Command) -> list[set[str]]:
        if isinstance(command, click.Group):
            return [one for each in command.commands.values() for one in options(each)]
        return [{name for option in command.params for name in option.opts}]

    assert all({"-q", "--quiet", "-v", "--verbose"} <= names for names in options(cli))


def test_commands_and_questions_are_completed():
    found = ShellComplete(cli, {}, "irtwin", "_IRTWIN_COMPLETE").get_completions
    assert [each.value for each in found([], "diag")] == ["diagnose"]
    assert "energy_per_joint" in [each.value for each in found(["query"], "energy_per_j")]
