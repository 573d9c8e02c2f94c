"""Worked out as samples come, a run has the energy that it has as a whole."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.synthetic import arm, as_run, measure, swing, with_constants

from irtwin.effects.catalogue import BASELINE
from irtwin.signals.channels import columns_of
from irtwin.signals.conditioning import condition
from irtwin.twin.identify import identify
from irtwin.twin.so_far import EnergySoFar

ROBOT = with_constants(arm(2))
FITTED = [
    condition(as_run(measure(ROBOT, swing(ROBOT, seed, seconds=8.0), noise=0.01)), ROBOT, 15.0) for seed in (1, 2)
]
TWIN = identify(ROBOT, FITTED, (*BASELINE, "copper_loss"))
RUN = as_run(measure(ROBOT, swing(ROBOT, 3, seconds=8.0), noise=0.01))
WHOLE = condition(RUN, ROBOT, TWIN.cutoff)


def columns(since: float = 1.7e9, **changes: np.ndarray) -> dict[str, np.ndarray]:
    found = columns_of(RUN.signals, ROBOT.joint_names) | changes
    return found | {"time": since + found["time"]}


def fed(of: EnergySoFar, samples: dict[str, np.ndarray], size: int) -> list:
    count, stretches = len(samples["time"]), []
    for start in range(0, count, size):
        piece = {name: values[start : start + size] for name, values in samples.items()}
        stretches += of.feed(piece, last=start + size >= count)
    return stretches


@pytest.mark.slow
@pytest.mark.parametrize("size", [pytest.param(1, marks=pytest.mark.nightly), 7, 100, 10**6])
def test_in_pieces_it_takes_what_it_takes_as_a_whole(size: int) -> None:
    so_far = EnergySoFar(ROBOT.joint_names, TWIN)
    stretches = fed(so_far, columns(), size)
    assert so_far.seconds == pytest.approx(WHOLE.time[-1] - WHOLE.time[0], abs=1e-3)
    assert so_far.modelled == pytest.approx(TWIN.energy(WHOLE), rel=1e-4)
    assert so_far.measured == pytest.approx(np.trapezoid(WHOLE.power, WHOLE.time), rel=1e-4)
    ledger = {(entry.effect, entry.joint): entry.energy for entry in TWIN.ledger(WHOLE)}
    assert so_far.ledger.keys() == ledger.keys()
    for key, value in ledger.items():
        assert so_far.ledger[key] == pytest.approx(value, rel=1e-3, abs=1e-3)
    assert sum(so_far.ledger.values()) == pytest.approx(so_far.modelled)
    times = np.concatenate([one.motion.time[0 if one.begins else 1 :] for one in stretches])
    np.testing.assert_allclose(np.diff(times), times[1] - times[0], atol=1e-5)


def test_it_grows_while_the_run_lasts_and_trails_by_the_filter() -> None:
    so_far = EnergySoFar(ROBOT.joint_names, TWIN)
    seen = []
    samples = columns()
    for start in range(0, 700, 100):
        piece = {name: values[start : start + 100] for name, values in samples.items()}
        list(so_far.feed(piece))
        seen.append((so_far.seconds, so_far.measured))
    assert seen == sorted(seen)
    assert 0.0 < samples["time"][699] - samples["time"][0] - seen[-1][0] < 3.0 / TWIN.cutoff + 0.5


def test_a_hole_takes_no_energy() -> None:
    samples = columns()
    whole = EnergySoFar(ROBOT.joint_names, TWIN)
    fed(whole, samples, 50)
    half = len(samples["time"]) // 2
    later = samples["time"].copy()
    later[half:] += 20.0
    cut = EnergySoFar(ROBOT.joint_names, TWIN)
    stretches = fed(cut, samples | {"time": later}, 50)
    assert [stretch.begins for stretch in stretches].count(True) == 2
    assert cut.seconds == pytest.approx(whole.seconds, abs=0.02)
    assert cut.measured == pytest.approx(whole.measured, rel=0.01)


def test_power_that_is_not_said_throughout_is_not_taken_for_measured() -> None:
    power = RUN.signals.power.copy()
    power[200:220] = np.nan
    so_far = EnergySoFar(ROBOT.joint_names, TWIN)
    fed(so_far, columns(power=power), 50)
    assert so_far.measured is None
    assert so_far.modelled == pytest.approx(TWIN.energy(WHOLE), rel=1e-3)
    assert so_far.peak_power == so_far.peak


def test_without_a_twin_the_measured_power_alone_is_summed() -> None:
    so_far = EnergySoFar(ROBOT.joint_names)
    assert fed(so_far, columns(), 13) == []
    assert so_far.measured == pytest.approx(np.trapezoid(RUN.signals.power, RUN.signals.time), rel=1e-6)
    assert so_far.peak_power == RUN.signals.power.max()
    assert not so_far.ledger


def test_a_payload_counts() -> None:
    loaded = EnergySoFar(ROBOT.joint_names, TWIN, payload=5.0, payload_com=(0.0, 0.1, 0.0))
    fed(loaded, columns(), 200)
    motion = replace(WHOLE, payload_mass=5.0, payload_com=(0.0, 0.1, 0.0))
    assert loaded.modelled == pytest.approx(TWIN.energy(motion), rel=1e-4)
    assert loaded.modelled != pytest.approx(TWIN.energy(WHOLE), rel=1e-3)


def test_stamps_that_are_no_robot_s_make_no_filter_of_millions_of_samples() -> None:
    few = {name: values[:200] for name, values in columns(since=0.0).items()} | {"time": 1e-9 * np.arange(200)}
    assert fed(EnergySoFar(ROBOT.joint_names, TWIN), few, 50) == []


def test_a_few_samples_are_no_energy_yet() -> None:
    so_far = EnergySoFar(ROBOT.joint_names, TWIN)
    assert fed(so_far, {name: values[:15] for name, values in columns().items()}, 5) == []
    assert (so_far.seconds, so_far.measured) == (0.0, None)
