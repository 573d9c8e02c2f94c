"""The motion that a diagnosis proposes, as a file and in words."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from irtwin.document import form
from irtwin.document.curves import Curves
from irtwin.document.experiment import Experiment
from irtwin.effects.catalogue import catalogue
from irtwin.gap.diagnosis import Diagnosis
from irtwin.identification.programmes import ExperimentProgramme, programmes
from irtwin.proposed_motion import motion_text, save_motion
from irtwin.signals.samples import read_signals
from tests.synthetic import arm, swing

pytestmark = pytest.mark.slow

ROBOT = arm(2)
NOTHING = Curves(follows=(), runs=(), experiment=None)


@cache
def designed() -> dict[str, ExperimentProgramme]:
    asked = [catalogue()[name] for name in ("payload", "temperature_dependent_friction")]
    return {one.kind: one for one in programmes(ROBOT, (), [swing(ROBOT, 1)], asked)}


def experiment(programme: ExperimentProgramme | None, *by_hand: str) -> Experiment:
    return Experiment(
        purpose="tell one from the other",
        effects=("coulomb_friction", "payload"),
        joints=("joint_1",),
        motions=(*([programme.text] if programme else []), *by_hand),
        expected_separation=9.0 if programme else None,
        separation_now=1.0,
        separation_that_is_enough=5.0,
        questions=(),
        programme=programme.said if programme else None,
        considered=(),
        note=None,
    )


def found(programme: ExperimentProgramme | None, *by_hand: str, **changes: Any) -> Diagnosis:
    given: dict[str, Any] = {
        "description": ROBOT, "left_open": None, "channels": (), "floor": None, "locations": (), "untestable": (),
        "runs": (), "curves": NOTHING, "experiment": experiment(programme, *by_hand),
        "planned": programme.motions[0] if programme else None,
    }  # fmt: skip
    return Diagnosis(**{**given, **changes})


@pytest.mark.parametrize("kind", ["speed_ladder", "holding_poses", "exciting_motion", "payload", "warm_up"])
def test_the_file_is_the_programmes_motion(kind: str, tmp_path: Path) -> None:
    programme = designed()[kind]
    said = save_motion(found(programme), tmp_path / "next.csv")
    assert f"Play {tmp_path / 'next.csv'} on the robot, " in said
    read, _ = read_signals(tmp_path / "next.csv", ROBOT, measured=False)
    np.testing.assert_allclose(read.q, programme.motions[0].q, atol=1e-9)
    np.testing.assert_allclose(read.time, programme.motions[0].time, atol=1e-9)
    assert motion_text(found(programme)) == (tmp_path / "next.csv").read_text()


def test_load_warmth_and_what_is_taken_off_are_said(tmp_path: Path) -> None:
    said = save_motion(found(designed()["payload"]), tmp_path / "next.csv")
    mass = designed()["payload"].motions[1].payload_mass
    assert f"without load; with {mass:g} kg at the flange, as the controller is told (--payload-mass {mass:g}" in said
    said = save_motion(found(designed()["warm_up"]), tmp_path / "next.csv")
    assert "cold, joints at some 25 degC" in said
    assert "warm, after 30 minutes of work, joints at some 45 degC, their temperatures logged" in said
    (off,) = (one for kind, one in designed().items() if kind.startswith("without_"))
    assert "Play it with the tool off." in save_motion(found(off), tmp_path / "next.csv")


@pytest.mark.parametrize(
    ("by_hand", "said"),
    [(("hang a known mass",), "it is done by hand (hang a known mass)"), ((), "no motion helps (tell one from")],
)
def test_what_is_no_motion_is_said_in_words_alone(by_hand: tuple[str, ...], said: str, tmp_path: Path) -> None:
    assert said in save_motion(found(None, *by_hand), tmp_path / "next.csv")
    assert motion_text(found(None, *by_hand)) is None
    assert not list(tmp_path.iterdir())


def test_a_motion_that_the_robot_cannot_make_is_not_written(tmp_path: Path) -> None:
    programme = designed()["slow_sweep"]
    far = replace(programme.motions[0], q=9.0 * programme.motions[0].q)
    said = save_motion(found(programme, planned=far), tmp_path / "next.csv")
    assert "was not written, as the robot cannot make it: " in said
    assert "outside its limits" in said
    assert not list(tmp_path.iterdir())


def test_the_experiment_of_the_tests_is_one_of_a_document() -> None:
    for programme in designed().values():
        said = json.loads(json.dumps(form.to_json(experiment(programme))))
        assert form.from_json(Experiment, said, "next_experiment") == experiment(programme)
