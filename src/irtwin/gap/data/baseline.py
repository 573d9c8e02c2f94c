"""The baseline: what the twin models before anything is found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from irtwin.effects.catalogue import BASELINE, catalogue
from irtwin.effects.effect import Effect
from irtwin.effects.prior import Prior
from irtwin.effects.stack import Stack
from irtwin.errors import InputError
from irtwin.robot.description import Joint, Robot
from irtwin.signals.log import DataSet
from irtwin.twin.twin import Twin


@dataclass(frozen=True)
class Baseline:
    """The robot, the effects of its twin (ids, or effects of a shape), and what is known of their coefficients."""

    robot: Robot
    effects: tuple[str | Effect, ...]
    prior: Prior | None = None


def baseline(data_set: DataSet, withhold: Sequence[str], moved: float, twin: Twin | None = None) -> Baseline:
    """Return what the data set's twin models, or a `twin` that is given, less the effects withheld.

    Of a twin: its effects in their shapes, and its numbers as the prior, as far as they can have moved since. Effects
    that act in some runs only are those of its own data, and stay out; those that its data could not show come in as
    the catalogue has them.
    Raises InputError on an effect that cannot be withheld, and on a twin of another robot.
    """
    if twin is None:
        begun = Baseline(data_set.robot, data_set.effects or BASELINE)
    else:
        robot = _same_robot(data_set, twin)
        begun = Baseline(robot, (*twin.standing, *twin.unidentified), _prior(twin, moved))
    ids = Stack(begun.robot, begun.effects).ids
    _check_withheld(withhold, ids)
    return replace(begun, effects=tuple(effect for effect in begun.effects if _id(effect) not in withhold))


def _prior(twin: Twin, moved: float) -> Prior:
    """Return a twin's numbers as prior, each of which may have moved."""
    prior = twin.prior
    spread = {
        (effect.id, term.joint, term.link, term.name): term.spread
        for effect, term in (*twin.stack.torque_terms, *twin.stack.power_terms)
    }
    half = np.array([spread[key] for key in prior.keys]) / 2
    return prior.loosened(moved * np.hypot(prior.values, half))


def said_of_twin(data_set: DataSet, twin: Twin) -> list[str]:
    """Return in words how a twin that is given differs from what the data set says of its twin, and its prior."""
    stated, lines = data_set.effects, []
    given = {effect.id for effect in twin.standing} | set(twin.unidentified)
    if stated is not None and set(stated) != given:
        differences = [
            f"{word} {', '.join(names)}"
            for word, names in (("it has", sorted(given - set(stated))), ("it lacks", sorted(set(stated) - given)))
            if names
        ]
        lines.append(f"[twin] effects of dataset.toml give way to the twin that is given: {'; '.join(differences)}")
    if dropped := sorted({effect.id for effect in twin.stack.effects} - {effect.id for effect in twin.standing}):
        lines.append(f"Of the twin, what acts in some of its own runs only is left out: {', '.join(dropped)}")
    how = "their covariance" if twin.covariance is not None else "their intervals, as the file has no covariance"
    lines.append(f"The twin's numbers are the prior, with {how}")
    if twin.robot.name != data_set.robot.name:
        lines.append(f"The twin is of {twin.robot.name}, the data set of {data_set.robot.name}; joints are the same")
    return lines


def _id(effect: str | Effect) -> str:
    return effect if isinstance(effect, str) else effect.id


def _check_withheld(withhold: Sequence[str], effects: Sequence[str]) -> None:
    known = catalogue()
    for effect in withhold:
        if effect not in known:
            raise InputError(f"--withhold {effect}: there is no such effect; choose from {', '.join(known)}")
        if effect not in effects:
            raise InputError(f"--withhold {effect}: the twin does not have this effect; it has {', '.join(effects)}")
        if known[effect].bodies:
            raise InputError(f"--withhold {effect}: the rigid bodies cannot be withheld; withhold another effect")


def _same_robot(data_set: DataSet, twin: Twin) -> Robot:
    """Return the data set's robot, with what the twin knows of its joints and the data set does not say."""
    robot = data_set.robot
    if [(joint.name, joint.kind) for joint in robot.joints] != [(axis.name, axis.kind) for axis in twin.robot.joints]:
        raise InputError(
            f"{data_set.folder / 'dataset.toml'}: the twin is of another robot, {twin.robot.name} with the joints "
            f"{', '.join(twin.robot.joint_names)}; the data set's has {', '.join(robot.joint_names)}: give its own twin"
        )
    return replace(robot, joints=tuple(_completed(*pair) for pair in zip(robot.joints, twin.robot.joints, strict=True)))


def _completed(joint: Joint, known: Joint) -> Joint:
    unknown = [field.name for field in fields(Joint) if getattr(joint, field.name) is None]
    return replace(joint, **{name: getattr(known, name) for name in unknown})
