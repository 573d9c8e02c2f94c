"""The provider of twins: fits a robot's effects to its runs, and judges the fit on what was held out."""

from __future__ import annotations

import hashlib
import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from datetime import UTC, datetime

from irtwin.effects.catalogue import BASELINE
from irtwin.effects.stack import Stack
from irtwin.gap.isolation.torque_scale import torque_scale_of
from irtwin.gap.thresholds import ScaleOfTorque
from irtwin.identification.base_parameters import base_parameters
from irtwin.identification.validation import FIT, HELD_OUT, Split, split
from irtwin.providers.motions import RobotMotions, robot_motions
from irtwin.providers.provider import Made
from irtwin.providers.records import inputs, stored_data_set
from irtwin.signals.motion import Motion
from irtwin.storage import schema
from irtwin.storage.database import TWINS, Workspace
from irtwin.twin.files import to_json
from irtwin.twin.identify import identify
from irtwin.twin.twin import BaseParameter, Parameter, Twin
from irtwin.twin.validate import validate


def provide(workspace: Workspace, robot_id: str) -> Made:
    """Make a robot's Twin with its effects, parameters, runs and torque fits.

    A simulator's runs stay apart where the robot's own are there: they say what the simulator does.
    """
    known = robot_motions(workspace, robot_id)
    with workspace.reading() as session:
        effects = session.get_one(schema.Robot, robot_id).twin_effects
    parts = split(known.own, known.repeats)
    twin = identify(known.robot, parts.fit, BASELINE if effects is None else tuple(effects.split(",")))
    return twin_made(workspace, robot_id, twin, known, parts)


def twin_made(workspace: Workspace, robot_id: str, twin: Twin, known: RobotMotions, parts: Split) -> Made:
    """Return the rows and the file of a robot's twin, which was fitted to `parts` of the known motions."""
    keys = known.keys
    said = stored_data_set(workspace, robot_id, twin.robot)
    twin = replace(twin, torque_scale=torque_scale_of(twin, said, parts.fit, ScaleOfTorque()))
    document = to_json(twin).encode()
    checksum = hashlib.sha256(document).hexdigest()
    twin_id = f"{robot_id}.{checksum[:12]}"
    row = schema.Twin(
        twin_id=twin_id,
        robot_id=robot_id,
        created=datetime.now(UTC),
        file=f"{TWINS}/{twin_id}.json",
        sha256=checksum,
        cutoff_hz=twin.cutoff,
        cutoff_why=known.cutoff.why,
        condition_number=twin.condition_number,
        base_parameter_count=body_combinations(twin),
        split=parts.rule,
        torque_scale_uncertainty=twin.torque_scale and twin.torque_scale.uncertainty,
        torque_scale_why=twin.torque_scale and twin.torque_scale.why,
    )
    return Made(
        robot_id=robot_id,
        used=inputs(workspace, robot_id, keys.values()),
        rows=[
            row,
            *(schema.TwinEffect(twin_id=twin_id, effect=effect) for effect in twin.effect_ids),
            *_runs(twin_id, keys, parts),
            *_parameters(twin_id, robot_id, twin),
            *_base_parameters(twin_id, twin),
            *_torque_fits(twin_id, robot_id, keys, twin, parts),
        ],
        documents={row.file: document},
    )


def body_combinations(twin: Twin) -> int | None:
    """Return how many combinations of the bodies' parameters torque tells apart; None where none was measured."""
    bodies = [effect for effect in twin.stack.effects if effect.bodies]
    if not twin.base_parameters or not bodies:
        return None
    return len(base_parameters(Stack(twin.robot, bodies)).independent)


def _runs(twin_id: str, keys: dict[str, str], parts: Split) -> Iterator[schema.TwinRun]:
    held_out_from = {motion.run: float(motion.time[0]) for motion in parts.held_out}
    for name, run_id in keys.items():
        part = parts.part(name)
        cut = held_out_from[name] if part == "both" else None
        yield schema.TwinRun(twin_id=twin_id, run_id=run_id, part=part, held_out_from_s=cut)


def _parameters(twin_id: str, robot_id: str, twin: Twin) -> Iterator[schema.Parameter]:
    seen: Counter[str] = Counter()  # an effect of two shapes in one joint has two parameters of a name
    for parameter in twin.stated:
        place = parameter.joint or parameter.link or "robot"
        key = f"{twin_id}.{parameter.effect}.{place}.{parameter.name}"
        seen[key] += 1
        yield schema.Parameter(
            parameter_id=key if seen[key] == 1 else f"{key}.{seen[key]}",
            twin_id=twin_id,
            robot_id=robot_id,
            effect=parameter.effect,
            joint=parameter.joint,
            name=parameter.name if parameter.link is None else f"{parameter.name} of {parameter.link}",
            value=parameter.value,
            unit=parameter.unit,
            lower=parameter.lower,
            upper=parameter.upper,
            **_scaled(twin, parameter),
        )


def _scaled(twin: Twin, one: Parameter | BaseParameter) -> dict[str, float]:
    """Return the ends of a parameter's interval with the scale of torque in it; none where it does not go with that."""
    scale = twin.torque_scale
    found = None if scale is None else scale.interval(one.value, one.unit, one.lower, one.upper)
    return {} if found is None else {"scaled_lower": found[0], "scaled_upper": found[1]}


def _base_parameters(twin_id: str, twin: Twin) -> Iterator[schema.BaseParameter]:
    for number, parameter in enumerate(twin.base_parameters, start=1):
        yield schema.BaseParameter(
            twin_id=twin_id,
            number=number,
            combination=parameter.name,
            value=parameter.value,
            unit=parameter.unit,
            lower=parameter.lower,
            upper=parameter.upper,
            **_scaled(twin, parameter),
        )


def _torque_fits(
    twin_id: str, robot_id: str, keys: dict[str, str], twin: Twin, parts: Split
) -> Iterator[schema.TorqueFit]:
    for part, motions in _parts(parts):
        for fit in validate(twin, motions):
            if fit.torque_rmse is None or fit.r_squared is None:
                continue
            for joint, error, explained in zip(twin.robot.joint_names, fit.torque_rmse, fit.r_squared, strict=True):
                yield schema.TorqueFit(
                    twin_id=twin_id,
                    run_id=keys[fit.run],
                    joint=joint,
                    part=part,
                    robot_id=robot_id,
                    rmse_nm=float(error),
                    r_squared=float(explained) if math.isfinite(explained) else None,
                )


def _parts(parts: Split) -> Iterable[tuple[str, Sequence[Motion]]]:
    return (FIT, parts.fit), (HELD_OUT, parts.held_out)
