"""What cannot be told from a log alone."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass

from irtwin.errors import InputError


@dataclass(frozen=True)
class WayOut:
    """A way out: `label` says it in words, `options` on the command line, each (option, value)."""

    label: str
    options: tuple[tuple[str, str], ...]

    @property
    def text(self) -> str:
        """The options as they are typed."""
        return " ".join(f"{name} {shlex.quote(value)}" for name, value in self.options)


class DoubtError(InputError):
    """A question to the user. Where nobody can be asked it ends the command, and its message says what to give."""

    def __init__(self, question: str, answers: Sequence[WayOut]) -> None:
        self.question, self.answers = question, tuple(answers)
        ways = " or ".join(answer.text for answer in answers)
        super().__init__(f"{question}; give {ways}")
