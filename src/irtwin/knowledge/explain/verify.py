"""Are the files that an explanation ends in still those that were read? Their checksums, worked out again."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path

from irtwin.input_file import checksum
from irtwin.knowledge.explain.explanation import LEFT_OUT, Explanation
from irtwin.storage.files import inside

WHOLE, CHANGED, MISSING, UNKNOWN = "whole", "changed", "missing", "cannot be checked"


@dataclass(frozen=True)
class Verdict:
    """A file, what became of it since it was read, and why that is not known where it is not."""

    file: str
    state: str
    why: str | None = None

    @property
    def is_wrong(self) -> bool:
        """Whether the file is not what it was, or nobody looked at it."""
        return self.state in (CHANGED, MISSING, LEFT_OUT)

    def __str__(self) -> str:
        return f"{self.state}: {self.file}{f' ({self.why})' if self.why else ''}"


def verify(explanations: Collection[Explanation], workspace: Path) -> list[Verdict]:
    """Return what became of each file that explanations name, in their order; each once."""
    files = dict.fromkeys(
        (part.folder, part.file, part.checksum)
        for explanation in explanations
        for part in _all(explanation)
        if part.file
    )
    left_out = [
        Verdict(part.what, LEFT_OUT)
        for explanation in explanations
        for part in _all(explanation)
        if part.by == LEFT_OUT
    ]
    return [*(_verdict(workspace, folder, file, known) for folder, file, known in files), *left_out]


def _all(explanation: Explanation) -> Iterator[Explanation]:
    yield explanation
    for premise in explanation.because:
        yield from _all(premise)


def _verdict(workspace: Path, folder: str | None, file: str, known: str | None) -> Verdict:
    if known is None:
        return Verdict(file, UNKNOWN, "it is part of irtwin, which keeps no checksum of it")
    base = workspace if folder is None else Path(folder)
    path = inside(workspace, file) if folder is None else base / file
    if not base.is_dir():
        holder = "the workspace" if folder is None else "its data set"
        return Verdict(str(path), UNKNOWN, f"{holder} is not at {base}; take it in again from where it is")
    if not path.exists():
        return Verdict(str(path), MISSING)
    if not (path.is_file() or path.is_dir()):
        return Verdict(str(path), UNKNOWN, "it is no plain file")
    try:
        now = checksum(path)
    except OSError as error:
        return Verdict(str(path), UNKNOWN, f"it cannot be read: {error.strerror}")
    return Verdict(str(path), WHOLE) if now == known else Verdict(str(path), CHANGED, f"sha256 is now {now}")
