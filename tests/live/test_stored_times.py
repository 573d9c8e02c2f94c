"""A sample is known by the stored run that covers its time."""

from __future__ import annotations

import pytest

from irtwin.live.known_robots import StoredTimes
from irtwin.storage.database import Workspace


@pytest.fixture(scope="module")
def times(tmp_path_factory: pytest.TempPathFactory) -> StoredTimes:
    with Workspace(tmp_path_factory.mktemp("times")) as place:
        found = StoredTimes(place)
    found.add("r", "second", 20.0, 30.0)
    found.add("r", "first", 10.0, 15.0)
    return found


@pytest.mark.parametrize(
    ("time", "run"),
    [
        (9.9, None),
        (10.0, "first"),
        (15.000001, "first"),
        (17.0, None),
        (20.0, "second"),
        (30.0, "second"),
        (31.0, None),
    ],
)
def test_a_time_is_that_of_the_run_that_covers_it(times: StoredTimes, time: float, run: str | None) -> None:
    assert times.run_in("r", time, time) == run


def test_another_robots_runs_do_not_count(times: StoredTimes) -> None:
    assert times.run_in("s", 10.0, 99.0) is None
