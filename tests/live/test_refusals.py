"""Each reason to refuse a line is told once, with the seconds of the first; all are counted."""

from __future__ import annotations

from irtwin.errors import InputError
from irtwin.live.stream_clock import WrongTime
from irtwin.live.watch import _MOST_REASONS, RefusedLines


def test_a_reason_is_told_once() -> None:
    lines: list[str] = []
    refusals = RefusedLines(lines.append)
    for error in (
        InputError("no JSON"),
        WrongTime("arm: late", 0.02),
        WrongTime("arm: late", 3.0),
        InputError("no JSON"),
    ):
        refusals.refuse(error)
    assert lines == ["line refused: no JSON", "line refused: arm: late, by 0.02 s; not stored"]
    assert refusals.count == 4


def test_reasons_without_end_are_counted_alone() -> None:
    lines: list[str] = []
    refusals = RefusedLines(lines.append)
    for number in range(3 * _MOST_REASONS):
        refusals.refuse(InputError(f"no robot {number}"))
    assert (len(lines), refusals.count) == (_MOST_REASONS, 3 * _MOST_REASONS)
