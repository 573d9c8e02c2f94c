"""What pauses of a programme could save: elsewhere, with brakes closed, or off."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.planning.test_cycle import EFFECTS, twin
from tests.planning.test_programme import STEP, bell, motion, rest

from irtwin.effects.supply import HoldingBrakes
from irtwin.planning.programme import SectionedMotion, programme_of
from irtwin.planning.waiting import _by_way_of, proposals
from irtwin.robot.collision import CollisionModel
from irtwin.signals.motion import Motion
from irtwin.twin.twin import Parameter, Twin

BRAKES, DELAY = 15.0, 0.5  # W, s


def programme(seconds: float = 3.0) -> SectionedMotion:
    """A pause with the arm up, a long one with it level, and one with it up again."""
    one = motion(rest(0.4), bell(3.0), rest(seconds), -bell(3.0), rest(0.4))
    q, dq, ddq = (np.hstack([0 * values, values]) for values in (one.q, one.dq, one.ddq))
    return programme_of(Motion(one.time, q, dq, ddq, run="weld"), "w")


def known_twin() -> Twin:
    return twin(joints=2)


def braked() -> Twin:
    known = known_twin()
    held = Parameter("holding_brakes", None, None, "Pb", BRAKES, "W")
    return replace(known, effects=(*EFFECTS, HoldingBrakes(delay=DELAY)), parameters=(*known.parameters, held))


def test_waiting_elsewhere_saves_the_difference_of_holding() -> None:
    known, weld = known_twin(), programme()
    (found,) = proposals(known, weld, None)
    held = [float(known.power(weld.alone(number)).mean()) for number in (0, 2, 4)]
    cheapest = min(held[0], held[2])
    assert found.seconds == pytest.approx(3.0, abs=0.2) and found.takes == 0.0
    assert found.saved.value == pytest.approx((held[1] - cheapest) * (found.seconds - 0.05), rel=0.05)
    assert found.what.startswith("wait where it stands at ")


def test_brakes_that_close_at_once_save_what_they_hold_until_then() -> None:
    known, weld = braked(), programme()
    found = {one.what.split()[0]: one for one in proposals(known, weld, None)}
    closed = found["close"]
    assert closed.takes is None
    assert closed.saved.value > BRAKES * (DELAY - 5 * STEP)
    held = known.power(weld.motion)[weld.sections[2].first + 5] - known.power(weld.motion)[weld.sections[2].last - 5]
    assert closed.saved.value == pytest.approx(held * DELAY, rel=0.2)


def test_off_saves_all_but_what_the_log_shows_there() -> None:
    known, weld = known_twin(), programme()
    found = {one.what: one for one in proposals(known, weld, 4.0)}
    pause = weld.alone(2)
    taken = known.energy(pause)
    assert found["switch off"].saved.value == pytest.approx(taken - 4.0 * pause.time[-1], rel=0.02)
    assert found["switch off"].takes is None


def test_short_pauses_and_what_costs_more_are_no_proposals() -> None:
    assert not list(proposals(known_twin(), programme(0.6), 4.0))
    assert "switch off" not in {one.what for one in proposals(known_twin(), programme(), 1e3)}


def test_parking_saves_the_difference_of_holding_but_for_the_way() -> None:
    known, weld = known_twin(), programme(90.0)
    (parked,) = (one for one in proposals(known, weld, None) if one.what.startswith("park"))
    pose = np.array([float(part.split()[1]) for part in parked.what.removeprefix("park at ").split(", ")])
    still = np.zeros((5, 2))
    there = Motion(np.arange(5) * STEP, still + pose, still, still, run="park")
    less = float(known.power(weld.alone(2)).mean() - known.power(there).mean())
    assert less > 0
    assert 0.5 * less * parked.seconds < parked.saved.value < less * parked.seconds
    assert pose[0] == 0.0  # a joint that the programme does not move stays
    assert parked.takes == 0.0


def test_a_way_there_and_back_is_smooth_and_ends_where_it_began() -> None:
    weld = programme(4.0)
    own = slice(weld.sections[2].first, weld.sections[2].last + 1)
    away = np.array([0.0, 0.7])
    moved = _by_way_of(weld.motion, own, away, 1.0)
    assert moved.q[own][[0, -1]] == pytest.approx(weld.motion.q[own][[0, -1]])
    middle = (own.start + own.stop) // 2
    assert moved.q[middle] == pytest.approx(weld.motion.q[middle] + away)
    np.testing.assert_allclose(np.gradient(moved.q, STEP, axis=0)[own], moved.dq[own], atol=0.01)
    np.testing.assert_allclose(np.gradient(moved.dq, STEP, axis=0)[own], moved.ddq[own], atol=0.05)


def test_a_pose_in_which_links_meet_is_no_place_to_park(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(CollisionModel, "first_meeting", lambda *_: (object(), 0.0))
    assert not [one for one in proposals(known_twin(), programme(20.0), None) if one.what.startswith("park")]
