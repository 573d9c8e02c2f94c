"""A model with the robot's numbers where a diagnosis says that these are others."""

from __future__ import annotations

from irtwin.document.document import Cause, Document
from irtwin.effects.catalogue import catalogue
from irtwin.simulator.mjcf_file import Tag
from irtwin.simulator.model import Model


def not_held(document: Document) -> tuple[Cause, ...]:
    """Return the likely causes that no number of the simulator's model can hold."""
    return tuple(cause for cause in _likely(document) if all(one.simulator is None for one in cause.parameters))


def written(model: Model, document: Document) -> bytes:
    """Return the model's file with the robot's numbers of likely causes; all else stays, byte for byte."""
    changed: dict[Tag, dict[str, float]] = {}
    for cause in _likely(document):
        for one in cause.parameters:
            if one.robot is not None and one.joint is not None:
                tag = model.file.tag(["joint"], "name", one.joint)
                changed.setdefault(tag, {})[catalogue()[cause.effect].in_mjcf[one.name]] = one.robot
    return model.file.changed(changed)


def _likely(document: Document) -> list[Cause]:
    return [cause for cause in document.causes if cause.likely and cause.scope == "changed" and not cause.folded_away]
