"""A robot that the plant builds."""

from __future__ import annotations

import pytest

pytest.importorskip("mujoco", reason="the plant needs irtwin[mujoco]")

from irtwin.demo.plant.machine import Drawings, Machine, build
from plant.drawings import read_drawings


@pytest.fixture(scope="session")
def drawings() -> Drawings:
    return read_drawings("kuka_kr6_r700")


@pytest.fixture(scope="session")
def machine(drawings: Drawings) -> Machine:
    return build(drawings, seed=1)
