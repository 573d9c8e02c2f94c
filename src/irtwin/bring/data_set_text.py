"""The text of dataset.toml, each key explained; what nobody said stands as a comment, to be filled in."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from functools import cache
from pathlib import Path
from typing import Any

import jinja2

from irtwin.bring.taken import Taken
from irtwin.effects.catalogue import BASELINE
from irtwin.robot.description import Robot

_WIDE = 34  # characters before a comment
_SHEET = (
    ("gear_ratio", 100.0, "motor turns for one turn of the joint"),
    ("rotor_inertia", 0.5, "kg m^2, reflected to the joint"),
    ("torque_constant", 12.0, "N m/A, reflected to the joint: makes torque of the motor's current"),
    ("winding_resistance", 2.0, "ohm"),
    ("acceleration", 10.0, "rad/s^2 (m/s^2): the joint's limit; irtwin robot excite and plan keep to it"),
    ("kp", 500.0, "N m/rad (N/m): gain of the joint's controller, by which a URDF is played"),
    ("kd", 20.0, "N m s/rad (N s/m): the same for its speed"),
)


@dataclass(frozen=True)
class RunText:
    """A run as dataset.toml lists it; `about` and the `whys` say where what stands there is from."""

    file: str
    about: str
    role: str = "observed"
    payload_mass: float = 0.0
    payload_com: tuple[float, float, float] = (0.0, 0.0, 0.0)
    payload_why: str = "what the controller was told; none was said, 0 is taken"
    started: datetime | None = None
    columns: Sequence[Taken] = ()


_EXAMPLE = RunText("runs/NAME.csv", "relative to this file")


def data_set_text(
    robot: Robot | None,
    name: str,
    runs: Sequence[RunText],
    *,
    origin: str,
    power_at: str | None = None,
    power_at_why: str = "",
    gear_ratios: dict[str, float] | None = None,
) -> str:
    """Return the text for a robot and its runs; of an empty data set where there are none."""
    said = {"robot": robot, "name": name, "runs": runs, "origin": origin, "example": _EXAMPLE}
    power = {"power_at": power_at, "power_at_why": power_at_why}
    return _template().render(**said, **power, gear_ratios=gear_ratios or {}, sheet=_SHEET, baseline=BASELINE)


@cache
def _template() -> jinja2.Template:
    environment = jinja2.Environment(
        undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True
    )
    environment.globals["line"] = _line
    environment.filters |= {"key": _key, "printable": _printable}
    return environment.from_string(Path(__file__).with_name("dataset.toml.jinja").read_text(encoding="utf-8"))


def _line(key: str, value: Any, comment: str, stated: object = True) -> str:
    text = f"{'' if stated else '# '}{key} = {_value(value)}"
    return _printable(f"{text:<{_WIDE}}  # {comment}" if comment else text)


def _value(value: Any) -> str:
    if isinstance(value, datetime):
        return value.isoformat().replace("+00:00", "Z")
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def _key(name: str) -> str:
    plain = name.isascii() and name.replace("_", "").replace("-", "").isalnum()
    return name if plain else _value(name)


def _printable(line: str) -> str:
    """Return a line of which no name breaks out: a comment ends where its line does."""
    return "".join(sign if sign.isprintable() else " " for sign in line)
