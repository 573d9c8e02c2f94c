"""Measured against modelled, sample by sample: what the run selector of a page draws."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa

from irtwin.errors import InputError
from irtwin.packing import Samples, extremes, pack
from irtwin.report.questions import Answers, Row
from irtwin.signals.channels import CHANNELS

ReadSeries = Callable[[str, str], pa.Table]  # path in the workspace, checksum

_POINTS = 2_000  # a curve, more than a screen is wide
_FEWEST = 300
_BUDGET = 160_000  # points of all charts of all runs: about 1.3 MB of page
_JOULES = 3600.0  # of a Wh

_TORQUE, _POWER = CHANNELS["torque"], CHANNELS["power"]
_MODEL = "_model"
_HELD_OUT = "held_out"
PLANNED = "planned"  # part of a run that did not take place


@dataclass(frozen=True)
class Columns:
    """A modelled series as columns of samples, (N,) each; NaN where a sample is absent."""

    samples: dict[str, Samples]

    @classmethod
    def of(cls, table: pa.Table) -> Columns:
        """Take the columns of a Parquet table."""
        named = zip(table.column_names, table.columns, strict=True)
        return cls({name: column.to_numpy().astype(float) for name, column in named})

    def __getitem__(self, name: str) -> Samples:
        if name not in self.samples:
            raise InputError(f"the series of a run has no column {name!r}; run the robot's data set again")
        return self.samples[name]

    def get(self, name: str) -> Samples | None:
        """Return a column, or None where it is absent or holds no number."""
        column = self.samples.get(name)
        return None if column is None or np.isnan(column).all() else column

    @property
    def joints(self) -> tuple[str, ...]:
        """Joints whose torque was modelled, in the order of the columns."""
        before = _TORQUE.column("")
        return tuple(
            name.removeprefix(before).removesuffix(_MODEL)
            for name in self.samples
            if name.startswith(before) and name.endswith(_MODEL)
        )


def _opening_run(answers: Answers) -> int:
    """Return the place of the modelled series to show first: of held-out runs, that which takes the most energy."""
    rows, rank = answers["modelled_series"].rows, {"held_out": 2, "both": 1}
    energies = {row["run"]: row["modelled_j"] for row in answers["energy_per_run"].rows}
    keys = [(rank.get(row["part"], 0), energies.get(row["run"], 0.0)) for row in rows]
    return keys.index(max(keys))


def explorer(answers: Answers, read_series: ReadSeries) -> dict[str, Any] | None:
    """Return the packed curves of every modelled run, None where there is none.

    The charts of a run are its joint torques, power and energy used so far, with their units, each measured (where it
    was) and modelled, over the time (s) since the run began. Torque that was not measured is drawn of a plan alone.
    """
    rows = answers["modelled_series"].rows
    if not rows:
        return None
    runs = [(row, Columns.of(read_series(row["file"], row["checksum"]))) for row in rows]
    charts = sum(len(columns.joints) + 2 for _, columns in runs)
    points = int(np.clip(_BUDGET // charts, _FEWEST, _POINTS))
    kinds = {row["joint"]: row["kind"] for row in answers["joints"].rows}
    return {
        "runs": [_run(row, columns, points, kinds) for row, columns in runs],
        "opens": _opening_run(answers),
        "points": points,
    }


def _run(row: Row, columns: Columns, points: int, kinds: Mapping[str, str | None]) -> dict[str, Any]:
    torques = [
        _chart(columns, _TORQUE.column(joint), joint, _TORQUE.unit_of(kinds.get(joint) or ""), points)
        for joint in columns.joints
        if row["part"] == PLANNED or columns.get(_TORQUE.column(joint)) is not None
    ]
    return {
        "name": row["run_name"],
        "part": row["part"],
        "held_out": _held_out(row, columns),
        "torque": torques,
        "power": _chart(columns, _POWER.prefix, "power", _POWER.unit, points),
        "energy": _chart(columns, "energy", "energy used so far", "Wh", points, _JOULES),
    }


def _chart(
    columns: Columns, name: str, title: str, unit: str, points: int, per_unit: float = 1.0
) -> dict[str, Any] | None:
    modelled, measured = (
        None if values is None else values / per_unit for values in (columns.get(f"{name}{_MODEL}"), columns.get(name))
    )
    if modelled is None:
        return None
    time = columns["time"] - columns["time"][0]
    signals: Sequence[Samples] = [modelled] if measured is None else [measured, modelled]
    kept = extremes(signals, points)
    return {
        "title": title,
        "unit": unit,
        "time": pack(time[kept]),
        "measured": None if measured is None else pack(measured[kept]),
        "modelled": pack(modelled[kept]),
    }


def _held_out(row: Row, columns: Columns) -> list[list[float]]:
    """Return the stretches of time [start, end] (s since the run began) that took no part in the fit."""
    time = columns["time"] - columns["time"][0]
    marks = columns.get(_HELD_OUT)
    if marks is None:
        return [[0.0, round(float(time[-1]), 3)]] if row["part"] == "held_out" else []
    edges = np.flatnonzero(np.diff(np.concatenate([[0.0], marks > 0.5, [0.0]])))
    ends = np.minimum(edges, len(time) - 1)
    return [[round(float(time[a]), 3), round(float(time[b]), 3)] for a, b in ends.reshape(-1, 2)]
