from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from irtwin.demo.plant.machine import Drawings
from irtwin.demo.plant.motion import PlantMotion, check, programme
from plant.fourier import fourier

STEP = 1e-3


def _assert_consistent(motion: PlantMotion, rtol: float) -> None:
    scale = np.abs(motion.dq).max()
    np.testing.assert_allclose(np.gradient(motion.q, STEP, axis=0)[2:-2], motion.dq[2:-2], atol=rtol * scale)


@pytest.mark.parametrize("profile", ["quintic", "trapezoid"])
def test_point_to_point_uses_the_limits_and_keeps_them(drawings: Drawings, profile: str) -> None:
    moves = [
        {"to": [90, -40, 60, 0, 30, 0], "profile": profile},
        {"to": [-60, -100, 90, 90, 0, 200], "profile": profile},
    ]
    motion = programme(moves, drawings.limits, STEP)
    check(motion, drawings.limits)
    _assert_consistent(motion, 0.02)
    used = max(
        (np.abs(motion.dq) / drawings.limits.speed).max(), (np.abs(motion.ddq) / drawings.limits.acceleration).max()
    )
    assert 0.95 < used <= 1.0 + 1e-9


def test_programme_starts_and_ends_at_the_last_pose_and_pauses(drawings: Drawings) -> None:
    moves = [{"to": [10, -90, 90, 0, 0, 0], "pause": 0.5}, {"to": [0, -80, 80, 0, 0, 0]}]
    motion = programme(moves, drawings.limits, STEP, cycles=2)
    np.testing.assert_allclose(motion.q[-1], np.radians([0, -80, 80, 0, 0, 0]))
    np.testing.assert_allclose(motion.q[0], motion.q[-1], atol=1e-4)
    assert ((motion.dq == 0).all(axis=1)).sum() >= 1000


def test_slower_takes_longer(drawings: Drawings) -> None:
    def length(speed: float) -> int:
        return len(programme([{"to": [0] * 6}, {"to": [60, 0, 0, 0, 0, 0], "speed": speed}], drawings.limits, STEP).q)

    assert length(0.25) > 1.9 * length(1.0)


def test_fourier_series(tmp_path: Path) -> None:
    file = tmp_path / "motion.toml"
    file.write_text("period = 4.0\ncentre = [0.5, 0.0]\nsine = [[1.0, 0.0]]\ncosine = [[0.0, 2.0]]\n")
    motion = fourier(file, STEP)
    _assert_consistent(motion, 1e-5)
    assert motion.q.shape == (4001, 2)
    np.testing.assert_allclose(motion.q[1000], [1.5, 0.0], atol=1e-12)
    np.testing.assert_allclose(motion.ddq[0], [0.0, -2 * (np.pi / 2) ** 2], atol=1e-12)


def test_check_names_the_limit(drawings: Drawings) -> None:
    rows = np.zeros((10, 6))
    rows[5, 2] = 100.0
    with pytest.raises(ValueError, match="joint 3 passes its speed limit at step 5"):
        check(PlantMotion(0 * rows, rows, 0 * rows), drawings.limits)
