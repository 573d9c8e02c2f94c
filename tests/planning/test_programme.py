"""A programme: moves and pauses are found in a motion, and each may be retimed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from irtwin.errors import InputError
from irtwin.planning.programme import SectionedMotion, programme_of
from irtwin.signals.motion import Motion

STEP = 0.004


def bell(seconds: float) -> np.ndarray:
    """A speed from rest to rest."""
    return np.sin(np.pi * np.linspace(0, 1, round(seconds / STEP))) ** 2


def motion(*pieces: np.ndarray) -> Motion:
    """One joint at the speeds of each piece."""
    dq = np.concatenate(pieces)[:, None]
    time = np.arange(len(dq)) * STEP
    return Motion(time, np.cumsum(dq, axis=0) * STEP, dq, np.gradient(dq, STEP, axis=0), run="weld")


def rest(seconds: float) -> np.ndarray:
    return np.zeros(round(seconds / STEP))


def test_moves_and_pauses_are_found() -> None:
    found = programme_of(motion(rest(0.4), bell(1.0), rest(0.6), -bell(2.0), rest(0.2)), "w")
    assert [section.kind for section in found.sections] == ["pause", "move", "pause", "move", "pause"]
    assert found.seconds == pytest.approx([0.4, 1.0, 0.6, 2.0, 0.2], abs=0.1)  # a bell begins slowly


def test_where_joints_turn_at_once_is_no_pause() -> None:
    found = programme_of(motion(rest(0.4), bell(1.0), -bell(1.0), rest(0.4)), "w")
    assert [section.kind for section in found.sections] == ["pause", "move", "pause"]


def test_a_move_that_the_log_cuts_keeps_its_pace() -> None:
    cut = motion(bell(1.0)[60:], rest(0.5), bell(1.0), rest(0.5), bell(1.0)[:60])
    found = programme_of(cut, "w")
    assert [section.kind for section in found.sections] == ["cut", "pause", "move", "pause", "cut"]


@pytest.mark.parametrize("pieces", [(rest(2.0),), (bell(1.0)[50:-50],)])
def test_without_a_whole_move_it_is_refused(pieces: tuple[np.ndarray, ...]) -> None:
    with pytest.raises(InputError, match='w: run "weld" has no move from rest to rest; name a run that has one'):
        programme_of(motion(*pieces), "w")


@given(st.lists(st.floats(0.3, 4.0), min_size=5, max_size=5))
def test_retimed_it_takes_the_same_way_in_the_time_that_was_said(factors: list[float]) -> None:
    found = programme_of(motion(rest(0.4), bell(1.0), rest(0.6), -bell(2.0), rest(0.2)), "w")
    new = found.retimed(np.array(factors))
    assert new.time[-1] == pytest.approx(found.seconds @ factors)
    assert new.q[0] == pytest.approx(found.motion.q[0]) and new.q[-1] == pytest.approx(found.motion.q[-1])
    assert new.q.max() == pytest.approx(found.motion.q.max(), abs=2e-3)
    way = np.trapezoid(new.dq[:, 0], new.time)
    assert way == pytest.approx(new.q[-1, 0] - new.q[0, 0], abs=0.01)  # speeds are those of the positions


def test_a_pause_may_be_left_out() -> None:
    found = programme_of(motion(rest(0.4), bell(1.0), rest(0.6), -bell(2.0), rest(0.2)), "w")
    new = found.retimed(np.array([0.0, 1.0, 0.0, 1.0, 0.0]))
    assert new.time[-1] == pytest.approx(found.seconds[[1, 3]].sum())
    assert np.abs(np.diff(new.q[:, 0])).max() < 1.5 * STEP
    as_it_was = found.retimed(np.ones(5))
    assert as_it_was.q == pytest.approx(found.motion.q, abs=1e-9)


def test_a_section_alone(factor: float = 2.0) -> None:
    found = programme_of(replace(motion(rest(0.4), bell(1.0), rest(0.6)), payload_mass=3.0), "w")
    assert isinstance(found, SectionedMotion)
    alone = found.alone(1, factor)
    assert alone.time[-1] == pytest.approx(factor * found.seconds[1])
    assert alone.payload_mass == 3.0


def test_a_timed_programme_knows_its_sections() -> None:
    found = programme_of(motion(rest(0.4), bell(1.0), rest(0.6), -bell(2.0), rest(0.2)), "w")
    timed = found.timed(np.array([1.0, 2.0, 0.0, 0.5, 3.0]))
    assert [section.kind for section in timed.sections] == ["pause", "move", "move", "pause"]
    assert timed.seconds == pytest.approx(found.seconds[[0, 1, 3, 4]] * [1.0, 2.0, 0.5, 3.0], abs=2 * STEP)
    assert np.abs(timed.motion.dq[: timed.sections[0].last]).max() < 0.01
