"""The twin of the KR 6 R700 that ships, from the logs of its plant."""

from __future__ import annotations

import shutil

import pytest

from irtwin.identification.validation import split
from irtwin.resources import folder
from irtwin.signals.conditioning import choose_cutoff, condition
from irtwin.signals.log import read_data_set
from irtwin.twin.identify import identify
from irtwin.twin.validate import validate

NAME = "kuka_kr6_r700"


@pytest.fixture(scope="module")
def fits(tmp_path_factory):
    place = tmp_path_factory.mktemp("demo") / NAME
    shutil.copytree(folder("demo") / NAME, place)
    shutil.copy(folder("ontology") / "robots" / f"{NAME}.urdf", place / "robot.urdf")
    data_set = read_data_set(place)
    cutoff = choose_cutoff(data_set.runs)
    motions = [condition(run, data_set.robot, cutoff) for run in data_set.runs]
    parts = split(motions, {run.name: run.repeat_of for run in data_set.runs if run.repeat_of})
    return validate(identify(data_set.robot, parts.fit, data_set.effects), parts.held_out)


@pytest.mark.slow
def test_energy_of_runs_held_out_is_closer_than_the_seed_papers(fits):
    assert len(fits) >= 4
    assert max(fit.energy_error for fit in fits) < 6.54  # % (Yan 2018, eq. 15)


def test_torque_of_exciting_motions_held_out(fits):
    exciting = [fit for fit in fits if fit.run.startswith("exciting")]
    assert min(fit.r_squared.min() for fit in exciting) > 0.97
