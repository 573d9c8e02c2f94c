"""The logs that ship are those that the plant makes, in the form that every user's logs have."""

from __future__ import annotations

import shutil
from pathlib import Path

import mujoco
import numpy as np
import pyarrow.parquet as pq
import pytest

from irtwin.demo.plant.machine import Drawings, build
from irtwin.demo.plant.simulate import simulate
from irtwin.demo.plant.thermal import Thermal
from irtwin.signals.log import DataSet, read_data_set
from plant.campaign import motion_of, read_campaign
from plant.dataset import describe

ROOT = Path(__file__).parents[2]
SHIPPED = ROOT / "src" / "irtwin" / "demo" / "kuka_kr6_r700"


@pytest.fixture(scope="module")
def data_set(tmp_path_factory: pytest.TempPathFactory) -> DataSet:
    folder = tmp_path_factory.mktemp("demo") / "kuka"
    shutil.copytree(SHIPPED, folder)
    shutil.copy(ROOT / "ontology" / "robots" / "kuka_kr6_r700.urdf", folder / "robot.urdf")
    return read_data_set(folder)


def test_reads_without_a_fault(data_set: DataSet) -> None:
    assert 12 <= len(data_set.runs) <= 16
    assert data_set.simulated
    assert {run.role for run in data_set.runs} == {"observed"}
    assert {run.payload_mass for run in data_set.runs} == {0.0, 3.0}
    assert sum(run.repeat_of is not None for run in data_set.runs) >= 2
    assert len({run.started.date() for run in data_set.runs if run.started}) == 2


def test_is_small() -> None:
    assert sum(file.stat().st_size for file in SHIPPED.rglob("*") if file.is_file()) < 5_000_000


def test_stays_within_what_the_robot_can_do(data_set: DataSet, drawings: Drawings) -> None:
    limits = drawings.limits
    for run in data_set.runs:
        signals = run.signals
        assert np.diff(signals.time) == pytest.approx(0.012)
        assert (signals.q > limits.lower).all() and (signals.q < limits.upper).all(), run.name
        assert (np.abs(np.diff(signals.q, axis=0) / 0.012) < 1.02 * limits.speed).all(), run.name
        assert signals.torque is not None and signals.power is not None and signals.temperature is not None
        assert (np.abs(signals.torque) < 1.05 * drawings.drive.maximum_torque).all(), run.name
        assert 95 < signals.power.min() < 130 and signals.power.max() < 2000, run.name


@pytest.mark.slow
def test_no_motion_touches_the_floor_or_the_arm_itself(drawings: Drawings) -> None:
    show = '<mujoco><compiler discardvisual="false" fusestatic="false"/></mujoco>'
    spec = mujoco.MjSpec.from_string(drawings.urdf.replace("</robot>", f"{show}</robot>"))
    for shape in spec.geoms:
        shape.contype = shape.conaffinity = 1
    model = spec.compile()
    data, body = mujoco.MjData(model), model.geom_bodyid

    def touching(q: np.ndarray) -> bool:
        data.qpos[:] = q
        mujoco.mj_fwdPosition(model, data)
        pairs = [body[contact.geom] for contact in data.contact]
        return any(abs(int(a) - int(b)) > 1 for a, b in pairs)  # neighbours overlap at their joint

    assert touching(np.radians([0, 20, 120, 0, 0, 0]))  # the hand in the base
    campaign = read_campaign("kuka_kr6_r700")
    for name, entry in campaign.motions.items():
        for q in motion_of(entry, drawings).q[::100]:
            assert not touching(q), name
            assert data.body("flange").xpos[2] > 0.1, name


def test_warms_up(data_set: DataSet) -> None:
    warm_up = [run.signals for run in data_set.runs if run.name.startswith("warm_up")]
    assert len(warm_up) >= 4
    final = [float(signals.temperature[-1].max()) for signals in warm_up if signals.temperature is not None]
    energy = [float(signals.power.mean()) for signals in warm_up if signals.power is not None]
    assert final == sorted(final) and final[-1] - final[0] > 8
    assert energy == sorted(energy, reverse=True)


def test_description_is_the_campaigns(drawings: Drawings) -> None:
    text = describe(read_campaign("kuka_kr6_r700"), drawings)
    assert (SHIPPED / "dataset.toml").read_text(encoding="utf-8") == text


@pytest.mark.nightly
@pytest.mark.slow
def test_the_plant_makes_the_first_log_again(drawings: Drawings) -> None:
    campaign = read_campaign("kuka_kr6_r700")
    machine, run = build(drawings, campaign.seed), campaign.runs[0]
    motion = motion_of(campaign.motions[run.motion], drawings)
    recording = simulate(machine, motion, run.payload, Thermal(drawings.thermal), seed=10)
    shipped = pq.read_table(SHIPPED / "runs" / f"{run.name}.parquet")
    # other processors round differently: a reading may tip to its sensor's next step, and torques move by some steps
    for index, joint in enumerate(drawings.joints):
        np.testing.assert_allclose(shipped[f"q_{joint}"], recording.q[:, index], atol=1e-5)
        np.testing.assert_allclose(shipped[f"tau_{joint}"], recording.torque[:, index], atol=0.3)
    np.testing.assert_allclose(shipped["power"], recording.power, atol=1.0)
