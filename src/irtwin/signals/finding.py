"""What is wrong with a log, as `irtwin check` says it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True)
class LogFinding:
    """One fault of a log.

    fault: its kind, "sign", "swap", "unit", ...; channel: the column as in the log, "a <-> b" for two that are swapped,
    a key of dataset.toml, or robot.urdf; certain: the data leave no other reading; mended: what is used from here on is
    mended, never the user's file; say: one sentence, what, how it shows, what to do.
    """

    fault: str
    channel: str
    runs: tuple[str, ...]
    certain: bool
    mended: bool
    evidence: Mapping[str, float]
    say: str

    @property
    def stops(self) -> bool:
        """Whether it must be cured before anything is made of the log."""
        return self.certain and not self.mended

    def to_json(self) -> dict[str, Any]:
        """Return it as it stands in the file of `irtwin check --json`."""
        return {**asdict(self), "runs": list(self.runs), "evidence": dict(self.evidence)}
