"""The samples of a log that can be used: every channel at the times of the positions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from irtwin.bring.column_name import Meaning
from irtwin.bring.recording import Recording
from irtwin.errors import InputError
from irtwin.signals.holes import known_at
from irtwin.signals.samples import FEWEST


@dataclass(frozen=True)
class Aligned:
    """Columns (N,) of a log, in its own units; `time` as float64, int64 or datetime64[ns]; `said`: what was done."""

    recording: Recording
    time: np.ndarray
    columns: Mapping[str, np.ndarray]
    said: tuple[str, ...]


def aligned(recording: Recording, meanings: Sequence[Meaning], *, repair: bool) -> Aligned:
    """Return the columns in use, at rows that have a time and all positions; blanks are joined by straight lines.

    A row that repeats the one before is left out. Raises InputError where a column is blank, a value infinite, or time
    does not rise; with `repair` samples whose time does not rise are dropped.
    """
    path = recording.path
    time_name = next(meaning.column for meaning in meanings if meaning.field == "time")
    raw = recording.columns[time_name]
    used = {
        meaning.column: _numbers(recording, meaning.column)
        for meaning in meanings
        if meaning.field not in (None, "time")
    }
    positions = [meaning.column for meaning in meanings if meaning.field == "q"]
    keep = ~(np.isnat(raw) if raw.dtype.kind == "M" else np.isnan(raw.astype(float)))
    for column in positions:
        keep &= np.isfinite(used[column])
    notes = []
    if (count := int((~keep).sum())) and keep.any():
        first = recording.place(int(np.flatnonzero(~keep)[0]))
        notes.append(
            f"{path}: {count} of {len(keep)} rows left out, the first {first}: a position or the time is blank"
        )
    again = _written_twice(recording, keep)
    if again.any():
        first = recording.place(int(np.flatnonzero(again)[0]))
        notes.append(
            f"{path}: {int(again.sum())} rows left out, the first {first}: they repeat the row before, time and all"
        )
        keep &= ~again
    keep, dropped = _rising(recording, raw, keep, time_name, repair)
    notes += dropped
    for column, values in used.items():
        if column in positions:
            continue
        blank = int((~np.isfinite(values) & keep).sum())
        if not blank:
            continue
        used[column], heard = _joined(raw, values, keep)
        unheard = int((keep & ~heard).sum())
        notes.append(
            f"{path}: column {column} is blank at {blank} samples; straight lines join its values"
            + (f", and {unheard} samples before, after or far between them are left out" if unheard else "")
        )
        keep &= heard
    if int(keep.sum()) < FEWEST:
        raise InputError(f"{path}: {int(keep.sum())} samples can be used; a run needs at least {FEWEST}")
    return Aligned(recording, raw[keep], {name: values[keep] for name, values in used.items()}, tuple(notes))


def _numbers(recording: Recording, column: str) -> np.ndarray:
    values = recording.columns[column]
    if values.dtype.kind == "M":
        raise InputError(f"{recording.path}: column {column} holds times; leave it out: --map '{column}=-'")
    numbers = values.astype(float)
    if np.isinf(numbers).any():
        row = int(np.flatnonzero(np.isinf(numbers))[0])
        raise InputError(f"{recording.path}, {recording.place(row)}, column {column}: is not finite; correct it")
    if np.isnan(numbers).all():
        raise InputError(f"{recording.path}: column {column} is blank throughout; leave it out: --map '{column}=-'")
    return numbers


def _written_twice(recording: Recording, keep: np.ndarray) -> np.ndarray:
    """Return the rows that repeat the one before to the last digit: a recorder was faster than what it records."""
    same = np.zeros(len(keep), dtype=bool)
    same[1:] = keep[1:] & keep[:-1]
    for values in recording.columns.values():
        numbers = values.astype("int64") if values.dtype.kind == "M" else values
        same[1:] &= (numbers[1:] == numbers[:-1]) | ((numbers[1:] != numbers[1:]) & (numbers[:-1] != numbers[:-1]))
    return same


def _rising(
    recording: Recording, raw: np.ndarray, keep: np.ndarray, column: str, repair: bool
) -> tuple[np.ndarray, list[str]]:
    """Return which of the rows to keep so that time rises. Raises InputError where it does not, without `repair`."""
    rows = np.flatnonzero(keep)
    time = raw[rows].astype("int64") if raw.dtype.kind == "M" else raw[rows]
    if len(time) < 2:
        return keep, []
    bad = np.concatenate([[False], time[1:] <= np.maximum.accumulate(time)[:-1]])
    if not bad.any():
        return keep, []
    place = f"{recording.path}, {recording.place(int(rows[bad][0]))}, column {column}"
    if bad[1:].all():
        raise InputError(f"{place}: time falls from row to row; its sign is wrong, or the log is in reversed order")
    if not repair:
        raise InputError(
            f"{place}: time does not rise ({int(bad.sum())} such samples of {len(time)}); sort the log, "
            "or use --repair to drop them"
        )
    kept = keep.copy()
    kept[rows[bad]] = False
    return kept, [f"{place}: time does not rise here; {int(bad.sum())} such samples dropped"]


def _joined(raw: np.ndarray, values: np.ndarray, keep: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return a column with its blanks joined, and where it is known: not before, after, or in a hole of its own."""
    start = raw[np.flatnonzero(keep)[0]]
    time = (raw - start).astype("int64").astype(float) if raw.dtype.kind == "M" else (raw - start).astype(float)
    there = np.flatnonzero(np.isfinite(values) & np.isfinite(time))
    order = there[np.argsort(time[there], kind="stable")]
    own = time[order]
    result = np.where(np.isfinite(values), values, np.interp(time, own, values[order]))
    return result, known_at(time, own)
