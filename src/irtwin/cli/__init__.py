"""The command line: arguments in, one call, its result shown. One file a theme."""

from irtwin.cli.command_line import cli, main

__all__ = ["cli", "main"]
