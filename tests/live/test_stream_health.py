"""A stream that stops, repeats, goes back or leaps is stale, and says why."""

from __future__ import annotations

import pytest

from irtwin.live import stream_health
from irtwin.live.stream_health import StreamHealth


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    now = [100.0]
    monkeypatch.setattr(stream_health.time, "monotonic", lambda: now[0])
    return now


def fed(clock: list[float], pause: float = 0.01) -> StreamHealth:
    health = StreamHealth()
    for _ in range(10):
        health.good()
        clock[0] += pause
    return health


def test_while_states_come_it_flows(clock: list[float]) -> None:
    health = fed(clock)
    assert not health.look()
    assert health.said() == {"stream_state": "flowing"}


@pytest.mark.parametrize(
    ("late", "reason"),
    [
        (None, "no state came for 3.0 s"),
        ((50.0, 50.0), "the stream repeats the state that was taken last"),
        ((47.0, 50.0), "the stream went back in time, by 3 s"),
    ],
)
def test_without_good_states_it_is_stale_once(
    clock: list[float], late: tuple[float, float] | None, reason: str
) -> None:
    health = fed(clock)
    if late:
        health.late(*late)
    clock[0] += 2.99
    assert health.look() and not health.look()
    said = health.said()
    assert (said["stream_state"], said["stale_reason"]) == ("stale", reason)
    health.good()
    assert health.said() == {"stream_state": "flowing"}


def test_good_states_with_frozen_values_are_stale_once(clock: list[float]) -> None:
    health = fed(clock)
    health.good("every value is the same")
    assert health.look() and not health.look()
    assert health.said()["stale_reason"] == "every value is the same"
    health.good()
    assert health.said() == {"stream_state": "flowing"}


def test_a_leap_is_told(clock: list[float]) -> None:
    health = fed(clock)
    health.leaps(-300.0)
    clock[0] += 5
    assert health.look()
    assert health.reason == "the stream's time leaps by -300 s"


def test_a_slow_source_may_take_its_time(clock: list[float]) -> None:
    health = fed(clock, pause=2.0)
    clock[0] += 4.0
    assert not health.look()
    clock[0] += 6.0
    assert health.look()


def test_before_the_first_state_nothing_is_stale(clock: list[float]) -> None:
    health = StreamHealth()
    clock[0] += 60
    assert not health.look()
