"""Work that a copy of the process shares: the same, in order; what goes wrong there is told here."""

from __future__ import annotations

import multiprocessing
import os
import sys
import threading
import time

import pytest

from irtwin.errors import InputError
from irtwin.identification import two_processes
from irtwin.identification.two_processes import begun, can_copy, in_copy, shared

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="only Linux copies processes")


@pytest.mark.parametrize("count", [1, 2, 7])
def test_what_is_made_is_in_order_and_the_later_half_is_made_in_a_copy(count):
    made = shared(lambda some: [(item, os.getpid(), in_copy()) for item in some], range(count))
    assert [item for item, _, _ in made] == list(range(count))
    here = -(-count // 2)
    assert [copied for _, _, copied in made] == [False] * here + [True] * (count - here)
    assert len({place for _, place, _ in made}) == min(count, 2)
    assert not in_copy()


@pytest.mark.parametrize("wrong", [0, 3])
def test_an_error_on_either_side_is_raised(wrong):
    def work(some):
        if wrong in some:
            raise InputError("the log is wrong")
        return some

    with pytest.raises(InputError, match="the log is wrong"):
        shared(work, range(4))


def test_a_fault_in_the_copy_says_where_it_was():
    def work(some):
        return [1 / (3 - item) for item in some]

    with pytest.raises(ZeroDivisionError) as raised:
        shared(work, range(4))
    assert "return [1 / (3 - item) for item in some]" in raised.value.__notes__[0]


def test_a_copy_that_is_killed_is_no_half_result():
    def work(some):
        if in_copy():
            os._exit(9)
        return some

    with pytest.raises(ChildProcessError, match="ended with 9"):
        shared(work, range(4))


def test_no_copy_is_made_beside_another_thread_or_on_one_processor(monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 1})
    monkeypatch.setattr(threading, "active_count", lambda: 1)
    assert can_copy()
    monkeypatch.setattr(threading, "active_count", lambda: 2)
    assert not can_copy()
    monkeypatch.setattr(threading, "active_count", lambda: 1)
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {1})
    assert not can_copy()


@pytest.mark.parametrize("worth", [True, False])
def test_work_that_is_begun_is_done_in_a_copy_where_it_is_worth_one(monkeypatch, worth):
    monkeypatch.setattr(two_processes, "can_copy", lambda: True)
    result = begun(lambda: (in_copy(), [1, 2]), worth=worth)
    assert result() == (worth, [1, 2])


def test_an_error_in_what_was_begun_is_raised_when_it_is_asked_for(monkeypatch):
    monkeypatch.setattr(two_processes, "can_copy", lambda: True)

    def work():
        raise InputError("the log is wrong")

    result = begun(work, worth=True)
    with pytest.raises(InputError, match="the log is wrong"):
        result()


def test_work_that_is_dropped_ends(monkeypatch):
    monkeypatch.setattr(two_processes, "can_copy", lambda: True)

    def work():
        time.sleep(60)

    others = set(multiprocessing.active_children())
    dropped = begun(work, worth=True)
    (copy,) = set(multiprocessing.active_children()) - others
    dropped.drop()
    assert not copy.is_alive()
    begun(work, worth=False).drop()
