"""Pseudo-inertias tell consistent bodies from others."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from irtwin.robot.pseudo_inertia import consistent, inertial_parameters, pseudo_inertias


def bodies(count: int) -> np.ndarray:
    return np.array([pin.Inertia.Random().toDynamicParameters() for _ in range(count)])


def test_parameters_come_back() -> None:
    given = bodies(20)
    assert inertial_parameters(pseudo_inertias(given)) == pytest.approx(given, rel=1e-14, abs=1e-14)


def test_it_is_that_of_pinocchio() -> None:
    for body in bodies(5):
        own = pin.PseudoInertia.FromDynamicParameters(body).toMatrix()
        assert pseudo_inertias(body[None])[0] == pytest.approx(own, rel=1e-12, abs=1e-14)


@pytest.mark.parametrize(
    ("moments", "can_be"), [((1.0, 1.0, 1.0), True), ((1.0, 1.0, 2.1), False), ((1.0, 1.0, 2.0), False)]
)
def test_no_moment_is_more_than_the_others_together(moments: tuple[float, ...], can_be: bool) -> None:
    body = pin.Inertia(2.0, np.array([0.1, 0.0, 0.3]), np.diag(moments)).toDynamicParameters()
    assert consistent(np.array([body, 1e-6 * body])).tolist() == [can_be, can_be]


def test_no_body_has_less_than_no_mass() -> None:
    assert not consistent(np.array([[-1.0, *[0.0] * 9], [0.0] * 10])).any()
