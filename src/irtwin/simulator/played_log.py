"""A log's commands played through a model as it is: how far it is from the robot, without anything fitted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from irtwin.document.form import to_json
from irtwin.signals.log import DataSet
from irtwin.simulator.model import Model
from irtwin.simulator.playing import clipping, commanded_runs
from irtwin.simulator.servos import servos
from irtwin.simulator.tracking import Tracked, restarted, tracked

OfJoint = Mapping[str, float]


@dataclass(frozen=True)
class PlayedRun:
    """A run played as a whole: RMSE of each joint's position, rad (m), of the flange's place, m, of torque, N m (N).

    Of torque and energy None where no torque was logged.
    """

    run: str
    position_rmse: OfJoint
    flange_rmse: float
    torque_rmse: OfJoint | None
    energy_error_percent: float | None


@dataclass(frozen=True)
class HorizonError:
    """The RMSE of positions, rad (m), up to so many `seconds` after the model was put where the robot is."""

    seconds: float
    position_rmse: float


@dataclass(frozen=True)
class PlayedLog:
    """A log played through a model, freely (`runs`) and begun anew each half second (`horizons`)."""

    robot: str
    simulator: str
    runs: tuple[PlayedRun, ...]
    horizons: tuple[HorizonError, ...]

    def to_json(self) -> dict[str, object]:
        """Return it as JSON."""
        told: dict[str, object] = to_json(self)
        return told


def play_log(data_set: DataSet, model: Model) -> PlayedLog:
    """Play the commands of the observed runs through a model. Raises InputError where `playing.diagnose` does."""
    runs, own = commanded_runs(data_set), servos(model)
    clipping(own, runs)
    numbers = {run.name: own.numbers for run in runs}
    played = tracked(data_set.robot, own, runs, numbers)
    return PlayedLog(
        data_set.robot.name,
        model.name,
        tuple(_run(run.name, data_set.robot.joint_names, track) for run, track in zip(runs, played, strict=True)),
        tuple(HorizonError(*error) for error in restarted(own, runs, numbers).items()),
    )


def _run(name: str, joints: tuple[str, ...], track: Tracked) -> PlayedRun:
    position, *torque = (dict(zip(joints, np.sqrt(squares).tolist(), strict=True)) for squares in track.squares)
    return PlayedRun(name, position, track.flange, torque[0] if torque else None, track.energy_error)
