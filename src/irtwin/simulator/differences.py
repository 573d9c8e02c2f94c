"""What the robot's numbers are where a simulator's are others, and the model with them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from irtwin.document.document import Cause, Document
from irtwin.effects.catalogue import catalogue
from irtwin.simulator.mjcf_file import Tag
from irtwin.simulator.model import Model


@dataclass(frozen=True)
class Difference:
    """A number of a joint that the model has wrong, by its name in MJCF; `interval95` is that of the robot's."""

    joint: str
    name: str
    unit: str
    simulator: float
    robot: float
    interval95: tuple[float, float] | None


def differences(model: Model, document: Document) -> tuple[Difference, ...]:
    """Return the numbers of likely causes that a joint of the model holds; a number below zero is zero in both."""
    found = []
    for cause in _likely(document):
        for parameter in cause.parameters:
            name = catalogue()[cause.effect].in_mjcf.get(parameter.name)
            if name is not None and parameter.joint is not None:
                before = model.numbers(parameter.joint)[name]
                moved = (parameter.value, *(parameter.interval95 or ()))
                robot, *interval = (max(0.0, before + change) for change in moved)
                ends = (interval[0], interval[1]) if interval else None
                found.append(Difference(parameter.joint, name, parameter.unit, before, robot, ends))
    return tuple(found)


def not_held(document: Document) -> tuple[Cause, ...]:
    """Return the likely causes that no number of a joint can hold."""
    return tuple(cause for cause in _likely(document) if not catalogue()[cause.effect].in_mjcf)


def written(model: Model, found: Sequence[Difference]) -> bytes:
    """Return the model's file with the robot's numbers; all else stays, byte for byte."""
    changed: dict[Tag, dict[str, float]] = {}
    for one in found:
        changed.setdefault(model.file.tag(["joint"], "name", one.joint), {})[one.name] = one.robot
    return model.file.changed(changed)


def _likely(document: Document) -> list[Cause]:
    return [cause for cause in document.causes if cause.likely and cause.scope == "changed" and not cause.folded_away]
