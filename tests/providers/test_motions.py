"""The motions that providers share: one conditioning, one cutoff."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sqlalchemy import select
from tests.providers.test_gap_provider import NOTHING, diagnosis, shrink
from tests.rows import keep
from tests.synthetic import arm, as_run, measure, swing, with_constants

from irtwin.document.document import Cutoff
from irtwin.providers import energy, identification, motions, run_state
from irtwin.providers.gap import adopt, record
from irtwin.providers.motions import robot_motions
from irtwin.providers.names import robot_iri, run_iri
from irtwin.providers.records import ingest
from irtwin.signals import conditioning
from irtwin.signals.conditioning import choose_cutoff
from irtwin.signals.log import DataSet, Run
from irtwin.signals.motion import Motion
from irtwin.storage import schema
from irtwin.storage.database import Workspace
from irtwin.twin.files import from_json, to_json
from irtwin.twin.identify import identify

ROBOT = with_constants(arm(2))
NAME = ROBOT.name
EFFECTS = ("rigid_body", "viscous_friction", "coulomb_friction")
WHY = "found: by the band"


def slow_and_fast() -> tuple[Run, ...]:
    """Three runs whose own bands of motion differ, so that each alone would be filtered otherwise."""
    measured = [measure(ROBOT, swing(ROBOT, seed, seconds=6.0), noise=0.05) for seed in (1, 2, 3)]
    paces = [replace(motion, time=motion.time * pace) for motion, pace in zip(measured, (1.0, 2.0, 4.0), strict=True)]
    return tuple(map(as_run, paces))


RUNS = slow_and_fast()


@pytest.fixture
def workspace(tmp_path: Path) -> Iterator[Workspace]:
    with Workspace(tmp_path) as opened:
        ingest(opened, data_set())
        yield opened


@pytest.fixture(autouse=True)
def by_band(monkeypatch: pytest.MonkeyPatch) -> None:
    """Choose the cutoff by the band of the motion alone: what is held out is `tests/identification/test_cutoff.py`."""
    monkeypatch.setattr(
        motions,
        "cutoff_for",
        lambda robot, runs, stated: Cutoff(hz=stated or choose_cutoff(runs), stated=False, why=WHY),
    )


def data_set(*more: Run) -> DataSet:
    return DataSet(Path(), ROBOT, (*RUNS, *more), EFFECTS, None, "mains", True, {})


@pytest.mark.slow
def test_all_providers_of_a_job_condition_each_run_once_with_one_cutoff(
    workspace: Workspace, monkeypatch: pytest.MonkeyPatch
) -> None:
    conditioned: list[tuple[str, float | None]] = []

    def noting(*arguments: Any, **named: Any) -> Motion:
        conditioned.append((named["run"], named["cutoff"]))
        return Motion(*arguments, **named)

    monkeypatch.setattr(conditioning, "Motion", noting)
    ids = [f"{NAME}.{run.name}" for run in RUNS]
    for run_id in ids:
        keep(workspace, NAME, "run_state", run_iri(run_id), run_state.provide(workspace, run_id))
    keep(workspace, NAME, "identification", robot_iri(NAME), identification.provide(workspace, NAME))
    for run_id in ids:
        keep(workspace, NAME, "energy", run_iri(run_id), energy.provide(workspace, run_id))
    better = to_json(identify(ROBOT, robot_motions(workspace, NAME).own, EFFECTS))
    found = diagnosis(locations=[], findings=[], causes=[], shrink=shrink(RUNS[0].name))
    record(workspace, NAME, found, NOTHING, better)
    adopt(workspace, NAME)
    assert len({choose_cutoff([run]) for run in RUNS}) == len(RUNS)
    assert sorted(conditioned) == [(run.name, choose_cutoff(RUNS)) for run in RUNS]
    (twin,) = workspace.all(select(schema.TwinRow))
    document = workspace.read_document(twin.file, twin.sha256).decode()
    assert twin.cutoff_why == WHY
    assert twin.cutoff_hz == from_json(document, Path("twin.json")).cutoff == choose_cutoff(RUNS)


def test_a_simulators_runs_have_no_say_in_the_cutoff_but_have_it_too(workspace: Workspace) -> None:
    fast = replace(measure(ROBOT, swing(ROBOT, 9, seconds=6.0)), run="simulated")
    fast = replace(fast, time=fast.time / 4)
    ingest(workspace, data_set(replace(as_run(fast), role="simulated")))
    known = robot_motions(workspace, NAME)
    assert {motion.run for motion in known.own} == {run.name for run in RUNS}
    assert set(known.keys) == {*(run.name for run in RUNS), "simulated"}
    assert {motion.cutoff for motion in known.motions.values()} == {choose_cutoff(RUNS)}


def test_another_data_set_of_the_robot_is_conditioned_anew(workspace: Workspace) -> None:
    before = robot_motions(workspace, NAME)
    assert robot_motions(workspace, NAME) is before
    ingest(workspace, replace(data_set(), runs=(replace(RUNS[0], payload_mass=2.0), *RUNS[1:])))
    after = robot_motions(workspace, NAME)
    assert after.motions[f"{NAME}.{RUNS[0].name}"].payload_mass == 2.0
    assert np.array_equal(after.motions[f"{NAME}.{RUNS[1].name}"].q, before.motions[f"{NAME}.{RUNS[1].name}"].q)


def test_a_cutoff_that_a_data_set_states_is_that_of_all_motions(workspace: Workspace) -> None:
    before = robot_motions(workspace, NAME)
    ingest(workspace, replace(data_set(), cutoff=7.25))
    after = robot_motions(workspace, NAME)
    assert before.cutoff.hz != after.cutoff.hz == 7.25
    assert {motion.cutoff for motion in after.motions.values()} == {7.25}


def test_nothing_is_kept_of_a_workspace_that_is_gone(tmp_path: Path) -> None:
    gc.collect()
    kept = len(motions._kept)
    with Workspace(tmp_path) as opened:
        ingest(opened, data_set())
        robot_motions(opened, NAME)
        assert len(motions._kept) == kept + 1
    del opened
    gc.collect()
    assert len(motions._kept) == kept
