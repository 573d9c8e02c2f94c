"""What the commands on motions say of a proposal and of an order."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
from tests.planning.test_programme import bell, motion, rest

from irtwin.cli.motion import _curve_lines, _order_text, _tour_text
from irtwin.planning.plan import Tour
from irtwin.planning.programme import programme_of
from irtwin.planning.waiting import PauseProposal
from irtwin.twin.price import Figure


def found(hours: float | None, *unseen: str) -> SimpleNamespace:
    proposals = [
        PauseProposal(1.0, 3.0, "wait where it stands at 0.20 s", Figure(36.0, 2.0), 0.0),
        PauseProposal(1.0, 3.0, "close the brakes at once", Figure(18.0, None), None),
    ]
    return SimpleNamespace(
        curve=[],
        programme=programme_of(motion(rest(0.4), bell(1.0), rest(0.4)), "w"),
        best=SimpleNamespace(seconds=10.0, factors=np.ones(3)),
        proposals=proposals,
        unseen=unseen,
        hours=hours,
        kilogram=Figure(9.0, 1.0),
    )


def test_a_proposal_says_what_it_saves_a_cycle_and_a_year_and_what_it_takes() -> None:
    _, elsewhere, brakes, lighter = _curve_lines(found(5000.0))  # 1.8 million cycles
    assert elsewhere == (
        "pause from 1.00 to 4.00 s: wait where it stands at 0.20 s, 36 +- 2 J less (18 +- 1 kWh in 5000 h a year); "
        "it takes 0 s"
    )
    assert brakes.endswith("18 J less (9 kWh in 5000 h a year); how long coming back takes is in no log")
    assert lighter == "each kilogram less at the flange saves 9 +- 1 J a cycle (4.5 +- 0.5 kWh in 5000 h a year)"


def test_without_hours_there_is_no_year_and_states_that_no_log_shows_are_not_known() -> None:
    *_, proposal, off, lighter = _curve_lines(found(None, "off"))
    assert "year" not in proposal + lighter
    assert off == "no log shows the robot off: what that would save in a pause is not known"


def test_an_order_says_what_it_saves() -> None:
    assert _tour_text(Tour((2, 1), Figure(12.0, 3.0), 0.5)) == (
        "order of --via: 2, 1; saves 12 +- 3 J and 0.500 s against the order given (95 % interval)"
    )
    assert "saves 0.500 s" in _tour_text(Tour((2, 1), None, 0.5))
    of_run = SimpleNamespace(
        tour=Tour((2, 1), Figure(12.0, 3.0), 0.5), best=SimpleNamespace(seconds=10.0), hours=5000.0
    )
    said = _order_text(of_run)
    assert said.startswith("order of places between the first pause and the last: 2, 1; saves 12 +- 3 J")
    assert said.endswith("(6 +- 1.5 kWh in 5000 h a year)")
    assert "no other order" in _order_text(SimpleNamespace(tour=None))
