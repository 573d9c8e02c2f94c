"""The timing of a programme: the least energy of a cycle, against every other timing that a grid has."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from tests.planning.test_programme import bell, motion, rest
from tests.synthetic import arm, with_constants

from irtwin.errors import InputError
from irtwin.planning.cycle import CycleTimes
from irtwin.planning.programme import SectionedMotion, programme_of
from irtwin.twin.twin import Parameter, Twin

EFFECTS = ("rigid_body", "viscous_friction", "mechanical_power", "copper_loss", "standby_power")


def twin(standby: float = 20.0, limits: float = np.inf, joints: int = 1) -> Twin:
    robot = with_constants(arm(joints))
    robot = replace(robot, joints=tuple(replace(j, velocity=limits, effort=10 * limits) for j in robot.joints))
    stack = Twin(robot, EFFECTS, ()).stack
    values = {"P0": standby, "R": 8.0, "Fv": 3.0}
    terms = (*stack.torque_terms, *stack.power_terms)
    return Twin(
        robot, EFFECTS,
        tuple(
            Parameter(effect.id, term.joint, term.link, term.name, values.get(term.name, term.expected), term.unit)
            for effect, term in terms if not term.fixed
        ),
    )  # fmt: skip


def programme() -> SectionedMotion:
    return programme_of(motion(rest(0.4), bell(0.6), rest(0.8), -bell(1.2), rest(0.4)), "w")


def test_no_timing_of_a_grid_takes_less() -> None:
    known, weld = twin(), programme()
    best = CycleTimes(known, weld, 0.1).in_time(4.0)
    assert best.seconds == pytest.approx(4.0)
    least = known.energy(best.motion)
    for first, second in product(np.linspace(1.0, 3.0, 9), repeat=2):
        left = 4.0 - weld.seconds[[1, 3]] @ [first, second]
        if left >= 0.3:
            pauses = left / weld.seconds[[0, 2, 4]].sum()
            assert known.energy(weld.retimed(np.array([pauses, first, pauses, second, pauses]))) > 0.998 * least


def test_the_saving_is_against_waiting() -> None:
    known, weld = twin(), programme()
    best = CycleTimes(known, weld).in_time(5.0)
    was = weld.motion
    held = known.power(weld.alone(4)).mean() * (5.0 - was.time[-1])
    assert best.saved.value == pytest.approx(known.energy(was) + held - known.energy(best.motion), rel=1e-3)
    assert best.saved.value > 0


def test_pauses_stay_unless_they_may_shrink() -> None:
    weld = programme()
    own = float(weld.seconds.sum())
    pauses = weld.are("pause")
    kept, given = CycleTimes(twin(), weld).in_time(own), CycleTimes(twin(), weld, 0.1).in_time(own)
    assert kept.factors[pauses] == pytest.approx(1.0)
    assert given.factors[pauses].max() < 1.0
    assert given.energy.value < kept.energy.value


def test_the_dearer_waiting_is_the_faster_is_cheapest() -> None:
    weld = programme()
    cheapest = [CycleTimes(twin(standby, limits=20.0), weld).cheapest for standby in (1.0, 5.0, 20.0)]
    assert cheapest[0] > cheapest[1] > cheapest[2]


def test_it_gets_faster_only_within_known_limits() -> None:
    weld = programme()
    own = float(weld.seconds.sum())
    assert CycleTimes(twin(), weld).fastest == pytest.approx(own)
    limited = CycleTimes(twin(limits=1.5), weld)
    assert 0.6 * own < limited.fastest < 0.9 * own
    fastest = limited.in_time(limited.fastest)
    assert 1.3 < np.abs(fastest.motion.dq).max() <= 1.5
    with pytest.raises(InputError, match=r'run "weld" cannot be done in 1 s; the fastest that the robot.s limits and'):
        limited.in_time(1.0)


def test_the_curve_falls_to_the_cheapest_cycle_and_rises_after_it() -> None:
    times = CycleTimes(twin(50.0, limits=3.0), programme())
    curve = times.curve()
    energies = np.array([one.energy.value for one in curve])
    seconds = np.array([one.seconds for one in curve])
    assert seconds[0] == pytest.approx(times.fastest) and (np.diff(seconds) > 0).all()
    assert abs(seconds[np.argmin(energies)] - times.cheapest) < 0.3 * times.cheapest
