"""Ids of causes: what they are and where they act, readable, each once in a document."""

from __future__ import annotations

from collections.abc import Iterable, Sequence


def cause_ids(causes: Iterable[tuple[str, Sequence[str]]], joints: Sequence[str]) -> list[str]:
    """Return an id for each cause, given as its effect and its joints; `joints`: all of the robot, in order.

    "coulomb_friction@joint_2", "backlash@joint_1+joint_3", "payload" of the whole robot, "copper_loss@all" of every
    joint of several. The second of the same gets "#2".
    """
    found: list[str] = []
    for effect, on in causes:
        name = effect + (f"@{_named(on, joints)}" if on else "")
        one, count = name, 1
        while one in found:
            count += 1
            one = f"{name}#{count}"
        found.append(one)
    return found


def _named(on: Sequence[str], joints: Sequence[str]) -> str:
    if len(joints) > 1 and set(on) == set(joints):
        return "all"
    return "+".join(sorted(on, key=joints.index))
