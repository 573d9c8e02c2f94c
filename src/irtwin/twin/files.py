"""Twins as JSON files."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from irtwin.effects.catalogue import catalogue
from irtwin.effects.effect import Effect
from irtwin.effects.stack import Stack
from irtwin.errors import InputError
from irtwin.identification.remainder import Remainder
from irtwin.input_file import read_text
from irtwin.json_text import parse_json
from irtwin.robot.description import Robot
from irtwin.robot.urdf import parse_urdf
from irtwin.twin.choice import Choice
from irtwin.twin.torque_scale import TorqueScale
from irtwin.twin.twin import BaseParameter, Parameter, Twin

_FORMAT, _VERSION = "irtwin twin", 1
_LARGEST = 100_000_000  # bytes
_SHEET = (
    *("gear_ratio", "rotor_inertia", "torque_constant", "winding_resistance", "acceleration"),
    *("friction_width", "friction_exponent"),
)
_Columns = dict[str, tuple[type | None, ...]]
_PARAMETER: _Columns = {
    "effect": (str,),
    "joint": (str, None),
    "link": (str, None),
    "name": (str,),
    "value": (float,),
    "unit": (str,),
    "lower": (float, None),
    "upper": (float, None),
}
_TORQUE_SCALE: _Columns = {
    "uncertainty": (float,),
    "source": (str,),
    "low": (float,),
    "high": (float,),
    "why": (str,),
}
_REMAINDER: _Columns = {"sample": (float,), "mean": (float,), "seconds": (float,)}
_CHOICE: _Columns = {
    "effect": (str,),
    "probability": (float,),
    "unit": (str, None),
    "rmse_without": (float, None),
    "rmse_with": (float, None),
    "energy_error_without": (float, None),
    "energy_error_with": (float, None),
}
_BASE_PARAMETER: _Columns = {
    "name": (str,),
    "value": (float,),
    "unit": (str,),
    "lower": (float,),
    "upper": (float,),
}


def load(path: Path) -> Twin:
    """Read a twin. Raises InputError, naming file and key, where the file is none."""
    return from_json(read_text(path, _LARGEST, "name a twin that irtwin saved"), path)


def to_json(twin: Twin) -> str:
    """Return a twin as JSON text: the same twin, the same text."""
    robot = twin.robot
    document = {
        "format": _FORMAT,
        "version": _VERSION,
        "robot": {
            "name": robot.name,
            "manufacturer": robot.manufacturer,
            "type": robot.type,
            "weight": robot.weight,
            "joints": {joint.name: {key: getattr(joint, key) for key in _SHEET} for joint in robot.joints},
            "urdf": robot.urdf,
        },
        "effects": [_effect_document(effect) for effect in twin.stack.effects],
        "unidentified": list(twin.unidentified),
        "fitted": list(twin.fitted),
        "cutoff": twin.cutoff,
        "condition_number": twin.condition_number,
        "parameters": [asdict(parameter) for parameter in twin.parameters],
        "base_parameters": [asdict(parameter) for parameter in twin.base_parameters],
    }
    if twin.covariance is not None:
        document["covariance"] = [" ".join(map(repr, row[: k + 1])) for k, row in enumerate(twin.covariance.tolist())]
    if twin.torque_scale is not None:
        document["torque_scale"] = asdict(twin.torque_scale)
    if twin.body_change is not None:
        document["body_change"] = twin.body_change
    if twin.quantities:
        document["quantities"] = [asdict(quantity) for quantity in twin.quantities]
    if twin.remainder is not None:
        document["remainder"] = asdict(twin.remainder)
    if twin.choices:
        document["choices"] = [asdict(choice) for choice in twin.choices]
    return json.dumps(document, indent=1, allow_nan=False) + "\n"


def from_json(text: str | bytes, path: Path) -> Twin:
    """Return the twin of JSON text; `path` is where it stood. Raises InputError, naming file and key."""
    try:
        document = parse_json(text)
    except ValueError as error:
        raise InputError(f"{path}: not JSON ({error}); name a twin that irtwin saved") from error
    reader = _Reader(path, document, "")
    if reader.take("format", str) != _FORMAT:
        raise InputError(f'{path}: "format" is not "{_FORMAT}"; name a twin that irtwin saved')
    if reader.take("version", int) != _VERSION:
        raise InputError(f'{path}: "version" is not {_VERSION}; identify the twin again with this irtwin')
    twin = Twin(
        robot=_robot(path, reader.inner("robot")),
        effects=tuple(_effect(path, place, each) for place, each in enumerate(reader.take("effects", list), 1)),
        parameters=tuple(Parameter(**row) for row in reader.rows("parameters", _PARAMETER)),
        cutoff=reader.take("cutoff", float, None),
        unidentified=tuple(reader.texts("unidentified")),
        base_parameters=tuple(BaseParameter(**row) for row in reader.rows("base_parameters", _BASE_PARAMETER)),
        condition_number=reader.take("condition_number", float, None),
        fitted=tuple(reader.texts("fitted")),
        quantities=tuple(Parameter(**row) for row in reader.rows("quantities", _PARAMETER))
        if "quantities" in document
        else (),
        torque_scale=_torque_scale(reader) if "torque_scale" in document else None,
        remainder=Remainder(**reader.inner("remainder").columns(_REMAINDER)) if "remainder" in document else None,
        choices=tuple(map(_choice, reader.each("choices"))) if "choices" in document else (),
        body_change=reader.take("body_change", float) if "body_change" in document else None,
    )
    _check_complete(path, twin)
    return replace(twin, covariance=_covariance(reader)) if "covariance" in document else twin


class _Reader:
    """An object of the document, whose faults name file and key."""

    def __init__(self, path: Path, values: Any, place: str):
        if not isinstance(values, dict):
            raise InputError(
                f"{path}: {place or 'the document'} should be a JSON object; name a twin that irtwin saved"
            )
        self.path, self.values, self.place = path, values, place

    def fail(self, key: str, what: str) -> InputError:
        return InputError(f'{self.path}: {self.place}"{key}" {what}; save the twin again')

    def take(self, key: str, *kinds: type | None) -> Any:
        if key not in self.values:
            raise self.fail(key, "is missing")
        value = self.values[key]
        if value is None and None in kinds:
            return None
        if float in kinds and isinstance(value, int) and not isinstance(value, bool):
            value = float(value)
        if isinstance(value, bool) or not isinstance(value, tuple(kind for kind in kinds if kind)):
            raise self.fail(key, f"is no {' or '.join(kind.__name__ for kind in kinds if kind)}")
        if isinstance(value, float) and not math.isfinite(value):
            raise self.fail(key, "is not a finite number")
        return value

    def truth(self, key: str) -> bool:
        if not isinstance(self.values.get(key), bool):
            raise self.fail(key, "is neither true nor false")
        return bool(self.values[key])

    def inner(self, key: str) -> _Reader:
        return _Reader(self.path, self.take(key, dict), f'in "{key}": ')

    def texts(self, key: str) -> list[str]:
        values = self.take(key, list)
        if not all(isinstance(value, str) for value in values):
            raise self.fail(key, "holds something that is no text")
        return list(values)

    def rows(self, key: str, columns: _Columns) -> list[dict[str, Any]]:
        return [row.columns(columns) for row in self.each(key)]

    def each(self, key: str) -> list[_Reader]:
        return [_Reader(self.path, row, f'in "{key}", entry {n}: ') for n, row in enumerate(self.take(key, list), 1)]

    def columns(self, columns: _Columns) -> dict[str, Any]:
        return {name: self.take(name, *kinds) for name, kinds in columns.items()}


def _torque_scale(reader: _Reader) -> TorqueScale:
    return TorqueScale(**reader.inner("torque_scale").columns(_TORQUE_SCALE))


def _choice(reader: _Reader) -> Choice:
    joints, rivals = (tuple(reader.texts(key)) for key in ("joints", "rivals"))
    return Choice(**reader.columns(_CHOICE), joints=joints, rivals=rivals, chosen=reader.truth("chosen"))


def _covariance(reader: _Reader) -> np.ndarray:
    """Return the covariance of the parameters from the rows of its lower triangle, as text."""
    rows, count = reader.texts("covariance"), len(reader.take("parameters", list))
    if len(rows) != count:
        raise reader.fail("covariance", f"should have {count} rows")
    lower = np.zeros((count, count))
    for number, row in enumerate(rows):
        try:
            values = np.array(row.split(), dtype=float)
        except ValueError:
            values = np.zeros(0)
        if len(values) != number + 1 or not np.isfinite(values).all():
            raise reader.fail("covariance", f"row {number + 1} is not {number + 1} finite numbers")
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


def _effect(path: Path, place: int, document: Any) -> Effect:
    reader = _Reader(
        path, {"id": document} if isinstance(document, str) else document, f'in "effects", entry {place}: '
    )
    name = reader.take("id", str)
    known = catalogue().get(name)
    if known is None:
        raise InputError(f'{path}: there is no effect "{name}"; choose from {", ".join(catalogue())}')
    if isinstance(document, str):
        return known
    shape = reader.inner("shape").values
    if shape.keys() != known.shape.keys():
        raise reader.fail("shape", f"should have {', '.join(known.shape) or 'no key'}")
    kinds = {key: type(value) for key, value in known.shape.items()}
    try:
        fields = {key: kinds[key](value) for key, value in shape.items()}
    except (TypeError, ValueError) as error:
        raise reader.fail("shape", f"holds a wrong value ({error})") from error
    parts = {
        key: None if reader.take(key, list, None) is None else tuple(reader.texts(key)) for key in ("joints", "runs")
    }
    return replace(known, **fields, **parts)


def _robot(path: Path, reader: _Reader) -> Robot:
    robot = parse_urdf(reader.take("urdf", str), source=f"{path}, URDF in it")
    sheets = reader.inner("joints")
    joints = []
    for joint in robot.joints:
        sheet = sheets.inner(joint.name)
        joints.append(replace(joint, **{key: sheet.take(key, float, None) for key in _SHEET}))
    return replace(
        robot,
        name=reader.take("name", str),
        manufacturer=reader.take("manufacturer", str, None),
        type=reader.take("type", str, None),
        weight=reader.take("weight", float, None),
        joints=tuple(joints),
    )


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
