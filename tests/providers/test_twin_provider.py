"""The provider of twins: which runs a robot's twin is fitted to."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from tests.synthetic import arm, as_run, measure, swing, with_constants

from irtwin.providers import identification
from irtwin.providers.provider import Made
from irtwin.providers.records import ingest
from irtwin.robot.description import Robot
from irtwin.signals.log import DataSet
from irtwin.signals.motion import Motion
from irtwin.storage import schema
from irtwin.storage.database import Workspace
from irtwin.twin.files import from_json
from irtwin.twin.identify import identify
from irtwin.twin.validate import validate


def provided(folder: Path, robot: Robot, motions: list[Motion], roles: list[str] | None = None, **said: Any) -> Made:
    """What is made of a robot's runs with these roles, whose data set says some more."""
    roles = roles or ["observed"] * len(motions)
    runs = tuple(replace(as_run(motion), role=role) for motion, role in zip(motions, roles, strict=True))
    told = replace(DataSet(Path(), robot, runs, None, None, "mains", False, {}), **said)
    with Workspace(folder) as workspace:
        ingest(workspace, told)
        return identification.provide(workspace, robot.name)


def measured(robot: Robot, count: int) -> list[Motion]:
    return [measure(robot, swing(robot, seed, seconds=6.0), noise=0.05) for seed in range(count)]


def parts(folder: Path, roles: list[str]) -> dict[str, str]:
    """The part that each run takes in the twin of a robot whose runs have these roles."""
    robot = with_constants(arm(2))
    made = provided(folder, robot, measured(robot, len(roles)), roles, simulated=True)
    return {row.run_id[-1]: row.part for row in made.rows if isinstance(row, schema.TwinRun)}


def test_a_simulators_runs_stay_apart_from_the_robots_twin(tmp_path: Path) -> None:
    assert parts(tmp_path, ["observed", "observed", "simulated"]) == {"0": "both", "1": "both", "2": "apart"}


def test_a_robot_known_by_its_simulator_alone_has_a_twin_of_that(tmp_path: Path) -> None:
    assert set(parts(tmp_path, ["simulated", "simulated"]).values()) == {"both"}


def test_base_parameters_are_counted_that_the_bodies_have() -> None:
    """An arm whose first axis is upright shows one of its first body, and seven of the second (Gautier and Khalil)."""
    robot = arm(2)
    twin = identify(robot, [measure(robot, swing(robot, 0, seconds=6.0))])
    assert identification.body_combinations(twin) == 8 < len(twin.base_parameters)
    assert identification.body_combinations(replace(twin, base_parameters=())) is None


def test_a_run_that_takes_no_energy_has_no_relative_error(tmp_path: Path) -> None:
    robot = with_constants(arm(1))
    dead = [replace(measure(robot, swing(robot, k, seconds=6.0)), power=np.zeros(600)) for k in range(2)]
    made = provided(tmp_path, robot, dead, simulated=True)
    assert all(np.isfinite(row.value) for row in made.rows if isinstance(row, schema.ParameterRow))
    (twin,) = made.documents.values()
    (fit,) = validate(from_json(twin.decode(), Path("twin.json")), dead[:1])
    assert fit.measured_energy == 0
    assert fit.energy_error is None


def weighed(folder: Path, **said: object) -> tuple[schema.TwinRow, list[schema.ParameterRow], dict[str, object]]:
    """The twin of a robot whose data set says some more: its row, its parameters and its file."""
    robot = with_constants(arm(1))
    made = provided(folder, robot, measured(robot, 2), **said)
    (row,) = (row for row in made.rows if isinstance(row, schema.TwinRow))
    (document,) = made.documents.values()
    return row, [row for row in made.rows if isinstance(row, schema.ParameterRow)], json.loads(document)


def test_a_twin_says_how_sure_the_scale_of_its_torque_is(tmp_path: Path) -> None:
    row, parameters, document = weighed(tmp_path, notes={"torque_scale_uncertainty": 0.05})
    assert row.torque_scale_uncertainty == document["torque_scale"]["uncertainty"] == 0.05
    assert row.torque_scale_why == "The scale of torque is uncertain by 5 %: the data set states it"
    friction = next(one for one in parameters if one.name == "Fv")
    assert friction.scaled_lower < min(friction.lower, friction.value / 1.04)
    assert friction.scaled_upper > max(friction.upper, 1.04 * friction.value)
    assert all(one.scaled_lower is None for one in parameters if one.unit == "W")
    written = next(one for one in document["parameters"] if one["name"] == "Fv")
    assert (written["lower"], written["upper"]) == (friction.lower, friction.upper)


def test_a_twin_says_a_cutoff_that_was_stated(tmp_path: Path) -> None:
    row, _, document = weighed(tmp_path, cutoff=7.25)
    assert row.cutoff_hz == document["cutoff"] == 7.25
    assert row.cutoff_why == "stated"


def test_a_simulators_torque_has_a_scale_that_is_exact(tmp_path: Path) -> None:
    row, parameters, _ = weighed(tmp_path, simulated=True)
    assert row.torque_scale_uncertainty == 0.0
    assert all(one.scaled_lower is None for one in parameters)
