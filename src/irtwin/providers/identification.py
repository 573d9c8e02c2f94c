"""The provider of twins: fits a robot's effects to its runs, and judges the fit on what was held out."""

from __future__ import annotations

import hashlib
import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime

from irtwin.effects.stack import Stack
from irtwin.gap.choice import identified
from irtwin.identification.base_parameters import base_parameters
from irtwin.identification.validation import FIT, HELD_OUT, Split, split
from irtwin.providers.motions import RobotMotions, robot_motions
from irtwin.providers.provider import Made
from irtwin.providers.records import inputs, load_run, stored_data_set
from irtwin.signals.log import DataSet, Run
from irtwin.storage.database import TWINS, Workspace
from irtwin.storage.schema import BaseParameterRow, ParameterRow, TorqueFit, TwinChoice, TwinEffect, TwinRow, TwinRun
from irtwin.twin.files import to_json
from irtwin.twin.torque_scale import torque_scale
from irtwin.twin.twin import BaseParameter, Choice, Parameter, Twin
from irtwin.twin.validate import validate


def provide(workspace: Workspace, robot_id: str) -> Made:
    """Make a robot's Twin with its effects, parameters, runs and torque fits.

    A simulator's runs stay apart where the robot's own are there: they say what the simulator does.
    """
    known = robot_motions(workspace, robot_id)
    parts = split(known.own, known.repeats)
    twin = identified(fitted_data_set(workspace, robot_id, known, parts), parts.fit)
    return twin_made(workspace, robot_id, twin, known, parts)[1]


def fitted_data_set(workspace: Workspace, robot_id: str, known: RobotMotions, parts: Split) -> DataSet:
    """Return what is fitted as a data set, so that nothing is chosen or diagnosed by what judges."""
    cut = {motion.run: float(motion.time[0]) for motion in parts.held_out}
    names = {motion.run for motion in parts.fit}
    runs = [_fitted(load_run(workspace, known.robot, known.keys[name]), cut.get(name), names) for name in sorted(names)]
    stored = stored_data_set(workspace, robot_id, known.robot)
    return replace(stored, runs=tuple(runs), cutoff=known.cutoff.hz)


def _fitted(run: Run, until: float | None, names: set[str]) -> Run:
    signals = run.signals if until is None else run.signals.rows(run.signals.time < until)
    return replace(run, signals=signals, repeat_of=run.repeat_of if run.repeat_of in names else None)


def twin_made(workspace: Workspace, robot_id: str, twin: Twin, known: RobotMotions, parts: Split) -> tuple[str, Made]:
    """Return the twin_id, rows and file of a robot's twin, which was fitted to `parts` of the known motions."""
    keys = known.keys
    stored = stored_data_set(workspace, robot_id, twin.robot)
    twin = replace(twin, torque_scale=torque_scale(stored, parts.fit, twin.joint_torque))
    document = to_json(twin).encode()
    checksum = hashlib.sha256(document).hexdigest()
    twin_id = f"{robot_id}.{checksum[:12]}"
    row = TwinRow(
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
    return twin_id, Made(
        robot_id=robot_id,
        used=inputs(workspace, robot_id, keys.values()),
        rows=[
            row,
            *(TwinEffect(twin_id=twin_id, effect=effect) for effect in twin.effect_ids),
            *(_choice(twin_id, choice) for choice in twin.choices),
            *_runs(twin_id, keys, parts),
            *_parameters(twin_id, robot_id, twin),
            *_base_parameters(twin_id, twin),
            *_torque_fits(twin_id, robot_id, keys, twin, parts),
        ],
        documents={row.file: document},
    )


def _choice(twin_id: str, choice: Choice) -> TwinChoice:
    return TwinChoice(
        choice_id=f"{twin_id}.{choice.effect}.{'chosen' if choice.chosen else 'open'}",
        twin_id=twin_id,
        effect=choice.effect,
        joints=", ".join(choice.joints) or None,
        chosen=choice.chosen,
        probability=choice.probability,
        rivals=", ".join(choice.rivals) or None,
        rmse_unit=choice.unit,
        rmse_without=choice.rmse_without,
        rmse_with=choice.rmse_with,
        energy_error_without_percent=choice.energy_error_without,
        energy_error_with_percent=choice.energy_error_with,
    )


def body_combinations(twin: Twin) -> int | None:
    """Return how many combinations of the bodies' parameters torque tells apart; None where none was measured."""
    bodies = [effect for effect in twin.stack.effects if effect.bodies]
    if not twin.base_parameters or not bodies:
        return None
    return len(base_parameters(Stack(twin.robot, bodies)).independent)


def _runs(twin_id: str, keys: dict[str, str], parts: Split) -> Iterator[TwinRun]:
    held_out_from = {motion.run: float(motion.time[0]) for motion in parts.held_out}
    for name, run_id in keys.items():
        part = parts.part(name)
        cut = held_out_from[name] if part == "both" else None
        yield TwinRun(twin_id=twin_id, run_id=run_id, part=part, held_out_from_s=cut)


def _parameters(twin_id: str, robot_id: str, twin: Twin) -> Iterator[ParameterRow]:
    seen: Counter[str] = Counter()  # an effect of two shapes in one joint has two parameters of a name
    for parameter in twin.stated:
        place = parameter.joint or parameter.link or "robot"
        key = f"{twin_id}.{parameter.effect}.{place}.{parameter.name}"
        seen[key] += 1
        yield ParameterRow(
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


def _scaled(twin: Twin, parameter: Parameter | BaseParameter) -> dict[str, float]:
    """Return the ends of a parameter's interval with the scale of torque in it; none where it does not go with that."""
    scale = twin.torque_scale
    interval = (
        None if scale is None else scale.interval(parameter.value, parameter.unit, parameter.lower, parameter.upper)
    )
    return {} if interval is None else {"scaled_lower": interval[0], "scaled_upper": interval[1]}


def _base_parameters(twin_id: str, twin: Twin) -> Iterator[BaseParameterRow]:
    for number, parameter in enumerate(twin.base_parameters, start=1):
        yield BaseParameterRow(
            twin_id=twin_id,
            number=number,
            combination=parameter.name,
            value=parameter.value,
            unit=parameter.unit,
            lower=parameter.lower,
            upper=parameter.upper,
            **_scaled(twin, parameter),
        )


def _torque_fits(twin_id: str, robot_id: str, keys: dict[str, str], twin: Twin, parts: Split) -> Iterator[TorqueFit]:
    for part, motions in ((FIT, parts.fit), (HELD_OUT, parts.held_out)):
        for fit in validate(twin, motions):
            if fit.torque_rmse is None or fit.r_squared is None:
                continue
            for joint, error, explained in zip(twin.robot.joint_names, fit.torque_rmse, fit.r_squared, strict=True):
                yield TorqueFit(
                    twin_id=twin_id,
                    run_id=keys[fit.run],
                    joint=joint,
                    part=part,
                    robot_id=robot_id,
                    rmse_nm=float(error),
                    r_squared=float(explained) if math.isfinite(explained) else None,
                )
