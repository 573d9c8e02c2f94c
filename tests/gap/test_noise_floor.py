"""The floor from above the band, of torque that is known noise."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
import scipy

from irtwin.gap.data.noise_floor import noise_floor
from irtwin.gap.thresholds import DEFAULT
from irtwin.signals.channels import Signals
from irtwin.signals.filter import low_pass
from irtwin.signals.motion import Motion

RATE, CUTOFF, NOISE = 125.0, 10.0, 0.3
TIME = np.arange(4000) / RATE


def floor(*torques):
    """The floor of runs, each logged and filtered torque (N, 1)."""
    runs = [
        SimpleNamespace(
            name=f"run_{k}",
            role="observed",
            repeat_of=None,
            signals=SimpleNamespace(time=TIME, torque=torque[:, None], power=None),
        )
        for k, torque in enumerate(torques)
    ]
    motion = SimpleNamespace(time=TIME, rate=RATE, cutoff=CUTOFF)
    return noise_floor(runs, {run.name: motion for run in runs}, DEFAULT.data)


def white(seed=0):
    return NOISE * np.random.default_rng(seed).standard_normal(len(TIME))


def smoothed(torque):
    return scipy.signal.sosfiltfilt(scipy.signal.butter(2, 8.0, fs=RATE, output="sos"), torque)


def test_white_noise_is_known_from_above_the_band():
    inside = np.sqrt(np.mean(low_pass(white()[:, None], RATE, CUTOFF) ** 2))
    assert floor(white()).torque == pytest.approx([inside], rel=0.15)


def test_friction_that_changes_its_sign_is_not_taken_for_smoothing():
    friction = 10 * np.sign(np.sin(TIME * 2.1))
    assert floor(friction + 0.03 * white()).source == "out_of_band"


def test_a_smoothed_log_tells_no_floor():
    found = floor(smoothed(white()))
    assert (found.torque, found.source) == (None, None)


def test_of_two_runs_one_smoothed_the_other_tells_it():
    assert floor(white(), smoothed(white(1))).torque == pytest.approx(floor(white()).torque)


def test_what_a_joint_holds_at_rest_is_no_noise_of_its_motion():
    """Stiction holds another torque in each repeat; what a fit leaves is judged in motion alone."""
    speed = np.where(TIME % 8 < 4, 0.0, 0.5 * np.sin(2 * np.pi * TIME / 4) ** 2)[:, None]
    q = np.cumsum(speed, axis=0) / RATE
    rest = (speed == 0) * np.floor(TIME / 8)[:, None] % 2

    def run(name, repeats, seed, held):
        torque = white(seed)[:, None] + held * rest
        signals = Signals(TIME, q, torque=torque)
        motion = Motion(TIME, q, speed, np.gradient(speed, axis=0) * RATE, torque=torque, run=name, cutoff=CUTOFF)
        return SimpleNamespace(name=name, role="observed", repeat_of=repeats, signals=signals), motion

    (first, one), (second, other) = run("a", None, 0, 0.0), run("b", "a", 1, 20.0)
    found = noise_floor([first, second], {"a": one, "b": other}, DEFAULT.data)
    assert found.source == "repeats"
    assert found.torque == pytest.approx([NOISE], rel=0.1)
