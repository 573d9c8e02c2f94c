"""Cases tried from one process of their own, which reads what ships once for all of them."""

from __future__ import annotations

import multiprocessing
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from pathlib import Path

from tests.fuzz.case import Case
from tests.fuzz.fault import Fault


def try_case_apart(case: Case, sound: Path) -> Fault | None:
    """Try a case from a process that has opened no store: a fork lacks RocksDB's threads, and waits for them."""
    return _process().submit(_tried, case, sound).result()


@cache
def _process() -> ProcessPoolExecutor:
    return ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn"))


def _tried(case: Case, sound: Path) -> Fault | None:
    from tests.fuzz.commands import try_case  # there alone: it reads for seconds when it is imported

    return try_case(case, sound)
