"""A small fixed part of `make fuzz`: the same few cases each time, and the harness itself."""

from __future__ import annotations

import sys
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from tests.fuzz.apart import try_case_apart
from tests.fuzz.case import OF_DATA, Case, cases, read_case
from tests.fuzz.child import in_child
from tests.fuzz.fault import fault_of

FEW = settings(max_examples=12, derandomize=True, phases=[Phase.generate], suppress_health_check=[*HealthCheck])


@pytest.mark.slow
@pytest.mark.nightly
@FEW
@given(cases(OF_DATA))
def test_odd_robots_and_spoilt_logs_come_to_an_answer_or_to_one_line(tmp_path: Path, case: Case):
    fault = try_case_apart(replace(case, commands=("diagnose with page and twin", "predict")), tmp_path)
    assert fault is None, f"{fault.kind}\n{fault.said}\n{case.to_json()}"


@settings(max_examples=50)
@given(cases())
def test_a_case_that_is_kept_reads_as_it_was(case: Case):
    assert read_case(case.to_json()) == case


def _fills_the_memory() -> None:
    np.ones(500_000_000)


def _warns() -> None:
    warnings.warn("no good", RuntimeWarning, stacklevel=1)


def _says_two_lines() -> None:
    sys.exit(print("irtwin: one\nirtwin: two", file=sys.stderr) or 2)


def _leaves() -> None:
    sys.exit(5)


@pytest.mark.parametrize(
    ("work", "kind"),
    [
        (_fills_the_memory, "MemoryError"),
        (_warns, "RuntimeWarning: no good"),
        (_says_two_lines, "2 lines of error"),
        (_leaves, "exit status 5"),
        (lambda: None, "out.json is not whole"),
    ],
)
def test_the_harness_sees_each_kind_of_fault(work, kind, tmp_path: Path):
    assert kind in str(fault_of(in_child(work, tmp_path), [tmp_path / "out.json"]))
