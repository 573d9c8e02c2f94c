"""Every command line in the README and the guide is one that there is, with options that it has."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import click

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


def leaves(command: click.Command, name: str) -> Iterator[tuple[str, click.Command]]:
    """The commands below a group, by their whole name."""
    if isinstance(command, click.Group):
        for each in command.commands.values():
            yield from leaves(each, f"{name} {each.name}")
    else:
        yield name, command


def examples(command: click.Command) -> list[str]:
    return re.findall(r"Example: (.+)", command.help or "")


LEAVES = dict(leaves(cli, "irtwin"))
COMMANDS = [(page, line) for page in PAGES for line in lines(page)]
COMMANDS += [(f"{name} --help", line) for name, command in LEAVES.items() for line in examples(command)]


def test_a_command_that_is_told_is_there() -> None:
    assert [f"{page}: {line}: {wrong}" for page, line in COMMANDS if (wrong := fault(line))] == []


def fault(line: str) -> str:
    """What is wrong with a command line: no such command, or options that it does not have."""
    words = shlex.split(line.partition(" > ")[0].partition(" < ")[0])[1:]
    command: click.Command = cli
    while isinstance(command, click.Group) and words and words[0] in command.commands:
        command = command.commands[words.pop(0)]
    if command is cli and not words[0].startswith(("-", "FILE", "COMMAND", "my_")):
        return "no such command"
    known = {name for option in command.params for name in (*option.opts, *option.secondary_opts)} | {"--help"}
    told = [word.partition("=")[0] for word in words if re.match(r"--?[a-z]", word)]
    return " ".join(option for option in told if option not in known | {"-h"})


def test_each_command_gives_an_example_of_itself() -> None:
    assert [
        name for name, one in LEAVES.items() if f"{name} " not in "".join(f"{line} " for line in examples(one))
    ] == []


def test_there_are_few_commands_at_the_top_and_all_are_told() -> None:
    assert len(cli.commands) <= 18
    assert {line.split()[1] for _, line in COMMANDS} >= set(cli.commands)
