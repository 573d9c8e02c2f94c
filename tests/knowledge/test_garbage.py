from __future__ import annotations

import gc

import pytest

from irtwin.knowledge.garbage import seldom_collected


def test_garbage_is_collected_as_before_when_the_block_ends_however_it_ends() -> None:
    before = gc.get_threshold()
    with pytest.raises(KeyError), seldom_collected():
        assert gc.get_threshold()[0] > before[0]
        with seldom_collected():
            pass
        raise KeyError
    assert gc.get_threshold() == before


def test_a_collector_that_is_turned_off_stays_off() -> None:
    before = gc.get_threshold()
    gc.set_threshold(0)
    try:
        with seldom_collected():
            assert gc.get_threshold()[0] == 0
    finally:
        gc.set_threshold(*before)
