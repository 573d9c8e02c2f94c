"""A source that sends the same values over and over is told where a robot at rest cannot be the reason."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterator
from itertools import chain

import pytest

from irtwin.live.frozen_values import FrozenValues
from irtwin.live.joint_stream import State

UNSAID = (math.nan, math.nan)
Said = tuple[tuple[tuple[float, ...], ...], bool]  # values, and whether the robot rests


def fed(values: Iterator[Said], step: float = 0.01) -> list[str]:
    """What is said of a stream of values, each with whether the robot rests."""
    frozen, before, said = FrozenValues(), None, []
    for number, (each, at_rest) in enumerate(values):
        state = State("R", 1e9 + step * number, each)
        if before is not None and (reason := frozen.take(state, before, at_rest)):
            said.append(reason)
        before = state
    return said


def at_rest(count: int, torque: Callable[[], float], speed: tuple[float, ...] = UNSAID) -> Iterator[Said]:
    for _ in range(count):
        yield ((0.5, -0.2), speed, (torque(), 3.0), UNSAID, (120.0,)), True


def moving(count: int) -> Iterator[Said]:
    for number in range(count):
        yield ((0.01 * number, 0.0), (1.0, 0.0), (10.0 + 0.1 * number, 3.0), UNSAID, (400.0,)), False


def noise() -> Callable[[], float]:
    drawn = random.Random(1)
    return lambda: 5.0 + drawn.gauss(0.0, 0.1)


def test_torque_that_wavered_at_rest_and_does_no_more() -> None:
    said = fed(chain(at_rest(150, noise()), at_rest(400, lambda: 5.01)))
    assert set(said) == {"every value has been the same for 3 s, though torque wavered at rest before"}
    assert len(said) == 400 - 300


def test_a_speed_that_leads_nowhere() -> None:
    (said, *_) = fed(chain(moving(100), at_rest(400, lambda: 5.0, speed=(1.0, 0.0))))
    assert said == "every value has been the same for 3 s, though the speed that is said is not zero"


@pytest.mark.parametrize(
    "values",
    [
        lambda: at_rest(1000, lambda: 5.0),  # a simulation without noise, or a coarse meter
        lambda: chain(moving(300), at_rest(1000, lambda: 5.0)),  # never seen to waver while it stood
        lambda: chain(at_rest(50, noise()), at_rest(1000, lambda: 5.0)),  # not for long enough
        lambda: chain(at_rest(150, noise()), brakes(1000)),
        lambda: chain(at_rest(150, noise()), at_rest(250, lambda: 5.0), at_rest(150, noise())),  # too short
        lambda: held(200),
    ],
)
def test_a_robot_that_stands_is_not_frozen(values: Callable[[], Iterator[Said]]) -> None:
    assert fed(values()) == []


def brakes(count: int) -> Iterator[Said]:
    """Brakes hold the arm: no current, hence no torque."""
    for _ in range(count):
        yield ((0.5, -0.2), (0.0, 0.0), (0.0, 0.0), UNSAID, (80.0,)), True


def held(count: int) -> Iterator[Said]:
    """A controller of 10 Hz that is asked at 100 Hz, then a robot of which each value stays for a while."""
    drawn = noise()
    for _ in range(count):
        value = drawn()
        yield from at_rest(10, lambda value=value: value)  # type: ignore[misc]
    yield from at_rest(400, lambda: 5.0)


def test_a_slow_source_may_say_the_same_a_few_times() -> None:
    assert fed(chain(at_rest(150, noise()), at_rest(10, lambda: 5.0)), step=1.0) == []
