"""A diagnosis kept and its twin adopted, on a small arm whose truth is known."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import select
from tests.gap_cases import findings_of
from tests.rows import keep
from tests.synthetic import arm, as_run, measure, swing, with_constants

from irtwin.document.curves import Curves
from irtwin.document.document import Document
from irtwin.errors import InputError
from irtwin.providers import energy, identification
from irtwin.providers.gap import adopt, record
from irtwin.providers.names import robot_iri, run_iri
from irtwin.providers.records import ingest
from irtwin.signals.conditioning import condition
from irtwin.signals.log import DataSet
from irtwin.storage import schema
from irtwin.storage.database import Workspace
from irtwin.storage.gap_schema import CLASSES, GapDiagnosis
from irtwin.twin.files import load, to_json
from irtwin.twin.identify import identify

pytestmark = pytest.mark.slow

ROBOT = "arm_2"
BARE = ("rigid_body", "viscous_friction")
FULL = (*BARE, "coulomb_friction")
NOTHING = Curves(follows=(), runs=(), experiment=None)


def diagnosis(**changes: Any) -> Document:
    evidence = {
        "channel": "torque", "share_of_what_is_closed": 1.0, "closed_where_it_acts": 0.9, "gain": 4.0, "log_odds": 7.0,
        "probability_of_rivals": {"stribeck_friction": 0.12, "payload": 0.01}, "runs": ["swing_3"],
        "window": [1.5, 2.5],
    }  # fmt: skip
    friction = {"name": "Fc", "joint": "joint_1", "value": 6.0, "unit": "Nm", "interval95": [5.9, 6.1]}
    cause = {
        "id": "coulomb_friction@all", "effect": "coulomb_friction", "joints": ["joint_1", "joint_2"],
        "scope": "missing", "confidence": 0.9, "parameters": [friction],
        "indistinguishable_from": ["stribeck_friction"], "evidence": evidence,
    }  # fmt: skip
    location = {"channel": "torque", "joint": "joint_1", "regime": None, "follows": None, "runs": ["swing_3"]}
    location |= {"share": 0.8, "share_interval95": [0.7, 0.9], "excess": 5.0, "excess_interval95": [4.0, 6.0]}
    said = {
        "verdict": "attributed",
        "robot": ROBOT,
        "gap": gap_of("joint_1"),
        "locations": [location | {"concentration": 1.0, "false_discovery_rate": 0.01}],
        "findings": findings_of([cause]),
        "causes": [cause],
        "not_testable": [{"effect": "payload", "why": "one payload only"}, {"effect": "payload", "why": "too short"}],
        "shrink": shrink(),
        "next_experiment": None,
    }
    return Document.from_json(said | changes)


def gap_of(joint: str) -> dict[str, Any]:
    size = {"rmse": 3.0, "noise_floor": None, "excess": None}
    return {"energy_error_percent": None, "torque": {joint: size}}


def shrink(run: str = "swing_3") -> dict[str, Any]:
    return {
        "held_out_runs": [run],
        "noise_floor_from": None,
        "torque_rmse": None,
        "power_rmse": None,
        "energy_error_percent": None,
        "closed_fraction": {"value": 0.9, "interval95": [0.8, 1.0]},
        "by_cause": [],
    }


@pytest.fixture
def workspace(tmp_path: Path):
    """Three runs, with a twin that lacks friction and the energy of a run by it."""
    robot = with_constants(arm(2))
    runs = tuple(as_run(measure(robot, swing(robot, seed, seconds=6.0), noise=0.05)) for seed in (1, 2, 3))
    with Workspace(tmp_path / "workspace") as opened:
        ingest(opened, DataSet(Path(), robot, runs, BARE, None, "mains", True, {}))
        keep(opened, ROBOT, "identification", robot_iri(ROBOT), identification.provide(opened, ROBOT))
        keep(opened, ROBOT, "energy", run_iri(f"{ROBOT}.swing_1"), energy.provide(opened, f"{ROBOT}.swing_1"))
        opened.better = to_json(identify(robot, [condition(run, robot, 10.0) for run in runs[:2]], FULL))
        yield opened


def count(workspace: Workspace, table: Any) -> int:
    return len(workspace.all(select(table)))


def test_a_diagnosis_replaces_the_earlier_one(workspace: Workspace) -> None:
    first = record(workspace, ROBOT, diagnosis(), NOTHING, workspace.better)
    second = record(workspace, ROBOT, diagnosis(verdict="ambiguous"), NOTHING, workspace.better)
    assert first.diagnosis_id != second.diagnosis_id
    assert {file.name for file in (workspace.folder / "diagnoses").iterdir()} == {
        f"{second.diagnosis_id}{kind}.json" for kind in ("", ".evidence", ".twin")
    }
    assert (
        workspace.read_document(second.evidence_file, second.evidence_sha256)
        == b'{"experiment": null, "follows": [], "runs": []}'
    )
    assert count(workspace, CLASSES["gap_not_testable"]) == 2
    assert count(workspace, schema.TwinRow) == count(workspace, schema.RunEnergy) == 1


def test_what_acts_for_a_while_in_some_runs_is_kept(workspace: Workspace) -> None:
    record(workspace, ROBOT, diagnosis(), NOTHING, workspace.better)
    (cause,) = workspace.all(select(CLASSES["gap_cause"]))
    (run,) = workspace.all(select(CLASSES["gap_cause_run"]))
    weighed = workspace.all(select(CLASSES["gap_cause_competitor"]))
    assert (cause.acts_from_s, cause.acts_until_s, run.run_id) == (1.5, 2.5, f"{ROBOT}.swing_3")
    assert cause.cause_id == run.cause_id == "coulomb_friction@all"
    assert (cause.gain, cause.log_odds) == (4.0, 7.0)
    assert {one.effect: one.probability for one in weighed} == {"stribeck_friction": 0.12, "payload": 0.01}


def test_a_finding_is_kept_with_its_joints_and_members(workspace: Workspace) -> None:
    record(workspace, ROBOT, diagnosis(), NOTHING, workspace.better)
    (finding,) = workspace.all(select(CLASSES["gap_finding"]))
    joints = set(workspace.all(select(CLASSES["gap_finding_joint"].joint)))
    members = workspace.all(select(CLASSES["gap_finding_member"]))
    (said,) = diagnosis().findings
    assert (finding.finding_id, finding.family, finding.rank, finding.matters) == (said.id, "friction", 1, True)
    assert (finding.share, finding.confidence) == (said.share, 0.9)
    assert (finding.share_lower, finding.share_upper) == said.share_interval95
    assert joints == {"joint_1", "joint_2"}
    assert {(one.effect, one.cause_id, one.confidence) for one in members} == {
        ("coulomb_friction", "coulomb_friction@all", 0.9),
        ("stribeck_friction", "coulomb_friction@all", 0.3 * 0.9),
    }


def test_adopting_makes_the_twin_the_robots(workspace: Workspace) -> None:
    found = record(workspace, ROBOT, diagnosis(), NOTHING, workspace.better)
    twin_id = adopt(workspace, ROBOT)
    (twin,) = workspace.all(select(schema.TwinRow))
    assert twin.twin_id == twin_id
    assert "a diagnosis of all these runs" in twin.split
    assert set(workspace.all(select(schema.TwinEffect.effect))) == set(FULL)
    used = workspace.all(select(schema.ActivityUse.entity).where(schema.ActivityUse.activity_id == twin.activity_id))
    assert f"gap_diagnosis/{found.diagnosis_id}" in set(used)
    assert count(workspace, schema.RunEnergy) == 0
    assert count(workspace, GapDiagnosis) == 1
    keep(workspace, ROBOT, "energy", run_iri(f"{ROBOT}.swing_1"), energy.provide(workspace, f"{ROBOT}.swing_1"))
    assert count(workspace, schema.RunEnergy) == 1
    assert adopt(workspace, ROBOT) == twin_id


def test_an_adopted_twin_is_judged_on_what_it_was_not_fitted_to(workspace: Workspace) -> None:
    record(workspace, ROBOT, diagnosis(), NOTHING, workspace.better)
    adopt(workspace, ROBOT)
    (row,) = workspace.all(select(schema.TwinRow))
    assert set(load(workspace.folder / row.file).fitted) == {"swing_1", "swing_2"}
    parts = {one.run_id: one.part for one in workspace.all(select(schema.TwinRun))}
    fits = workspace.all(select(schema.TorqueFit))
    # of the two runs that the diagnosis took for the twin, each is cut in time; the third is not of its time
    assert parts == {f"{ROBOT}.swing_{k}": part for k, part in ((1, "both"), (2, "both"), (3, "apart"))}
    assert {(fit.run_id[-1], fit.part) for fit in fits} == {(k, part) for k in "12" for part in ("fit", "held_out")}
    assert all(fit.r_squared > 0.9 for fit in fits if fit.part == "held_out")


def test_a_run_apart_from_its_twin_has_energy_but_no_error(workspace: Workspace) -> None:
    record(workspace, ROBOT, diagnosis(), NOTHING, workspace.better)
    adopt(workspace, ROBOT)
    for name in ("swing_1", "swing_3"):
        made = energy.provide(workspace, f"{ROBOT}.{name}")
        (row,) = (row for row in made.rows if isinstance(row, schema.RunEnergy))
        assert (row.energy_error_percent is None) is (name == "swing_3")


def test_nothing_to_adopt_is_an_error(workspace: Workspace) -> None:
    with pytest.raises(InputError, match="no diagnosis"):
        adopt(workspace, ROBOT)
    record(workspace, ROBOT, diagnosis(verdict="unexplained", findings=[], causes=[]), NOTHING)
    with pytest.raises(InputError, match="added nothing to the twin"):
        adopt(workspace, ROBOT)


def test_what_the_workspace_lacks_is_named(workspace: Workspace) -> None:
    with pytest.raises(InputError, match="no robot other here"):
        record(workspace, "other", diagnosis(), NOTHING)
    with pytest.raises(InputError, match='run "swing_9"'):
        record(workspace, ROBOT, diagnosis(shrink=shrink("swing_9")), NOTHING)
    with pytest.raises(InputError, match="no joint joint_9"):
        record(workspace, ROBOT, diagnosis(gap=gap_of("joint_9")), NOTHING)
    assert count(workspace, GapDiagnosis) == 0


def test_a_changed_document_is_told(workspace: Workspace) -> None:
    found = record(workspace, ROBOT, diagnosis(), NOTHING, workspace.better)
    (workspace.folder / found.twin_file).write_text("{}")
    with pytest.raises(InputError, match="was changed after it was written"):
        adopt(workspace, ROBOT)
    (workspace.folder / found.twin_file).unlink()
    with pytest.raises(InputError, match="cannot be read"):
        adopt(workspace, ROBOT)
