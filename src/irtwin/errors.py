"""The one exception that means a user's mistake."""

from __future__ import annotations


class InputError(Exception):
    """A user's mistake: one line that says where, what is wrong, and what to do.

    The command line prints it on standard error and exits with status 2. Everything else that is
    raised is a bug and keeps its traceback.
    """
