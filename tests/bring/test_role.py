"""Whose logs those are that are brought."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from tests.bring.dialects import NAME, good, per_joint, write_text
from tests.data_sets import irtwin_does

from irtwin.bring.bring import import_logs
from irtwin.bring.told import roles
from irtwin.errors import InputError
from irtwin.signals.log import read_data_set

FILES = [Path("a/sim_1.csv"), Path("a/sim_2.csv"), Path("b/robot.csv")]


@pytest.mark.parametrize(
    ("said", "expected"),
    [
        ([], ["observed"] * 3),
        (["simulated"], ["simulated"] * 3),
        (["sim_*=simulated"], ["simulated", "simulated", "observed"]),
        (["a/*=simulated", "sim_2.csv=reference"], ["simulated", "reference", "observed"]),
    ],
)
def test_a_file_has_the_role_that_is_said_last(said, expected):
    assert list(roles(FILES, said).values()) == expected


@pytest.mark.parametrize(
    ("said", "message"),
    [
        ("model", "--role model: give ROLE or FILE=ROLE, where ROLE is observed, reference, simulated, planned"),
        ("sim_1.csv=", "--role sim_1.csv=: give ROLE or FILE=ROLE"),
        ("sim=simulated", "--role sim=simulated: no such file is brought; there are a/sim_1.csv, a/sim_2.csv"),
    ],
)
def test_a_role_of_nothing_is_refused(said, message):
    with pytest.raises(InputError, match=re.escape(message)):
        roles(FILES, [said])


@pytest.mark.slow
def test_a_simulators_logs_are_brought_beside_the_robots(tmp_path):
    columns = {"time": good()["time"]} | per_joint("q", "pos{}") | per_joint("tau", "trq{}")
    files = [write_text(tmp_path / f"{name}.csv", columns) for name in ("robot", "sim")]
    said = irtwin_does("import", *files, "--robot", NAME, "--role", "sim.csv=simulated", "--out", tmp_path / "set")
    assert f"; then: irtwin diagnose {tmp_path / 'set'}\n" in said.err
    runs = {run.name: run.role for run in read_data_set(tmp_path / "set").runs}
    assert runs == {"robot": "observed", "sim": "simulated"}
    again = import_logs(files, tmp_path / "again", NAME, roles=("reference",))
    assert {run.role for run in again.runs} == {"reference"}
