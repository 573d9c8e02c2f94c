"""Every command line in the README and the guide is one that there is, with options that it has."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import click
import pytest

from irtwin.cli.command_line import cli

ROOT = Path(__file__).parents[2]
PAGES = ("README.md", "docs/USING.md", "docs/LOG_FORMAT.md", "docs/ALARMS.md", "CONTRIBUTING.md")
PAGES += tuple(f"docs/tutorials/{file.name}" for file in sorted((ROOT / "docs" / "tutorials").glob("*.md")))


def lines(page: str) -> list[str]:
    """The commands of a page, in its blocks and in its sentences, without comments."""
    text = (ROOT / page).read_text(encoding="utf-8")
    blocks = [
        line
        for block in re.findall(r"^```sh\n(.*?)^```", text.replace("\\\n", ""), re.S | re.M)
        for line in block.splitlines()
    ]
    within = re.findall(r"`(irtwin [^`]+)`", text.replace("\n", " "))
    commands = [part.strip() for line in blocks + within for part in re.split(r"\s#\s|&&|\s#$", line)[0:2]]
    return sorted({one for one in commands if one.startswith("irtwin ")})


COMMANDS = [(page, line) for page in PAGES for line in lines(page)]


@pytest.mark.parametrize(("page", "line"), COMMANDS)
def test_a_command_that_is_told_is_there(page: str, line: str) -> None:
    words = shlex.split(line.partition(" > ")[0].partition(" < ")[0])[1:]
    command: click.Command = cli
    while isinstance(command, click.Group) and words and words[0] in command.commands:
        command = command.commands[words.pop(0)]
    assert command is not cli or words[0].startswith(("-", "FILE", "COMMAND", "my_")), f"{page}: no such command"
    known = {name for option in command.params for name in (*option.opts, *option.secondary_opts)} | {"--help"}
    told = [word.partition("=")[0] for word in words if re.match(r"--?[a-z]", word)]
    assert [option for option in told if option not in known | {"-h"}] == [], f"{page}: {line}"


def test_there_are_commands_to_look_at() -> None:
    assert len({line.split()[1] for _, line in COMMANDS}) > 25
