"""Processes that begin with what they need imported: forked from one that has opened no store.

A fork of this process would lack the threads of its stores. One such process serves all tests of a process.
"""

from __future__ import annotations

import multiprocessing

from tests import killed_writers

FORKS = multiprocessing.get_context("forkserver")
FORKS.set_forkserver_preload([killed_writers.__name__])
