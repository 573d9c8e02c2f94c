"""The table of faults that were found counts each kind of each column, of how many."""

from __future__ import annotations

from log_faults import Case, table


def case(field: str, fault: str, *, found: bool, either: bool = False, shown: bool = True) -> Case:
    return Case("R", field, fault, f"{field}_joint_1", found, either, found or shown, ())


def test_the_table():
    lines = table(
        [case("q", "sign", found=True), case("q", "sign", found=False, either=True, shown=False),
         case("tau", "sign", found=True), case("tau", "delay", found=False)]
    ).splitlines()  # fmt: skip
    assert lines[0].split() == ["q", "tau", "all"]
    assert lines[1].split() == ["delay", "0", "of", "1", "0", "of", "1"]
    assert lines[2].split() == ["sign", "1", "of", "2", "1", "of", "1", "2", "of", "3"]
    assert lines[3] == "all: 2 of 4 found (50.0%), 1 more as one of two"
    assert lines[4] == "of those that the data show: 2 of 3 (66.7%)"


def test_a_miss_says_why_and_what_was_said_instead():
    assert case("tau", "delay", found=False).missed() == (
        "missed: delay of tau_joint_1, R: though the data show it; said nothing"
    )
