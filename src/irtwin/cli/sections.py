"""The group of all commands: its help is in sections, and a file in a command's place is told what it is for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import click

from irtwin.errors import InputError

_WHOLE = 1000  # characters: a sentence is wrapped, not cut


class Sections(click.Group):
    """A group whose help lists commands by what people do, and which answers `irtwin FILE`.

    `renamed` says of names that commands had before what they are called now: by these they still do what they did.
    `replaced` says what takes the place of commands that asked otherwise.
    """

    def __init__(
        self,
        *arguments: Any,
        sections: Mapping[str, Sequence[click.Command]],
        renamed: Mapping[str, str],
        replaced: Mapping[str, str],
        **named: Any,
    ) -> None:
        super().__init__(*arguments, **named)
        self._sections, self._renamed, self._replaced = sections, renamed, replaced
        for command in (listed for commands in sections.values() for listed in commands):
            self.add_command(command)

    def format_commands(self, context: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the commands, a section after the other."""
        for title, commands in self._sections.items():
            with formatter.section(title):
                formatter.write_dl([(str(command.name), command.get_short_help_str(_WHOLE)) for command in commands])

    def resolve_command(
        self, context: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the command that is asked for: of a file's name, one that says what the file is for.

        Raises InputError for a command that was replaced, and for one that is none.
        """
        if now := self._replaced.get(args[0]):
            raise InputError(f"`irtwin {args[0]}` is now `irtwin {now}`")
        if now := self._renamed.get(args[0]):
            click.echo(f"irtwin: `irtwin {args[0]}` is now `irtwin {now}`", err=True)
            return super().resolve_command(context, [*now.split(), *args[1:]])
        if args[0] in self.commands:
            return super().resolve_command(context, args)
        if (path := Path(args[0])).exists():
            return None, click.Command("file", callback=lambda: _tell(path)), args[1:]
        near = "".join(f"did you mean `irtwin {name}`? " for name in get_close_matches(args[0], self.commands, 1))
        raise InputError(f"there is no command and no file `{args[0]}`; {near}`irtwin --help` lists the commands")


def _tell(path: Path) -> None:
    from irtwin.file_kind import file_kind

    kind = file_kind(path)
    click.echo(f"{path}: {kind.what}")
    for command, why in kind.commands:
        click.echo(f"  {command}\n      {why}")
