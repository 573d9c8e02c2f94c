"""The text of dataset.toml, each key explained; what nobody said stands as a comment, to be filled in."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

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
_POWER_AT = "where power (voltage and current) is measured: mains or dc_bus"


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
    lines = [
        "# A data set of irtwin: what a robot is, and what it did. docs/LOG_FORMAT.md says what each key means.",
        "# Units are SI: m, rad, s, kg, N m, A, W; temperatures in degC.",
        "# A key with # before it is optional and was not said: where you know it, fill it in and remove the #.",
        "",
        *_robot_lines(name, origin, power_at, power_at_why, metered=robot is not None and not robot.joints),
    ]
    for place, joint in enumerate(robot.joints if robot else ()):
        sheet = {key: getattr(joint, key) for key, _, _ in _SHEET}
        if gear_ratios and joint.name in gear_ratios:
            sheet["gear_ratio"] = gear_ratios[joint.name]
        lines += ["", f"[robot.joint.{_key(joint.name)}]", *_sheet_lines(sheet, explained=place == 0)]
    if robot is None:
        lines += ["", "# [robot.joint.NAME]  # the data sheet of a joint of the URDF; one such table a joint"]
        lines += [line if line.startswith("#") else f"# {line}" for line in _sheet_lines({})]
    lines += [
        "",
        "[twin]",
        _line("effects", list(BASELINE), "what the twin models; without it, these and what the runs show", False),
        _line("cutoff", 10.0, "Hz, of the low-pass filter that all runs pass; without it, found", False),
        "",
        "[topics]  # for runs that are ROS bags in which several topics would do",
        _line("joint_states", "/joint_states", "the topic of the joint states", False),
    ]
    for run in runs:
        lines += ["", *_run_lines(run)]
    if not runs:
        lines += ["", "# One table a run, one file a run (CSV, Parquet or ROS bag); there must be at least one."]
        lines += [
            line if line.startswith("#") else f"# {line}"
            for line in _run_lines(RunText("runs/NAME.csv", "relative to this file"))
        ]
    return "\n".join([*lines, ""])


def _robot_lines(name: str, origin: str, power_at: str | None, why: str, metered: bool) -> Iterator[str]:
    yield "[robot]"
    yield _line("name", name, "its name, here and in the graph: no two robots may share one")
    if metered:
        yield _line("joints", [], "a meter's log: no joint was logged, so there is no twin")
    else:
        yield _line("urdf", "robot.urdf", f"its kinematics: {origin}")
    yield _line("power_at", power_at or "mains", f"{_POWER_AT}{'; ' + why if why else ''}", power_at is not None)
    yield _line("manufacturer", "MAKER", "text", False)
    yield _line("type", "articulated", "text", False)
    yield _line("weight", 50.0, "kg, of the whole arm", False)
    yield _line("rated_payload", 6.0, "kg", False)
    yield _line("arm_movement_type", "RRRRRR", "without it, the joints in letters", False)
    yield _line("ambient_temperature", 22.0, "degC", False)
    yield _line(
        "torque", "motor current times torque constant times gear ratio", "a note: how torque was measured", False
    )
    yield _line("torque_scale_uncertainty", 0.1, "share by which torque may be off on all joints alike", False)
    yield _line("simulated", True, "where a simulator made the logs", False)


def _sheet_lines(sheet: dict[str, float | None], explained: bool = True) -> list[str]:
    return [
        _line(key, example if sheet.get(key) is None else sheet[key], meaning * explained, sheet.get(key) is not None)
        for key, example, meaning in _SHEET
    ]


def _run_lines(run: RunText) -> Iterator[str]:
    yield "[[run]]"
    yield _line("file", run.file, run.about)
    yield _line("role", run.role, "observed; reference: the healthy past; simulated; planned: a motion alone")
    yield _line("payload_mass", run.payload_mass, f"kg: {run.payload_why}")
    yield _line("payload_com", list(run.payload_com), "m, its centre of mass in the flange frame")
    if run.started is None:
        yield _line("started", "2026-03-02T08:00:00Z", "without it, the time of irtwin run", False, bare=True)
    else:
        moment = run.started.isoformat().replace("+00:00", "Z")
        yield _line("started", moment, "of the log's first sample; UTC where the log names no zone", bare=True)
    yield _line(
        "repeat_of", "runs/OTHER.parquet", "the run of the same programmed motion: tells the noise floor", False
    )
    yield _line("performs", "NAME", "the planned run that it carried out", False)
    yield _line("product", "bracket 12", "what the run made", False)
    yield _line("pieces", 40, "how many of it: tells the energy of a piece", False)
    yield _line("cycles", 40, "how often its programme ran: tells the energy of a cycle", False)
    if run.columns:
        yield "# Its columns were taken so:"
    for column in run.columns:
        if column.channel:
            yield _comment(
                f"#   {column.channel} is {column.column}, in {column.unit}, conversion: {column.conversion} "
                f"({column.why})"
            )


def _line(key: str, value: Any, comment: str, stated: bool = True, bare: bool = False) -> str:
    text = f"{'' if stated else '# '}{key} = {value if bare else _value(value)}"
    return _comment(f"{text:<{_WIDE}}  # {comment}" if comment else text)


def _value(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def _key(name: str) -> str:
    plain = name.isascii() and name.replace("_", "").replace("-", "").isalnum()
    return name if plain else _value(name)


def _comment(line: str) -> str:
    """Return a line of which no name breaks out: a comment ends where its line does."""
    return "".join(sign if sign.isprintable() else " " for sign in line)
