"""Twins as JSON files."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import MISSING, asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from irtwin.document import form
from irtwin.document.odd_stretch import OddStretch
from irtwin.effects.catalogue import catalogue
from irtwin.effects.effect import Effect
from irtwin.effects.stack import Stack
from irtwin.errors import InputError
from irtwin.identification.remainder import Remainder
from irtwin.input_file import read_text
from irtwin.json_text import parse_json
from irtwin.robot.description import Robot
from irtwin.robot.urdf import parse_urdf
from irtwin.twin.torque_scale import FittedTorqueScale
from irtwin.twin.twin import BaseParameter, Choice, Parameter, Twin

_FORMAT, _VERSION = "irtwin twin", 1
_LARGEST = 100_000_000  # bytes
_MEND = "save the twin again"


@dataclass(frozen=True)
class _Sheet:
    """What is known of a joint beside the URDF."""

    gear_ratio: float | None
    rotor_inertia: float | None
    torque_constant: float | None
    winding_resistance: float | None
    acceleration: float | None
    friction_width: float | None
    friction_exponent: float | None


@dataclass(frozen=True)
class _Robot:
    name: str
    manufacturer: str | None
    type: str | None
    weight: float | None
    joints: Mapping[str, _Sheet]
    urdf: str


@dataclass(frozen=True)
class _Placed:
    """Where an effect of a shape acts."""

    joints: tuple[str, ...] | None
    runs: tuple[str, ...] | None


@dataclass(frozen=True, kw_only=True)
class _Twin:
    """A twin as its file has it, less its effects; `covariance`: the rows of its lower triangle."""

    robot: _Robot
    unidentified: tuple[str, ...]
    fitted: tuple[str, ...]
    cutoff: float | None
    condition_number: float | None
    parameters: tuple[Parameter, ...]
    base_parameters: tuple[BaseParameter, ...]
    covariance: tuple[str, ...] | None = None
    torque_scale: FittedTorqueScale | None = None
    body_change: float | None = None
    quantities: tuple[Parameter, ...] = ()
    remainder: Remainder | None = None
    choices: tuple[Choice, ...] = ()
    odd_stretches: tuple[OddStretch, ...] = ()


def load(path: Path) -> Twin:
    """Read a twin. Raises InputError, naming file and key, where the file is none."""
    return from_json(read_text(path, _LARGEST, "name a twin that irtwin saved"), path)


def to_json(twin: Twin) -> str:
    """Return a twin as JSON text: the same twin, the same text."""
    robot, sheet = twin.robot, [field.name for field in fields(_Sheet)]
    sheets = {joint.name: _Sheet(*(getattr(joint, key) for key in sheet)) for joint in robot.joints}
    values = {
        field.name: getattr(twin, field.name) for field in fields(_Twin) if field.name not in ("robot", "covariance")
    }
    if twin.covariance is not None:
        rows = enumerate(twin.covariance.tolist(), start=1)
        values["covariance"] = tuple(" ".join(map(repr, row[:length])) for length, row in rows)
    whole = _Twin(robot=_Robot(robot.name, robot.manufacturer, robot.type, robot.weight, sheets, robot.urdf), **values)
    known = {
        field.name: field.default is MISSING or getattr(whole, field.name) not in (None, ()) for field in fields(_Twin)
    }
    document = {name: value for name, value in asdict(whole).items() if known[name]}
    head = {"format": _FORMAT, "version": _VERSION, "robot": document.pop("robot")}
    effects = [_effect_document(effect) for effect in twin.stack.effects]
    return json.dumps({**head, "effects": effects, **document}, indent=1, allow_nan=False) + "\n"


def from_json(text: str | bytes, path: Path) -> Twin:
    """Return the twin of JSON text; `path` is where it stood. Raises InputError, naming file and key."""
    try:
        document = parse_json(text)
    except ValueError as error:
        raise InputError(f"{path}: not JSON ({error}); name a twin that irtwin saved") from error
    if not isinstance(document, dict) or document.get("format") != _FORMAT:
        raise InputError(f'{path}: "format" is not "{_FORMAT}"; name a twin that irtwin saved')
    if document.get("version") != _VERSION:
        raise InputError(f'{path}: "version" is not {_VERSION}; identify the twin again with this irtwin')
    read = form.from_json(_Twin, document, f"{path}, twin", _MEND)
    effects = document.get("effects")
    if not isinstance(effects, list):
        raise InputError(f"{path}, twin.effects must be an array; {_MEND}")
    known = {
        field.name: getattr(read, field.name) for field in fields(read) if field.name not in ("robot", "covariance")
    }
    robot = _robot(path, read.robot)
    twin = Twin(robot, tuple(_effect(path, place, effect) for place, effect in enumerate(effects)), **known)
    _check_complete(path, twin)
    return twin if read.covariance is None else replace(twin, covariance=_covariance(path, read))


def _covariance(path: Path, read: _Twin) -> np.ndarray:
    """Return the covariance of the parameters from the rows of its lower triangle, as text."""
    rows, count = read.covariance or (), len(read.parameters)
    if len(rows) != count:
        raise InputError(f"{path}, twin.covariance must be an array of {count}; {_MEND}")
    lower = np.zeros((count, count))
    for number, row in enumerate(rows):
        try:
            values = np.array(row.split(), dtype=float)
        except ValueError:
            values = np.zeros(0)
        if len(values) != number + 1 or not np.isfinite(values).all():
            raise InputError(f"{path}, twin.covariance[{number}] must be {number + 1} finite numbers; {_MEND}")
        lower[number, : number + 1] = values
    return np.asarray(lower + np.tril(lower, -1).T)


def _effect_document(effect: Effect) -> str | dict[str, Any]:
    """Return the effect's id; with joints, runs and shape where these are not the catalogue's."""
    if effect == catalogue().get(effect.id):
        return effect.id
    shape = {name: value if not isinstance(value, float) else _finite(value) for name, value in effect.shape.items()}
    return {"id": effect.id, "joints": effect.joints, "runs": effect.runs, "shape": shape}


def _finite(value: float) -> float | str:
    """Return a number as JSON can hold it: "inf" and "-inf" as text."""
    return value if math.isfinite(value) else str(value)


def _effect(path: Path, place: int, given: Any) -> Effect:
    where = f"{path}, twin.effects[{place}]"
    name = given.get("id") if isinstance(given, dict) else given
    if not isinstance(name, str):
        raise InputError(f"{where} must be an id, or an object with one; {_MEND}")
    known = catalogue().get(name)
    if known is None:
        raise InputError(f'{path}: there is no effect "{name}"; choose from {", ".join(catalogue())}')
    if isinstance(given, str):
        return known
    placed, shape = form.from_json(_Placed, given, where, _MEND), given.get("shape")
    if not isinstance(shape, dict) or not known.shape.keys() - known.lately <= shape.keys() <= known.shape.keys():
        raise InputError(f"{where}.shape must have {', '.join(known.shape) or 'no key'}; {_MEND}")
    try:
        values = {key: type(value)(shape.get(key, value)) for key, value in known.shape.items()}
    except (TypeError, ValueError) as error:
        raise InputError(f"{where}.shape holds a wrong value ({error}); {_MEND}") from error
    return replace(known, **values, joints=placed.joints, runs=placed.runs)


def _robot(path: Path, read: _Robot) -> Robot:
    robot = parse_urdf(read.urdf, source=f"{path}, URDF in it")
    lacking = [joint for joint in robot.joint_names if joint not in read.joints]
    if lacking:
        raise InputError(f"{path}, twin.robot.joints.{lacking[0]} must be given; {_MEND}")
    joints = tuple(replace(joint, **vars(read.joints[joint.name])) for joint in robot.joints)
    nameplate = {key: getattr(read, key) for key in ("name", "manufacturer", "type", "weight")}
    return replace(robot, **nameplate, joints=joints)


def _check_complete(path: Path, twin: Twin) -> None:
    """Raise where an effect is unknown or one of its coefficients is missing."""
    try:
        stack = Stack(twin.robot, twin.effects)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    for effect, term in (*stack.torque_terms, *stack.power_terms):
        try:
            twin.value(effect.id, term)
        except KeyError:
            place = term.link or term.joint or "robot"
            raise InputError(
                f'{path}: parameter {term.name} of effect "{effect.id}" on {place} is missing; save the twin again'
            ) from None
