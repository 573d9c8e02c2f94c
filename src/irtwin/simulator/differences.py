"""A model with the robot's numbers where a diagnosis says that these are others."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from irtwin.document.document import Cause, Document
from irtwin.effects.catalogue import catalogue
from irtwin.robot.xml_elements import Element
from irtwin.simulator.model import Model
from irtwin.twin.twin import Twin

Key = tuple[str, str, str]  # effect, joint, name of a parameter


def not_held(document: Document) -> tuple[Cause, ...]:
    """Return the likely causes that numbers of the simulator's model cannot hold, or not all of.

    What was there in some runs alone is nothing that a model is to hold.
    """
    lasting = (cause for cause in _likely(document) if not cause.evidence.runs)
    return tuple(cause for cause in lasting if any(parameter.simulator is None for parameter in cause.parameters))


def written(model: Model, document: Document, off: Mapping[Key, float] | None = None) -> bytes:
    """Return the model's file with the robot's numbers of likely causes; all else stays, byte for byte.

    `off`: what is added to a number, by effect, joint and name.
    """
    changed: dict[Element, dict[str, float]] = {}
    for (effect, joint, name), robot in _numbers(document).items():
        element, attribute = model.file.number(model.called[joint], catalogue()[effect].changed_in_mjcf[name])
        number = robot + (off or {}).get((effect, joint, name), 0.0)
        changed.setdefault(element, {})[attribute] = max(number, 0.0)
    return model.file.changed(changed)


def drawn(model: Model, document: Document, twin: Twin | None, rng: np.random.Generator) -> bytes:
    """Return the model's file with the robot's numbers as they could be, drawn from their covariance in the twin."""
    if twin is None or twin.covariance is None:
        return written(model, document)
    keys = [(parameter.effect, parameter.joint or "", parameter.name) for parameter in twin.parameters]
    told = [key for key in _numbers(document) if key in keys]
    places = [keys.index(key) for key in told]
    off = rng.multivariate_normal(np.zeros(len(places)), twin.covariance[np.ix_(places, places)])
    return written(model, document, dict(zip(told, off.tolist(), strict=True)))


def _numbers(document: Document) -> dict[Key, float]:
    """Return the robot's numbers of joints that a model can hold, by effect, joint and name."""
    return {
        (cause.effect, parameter.joint, parameter.name): parameter.robot
        for cause in _likely(document)
        for parameter in cause.parameters
        if parameter.robot is not None and parameter.joint is not None
    }


def _likely(document: Document) -> list[Cause]:
    return [cause for cause in document.causes if cause.likely and cause.scope == "changed" and not cause.folded_away]
