"""The exceptions that are no bugs: a user's mistake, and a place that cannot be used just now."""

from __future__ import annotations


class InputError(Exception):
    """A user's mistake: one line that says where, what is wrong, and what to do.

    The command line prints it on standard error and exits with status 2. Everything else that is
    raised is a bug and keeps its traceback.
    """


class WorkspaceFault(InputError):
    """The workspace, or what it is kept in, cannot be used just now, whatever was given.

    Its disk is full, its server or storage is away, another process writes, or it is damaged. Once that is mended, the
    same input may do.
    """


class GraphBehind(UserWarning):
    """The graph that answers lacks some of what the database holds, or of what follows from it: one line says why."""


def first_line(error: BaseException) -> str:
    """Return what a library said of a fault, short enough for a message; its kind where it said nothing."""
    return (str(error).strip() or type(error).__name__).splitlines()[0][:200]
