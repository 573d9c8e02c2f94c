"""A clock that is set is told from states out of order, and no time of a robot is stored twice."""

from __future__ import annotations

import itertools
import math
import tempfile
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sqlalchemy import select
from tests import rows

from irtwin.errors import InputError
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.live import stream_clock
from irtwin.live.joint_stream import State
from irtwin.live.live_twin import LiveTwin
from irtwin.live.stream_clock import HOLE, StreamClock, Tick, jump
from irtwin.live.stream_health import STALE
from irtwin.storage.database import Workspace
from irtwin.storage.schema import LiveState, RunRow

NOON = 1772366400.0
JUMPS = st.one_of(
    st.sampled_from([-3600.0, 3600.0, -0.5, -5.0, -100.0, 45.0]), st.floats(-7200.0, 3600.0, allow_nan=False)
)


def told(*times: float) -> list[tuple[Tick, float | None]]:
    clock = StreamClock()
    return [clock.tell(time) for time in times]


def sets(*times: float) -> list[float]:
    return [by for _, by in told(*times) if by is not None]


def test_states_out_of_order_set_no_clock() -> None:
    assert told(1.0, 3.0, 2.0, 3.0, 4.0) == [
        (Tick.NEXT, None), (Tick.NEXT, None), (Tick.LATE, None), (Tick.LATE, None), (Tick.NEXT, None)
    ]  # fmt: skip


@pytest.mark.parametrize("by", [-HOLE - 1, -3600.0, HOLE + 1, 3600.0])
def test_a_leap_that_goes_on_is_a_clock_that_was_set(by: float) -> None:
    assert sets(0.0, 1.0, 1.0 + by, 2.0 + by) == [by]
    assert sets(0.0, 1.0, 1.0 + by, 2.0) == []  # one state of a wrong time


@pytest.mark.parametrize("by", [-STALE, -5.0, -HOLE + 1])
def test_late_times_that_rise_long_enough_are_a_clock_that_was_set_back(by: float) -> None:
    late = [100.0 + by + 0.5 * step for step in range(5)]
    assert [tick for tick, _ in told(100.0, *late)][1:] == [Tick.LATE] * 4 + [Tick.NEXT]
    assert sets(100.0, *late) == [by]
    assert sets(100.0, *late[:4], 100.5, *late[:4]) == []
    assert sets(100.0, *reversed(late)) == []


def test_a_stream_that_was_silent_as_long_only_paused(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [0.0]
    monkeypatch.setattr(stream_clock.time, "monotonic", lambda: now[0])
    clock = StreamClock()
    for said, at in ((0.0, 0.0), (1.0, 1.0), (301.0, 301.0), (302.0, 302.0)):
        now[0] = at
        _, by = clock.tell(said)
    assert by == 300.0
    assert clock.paused(by)
    assert not clock.paused(3600.0)
    assert not clock.paused(-5.0)


def test_a_jump_is_told_in_seconds() -> None:
    assert jump(-3600.0) == "the clock of the stream was set back by 3600 s"
    assert jump(75.25) == "the clock of the stream was set ahead by 75.2 s"


def runs_of(
    jumps: list[float], steps: list[int], pause: float
) -> tuple[list[tuple[RunRow, str | None]], set[float], int, list[str]]:
    """Stream states whose clock jumps after each of the steps; return the runs with why they ended, the times that
    were sent, how many samples are stored, and what was told.
    """
    lines: list[str] = []
    sent: set[float] = set()
    with tempfile.TemporaryDirectory() as folder, Workspace(Path(folder)) as place:
        place.ingest(*rows.data_set())
        with KnowledgeGraph(place.graph_folder) as graph, LiveTwin(place, graph, lines.append) as twin:
            clock = NOON
            for by, count in zip([0.0, *jumps], steps, strict=True):
                clock += by
                for _ in range(count):
                    clock += pause
                    sent.add(clock)
                    values = ((math.sin(clock), 0.5), (math.nan,) * 2, (math.nan,) * 2, (math.nan,) * 2, (400.0,))
                    try:
                        twin.receive(State(rows.ROBOT, clock, values))
                    except InputError as error:
                        lines.append(f"refused: {error}")
        with place.reading() as session:
            found = session.execute(
                select(RunRow, LiveState.stale_reason).join(LiveState).order_by(RunRow.start_time)
            ).all()
            return [(run, why) for run, why in found], sent, twin.stored, lines


@pytest.mark.slow
@settings(max_examples=3, deadline=None)
@given(st.lists(JUMPS, min_size=1, max_size=4), st.data())
def test_no_time_is_stored_twice_whatever_the_clock_does(jumps: list[float], data: st.DataObject) -> None:
    steps = data.draw(st.lists(st.integers(5, 60), min_size=len(jumps) + 1, max_size=len(jumps) + 1))
    pause = data.draw(st.sampled_from([0.1, 1.0, 20.0]))
    runs, sent, stored, lines = runs_of(jumps, steps, pause)
    covered = [(run.start_time.timestamp(), run.start_time.timestamp() + run.run_time_s) for run, _ in runs]
    assert all(before[1] < after[0] for before, after in itertools.pairwise(covered))
    assert sum(run.sample_count for run, _ in runs) == stored <= len(sent)
    said = [line for line in lines if "the clock of the stream was set" in line]
    assert len(said) <= len(jumps)
    assert [why for _, why in runs if why is not None and not any(why in line for line in said)] == []
    lost = [at for at in sent if not any(begin - 1e-5 <= at <= end + 1e-5 for begin, end in covered)]
    assert len(lost) <= len(jumps) * (STALE / pause + 3)  # until a step back is told from states out of order


@pytest.mark.slow
@pytest.mark.parametrize(("by", "told_as"), [(-3600.0, "set back by 3600 s"), (3600.0, "set ahead by 3600 s")])
def test_a_clock_that_is_set_by_an_hour_is_told_once_and_kept(by: float, told_as: str) -> None:
    runs, _, stored, lines = runs_of([by], [50, 50], pause=0.1)
    assert stored == 100
    assert lines == [f"KUKA KR6 R700: the clock of the stream was {told_as}; its run ends, and no time is stored twice"]
    assert [why for _, why in sorted(runs, key=lambda one: abs(one[0].start_time.timestamp() - NOON))] == [
        f"the clock of the stream was {told_as}", None
    ]  # fmt: skip


@pytest.mark.slow
def test_a_clock_that_goes_back_into_its_own_run_stores_what_follows_that_alone() -> None:
    runs, _, stored, lines = runs_of([-100.0], [300, 200], pause=1.0)
    assert [(run.sample_count, why) for run, why in runs] == [
        (300, "the clock of the stream was set back by 99 s"), (100, None)
    ]  # fmt: skip
    assert stored == 400
    assert sum("covers this time" in line for line in lines) == 100


@pytest.mark.slow
def test_a_run_ends_where_another_lies_between_two_of_its_states() -> None:
    """Set back by less than the whole run before: the times of that one are not those of the one after, too."""
    runs, _, stored, _ = runs_of([-130.0], [31, 300], pause=1.0)
    assert [run.sample_count for run, _ in runs] == [99, 31, 170]
    assert stored == 300
