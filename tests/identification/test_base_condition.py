import numpy as np
import pytest
from tests.identification.arms import kr6, two_joints

from irtwin.effects.catalogue import EXCITED
from irtwin.effects.stack import Stack
from irtwin.identification.base_condition import BaseRegressor, determinant
from irtwin.signals.motion import Motion


def motion(n: int, samples: int = 40) -> list[np.ndarray]:
    random = np.random.default_rng(3)
    return [size * random.normal(size=(samples, n)) for size in (1.0, 2.0, 5.0)]


def test_a_six_axis_arm_has_its_known_number_of_base_columns() -> None:
    # 36 of the rigid body, 4 rotor inertias that these cannot stand for, 3 times 6 of friction and offset
    assert len(BaseRegressor(kr6()).columns) == 36 + 4 + 18


def test_its_columns_are_those_of_the_effects() -> None:
    robot = kr6()
    regressor, stack = BaseRegressor(robot), Stack(robot, EXCITED)
    q, dq, ddq = motion(6)
    columns = stack.torque_columns(Motion(np.arange(len(q)), q, dq, ddq, run="run"))[:, :, regressor.columns]
    np.testing.assert_allclose(regressor.matrix(q, dq, ddq), columns.reshape(-1, len(regressor.columns)), atol=1e-9)


def task(n: int) -> Motion:
    q, dq, ddq = (values[:10] for values in motion(n))
    return Motion(np.arange(10) / 10, q, dq, ddq, run="task")


CRITERIA = {"condition": {}, "determinant": {"criterion": determinant}, "energy": {"tasks": [task(6)]}}


@pytest.mark.parametrize(
    "robot, criterion",
    [(two_joints(kind="prismatic"), {}), *((kr6(), criterion) for criterion in CRITERIA.values())],
    ids=["prismatic", *CRITERIA],
)
def test_the_gradient_is_that_of_the_cost(robot, criterion) -> None:  # type: ignore[no-untyped-def]
    regressor = BaseRegressor(robot, **criterion)
    n = len(robot.joints)
    signals, slow = motion(n), np.full(n, 0.5)
    gradient = regressor.cost(*signals, slow)[1]
    for number, slope in enumerate(gradient):
        towards = np.random.default_rng(number).normal(size=slope.shape)
        ahead, behind = (
            [s + (h * towards if k == number else 0) for k, s in enumerate(signals)] for h in (1e-5, -1e-5)
        )
        difference = (regressor.cost(*ahead, slow)[0] - regressor.cost(*behind, slow)[0]) / 2e-5
        assert float((slope * towards).sum()) == pytest.approx(difference, rel=1e-3, abs=1e-6)


def test_a_larger_motion_costs_less() -> None:
    regressor = BaseRegressor(two_joints())
    q, dq, ddq = motion(2)
    small = regressor.cost(q, dq, ddq, np.full(2, 1e-6))[0]
    large = regressor.cost(q, 3 * dq, 9 * ddq, np.full(2, 1e-6))[0]
    assert large < small


def test_a_joint_at_rest_has_no_condition_number() -> None:
    q, dq, ddq = motion(2)
    dq[:, 0] = 0
    assert BaseRegressor(two_joints()).condition_number(q, dq, ddq) == np.inf


def test_the_determinant_is_that_of_the_covariance() -> None:
    regressor = BaseRegressor(two_joints(), determinant)
    matrix = regressor.matrix(*motion(2))
    covariance = np.linalg.inv(matrix.T @ matrix)
    assert regressor.rank(*motion(2)) == pytest.approx(np.log(np.linalg.det(covariance)) / (2 * len(covariance)))


def test_the_energy_of_a_task_is_linear_in_base_parameters() -> None:
    regressor, known = BaseRegressor(two_joints()), task(2)
    values = np.arange(1.0, 1 + len(regressor.columns))
    torque = (regressor.matrix(known.q, known.dq, known.ddq) @ values).reshape(-1, 2)
    work = float((np.gradient(known.time) * (torque * known.dq).sum(axis=1)).sum())
    assert regressor.energy_slope(known) @ values == pytest.approx(work)
