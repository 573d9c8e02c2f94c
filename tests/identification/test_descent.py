import math

import numpy as np
import pytest

from irtwin.identification.excitation import descend


def rosenbrock(x: np.ndarray) -> tuple[float, np.ndarray]:
    a, b = x
    value = (1 - a) ** 2 + 100 * (b - a**2) ** 2
    return value, np.array([-2 * (1 - a) - 400 * a * (b - a**2), 200 * (b - a**2)])


def test_it_finds_the_bottom_of_the_banana_valley() -> None:
    *_, last = descend(rosenbrock, np.array([-1.2, 1.0]), 200, tolerance=1e-16)
    assert last == pytest.approx([1, 1], abs=1e-5)


def test_every_step_is_better_than_the_one_before() -> None:
    values = [rosenbrock(x)[0] for x in descend(rosenbrock, np.array([-1.2, 1.0]), 20)]
    assert values == sorted(values, reverse=True)


def test_it_never_leaves_the_region() -> None:
    def fenced(x: np.ndarray) -> tuple[float, np.ndarray]:
        return rosenbrock(x) if x[0] < 0.5 else (math.inf, x)

    points = list(descend(fenced, np.array([-1.2, 1.0]), 200))
    assert max(x[0] for x in points) < 0.5
    assert points[-1][0] > 0.4


def test_it_stops_after_its_iterations() -> None:
    assert len(list(descend(rosenbrock, np.array([-1.2, 1.0]), 3))) == 3
