"""A model with the robot's numbers where a diagnosis says that these are others."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from irtwin.document.document import Cause, Document
from irtwin.effects.catalogue import catalogue
from irtwin.gap.beside_file import bodies_differ
from irtwin.robot.xml_elements import Element
from irtwin.simulator.bodies import BodiesBeside
from irtwin.simulator.model import Model
from irtwin.simulator.writing import IN_NO_FILE
from irtwin.twin.twin import Twin

Key = tuple[str, str, str]  # effect, joint, name of a parameter


def not_held(document: Document) -> tuple[Cause, ...]:
    """Return the likely causes of which the simulator's model keeps something, with those parameters and joints alone.

    What was there in some runs alone is nothing that a model is to hold.
    """
    kept = []
    for cause in _likely(document):
        parameters = tuple(own for own in cause.parameters if own.simulator is None or own.name in IN_NO_FILE)
        if parameters and not cause.evidence.runs:
            on = {parameter.joint for parameter in parameters}
            joints = tuple(joint for joint in cause.joints if joint in on)
            kept.append(replace(cause, parameters=parameters, joints=joints or cause.joints))
    return tuple(kept)


def written(model: Model, document: Document, twin: Twin | None, off: Mapping[Key, float] | None = None) -> bytes:
    """Return the model's file with the robot's numbers of likely causes; all else stays, byte for byte.

    Where bodies differ, it has all bodies and rotors of the twin with the causes: torque is that of all together.
    `off`: what is added to a number, by effect, joint and name.
    """
    numbers = {
        (joint, catalogue()[effect].changed_in_mjcf[name]): robot + (off or {}).get((effect, joint, name), 0.0)
        for (effect, joint, name), robot in _numbers(document).items()
    }
    beside = bodies_beside(model, document, twin)
    if beside is not None and beside.written:
        numbers |= {(joint, "armature"): inertia for joint, inertia in beside.rotors.items()}
    changed: dict[Element, dict[str, float]] = {}
    for (joint, name), number in numbers.items():
        element, attribute = model.file.number(model.called[joint], name)
        changed.setdefault(element, {})[attribute] = max(number, 0.0)
    return model.file.changed(changed, None if beside is None else beside.written)


def bodies_beside(model: Model, document: Document, twin: Twin | None) -> BodiesBeside | None:
    """Return the model's bodies beside those of the twin with the causes; None where they do not differ."""
    return BodiesBeside(model, twin) if twin is not None and bodies_differ(document.causes) else None


def drawn(model: Model, document: Document, twin: Twin | None, rng: np.random.Generator) -> bytes:
    """Return the model's file with the robot's numbers as they could be, drawn from their covariance in the twin."""
    if twin is None or twin.covariance is None:
        return written(model, document, twin)
    keys = [(parameter.effect, parameter.joint or "", parameter.name) for parameter in twin.parameters]
    told = [key for key in _numbers(document) if key in keys]
    places = [keys.index(key) for key in told]
    off = rng.multivariate_normal(np.zeros(len(places)), twin.covariance[np.ix_(places, places)])
    return written(model, document, twin, dict(zip(told, off.tolist(), strict=True)))


def _numbers(document: Document) -> dict[Key, float]:
    """Return the robot's numbers of joints that a model can hold, by effect, joint and name."""
    return {
        (cause.effect, parameter.joint, parameter.name): parameter.robot
        for cause in _likely(document)
        for parameter in cause.parameters
        if parameter.robot is not None and parameter.joint is not None
        if parameter.name in catalogue()[cause.effect].changed_in_mjcf
    }


def _likely(document: Document) -> list[Cause]:
    return [cause for cause in document.causes if cause.likely and cause.scope == "changed" and not cause.folded_away]
