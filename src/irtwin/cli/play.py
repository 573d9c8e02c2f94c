"""A log that was played through a simulator's model, in the terminal."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from irtwin.knowledge.store.table import AnswerTable, Row
    from irtwin.simulator.played_log import PlayedLog

_TRACKING, _TORQUE = "tracking error, rad (m)", "torque, N m (N)"


def tell(played: PlayedLog) -> None:
    """Print how far the model is from the robot: by run, by joint, and by how long ago it was where the robot is."""
    from irtwin.report.terminal import show

    for place, rows in enumerate((_runs(played), _joints(played), _horizons(played))):
        if place:
            click.echo()
        show(_table(rows), counted=False)


def _runs(played: PlayedLog) -> list[Row]:
    return [
        {
            "run": run.run,
            _TRACKING: _together(run.position_rmse.values()),
            "flange, m": _together([run.flange_rmse]),
            _TORQUE: _together((run.torque_rmse or {}).values()),
            "energy error, %": None if run.energy_error_percent is None else _short(run.energy_error_percent),
        }
        for run in played.runs
    ]


def _joints(played: PlayedLog) -> list[Row]:
    with_torque = [run.torque_rmse for run in played.runs if run.torque_rmse]
    return [
        {
            "joint": joint,
            _TRACKING: _together(run.position_rmse[joint] for run in played.runs),
            _TORQUE: _together(torque[joint] for torque in with_torque),
        }
        for joint in played.runs[0].position_rmse
    ]


def _horizons(played: PlayedLog) -> list[Row]:
    return [
        {"s since it was begun anew": horizon.seconds, _TRACKING: _short(horizon.position_rmse)}
        for horizon in played.horizons
    ]


def _table(rows: list[Row]) -> AnswerTable:
    """Return rows as a table, without the columns that are empty."""
    from irtwin.knowledge.store.table import AnswerTable

    columns = tuple(column for column in rows[0] if any(row[column] is not None for row in rows))
    return AnswerTable(columns, tuple(rows))


def _together(errors: Iterable[float]) -> float | None:
    squares = [error**2 for error in errors]
    return _short(math.sqrt(sum(squares) / len(squares))) if squares else None


def _short(value: float) -> float:
    return float(f"{value:.3g}")
