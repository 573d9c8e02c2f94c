"""What the gap report says of the next experiment, in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from irtwin.effects.catalogue import catalogue
from irtwin.report import wording
from irtwin.report.questions import Answers, Row, effect_name

_KINDS = {
    "speed_ladder": "a ladder of constant speeds",
    "slow_sweep": "a slow sweep both ways",
    "small_reversals": "small slow reversals",
    "acceleration_steps": "steps of acceleration",
    "holding_poses": "holding poses",
    "exciting_motion": "an exciting motion",
    "payload": "a motion without and with a payload",
    "warm_up": "a motion from cold and again warm",
}
_SETTINGS = {"speed": "Speeds of {}", "amplitude": "Amplitudes of {}", "acceleration": "Accelerations of {}"}


def experiment(answers: Answers) -> dict[str, Any] | None:
    """Return what a page says of the next experiment beside the rows of its questions, None where there is none."""
    given = answers["next_experiment"].first
    if given is None:
        return None
    names = {wording.local_name(row["effect"]): effect_name(row) for row in answers["experiment_effects"].rows}
    return {
        "purpose": _named(given["purpose"], names),
        "note": _named(given["note"], names) if given["note"] else None,
        "settings": _settings(answers["experiment_settings"].rows),
        "kinds": {row["kind"]: _kind(row["kind"]) for row in answers["experiments_considered"].rows},
    }


def _kind(kind: str) -> str:
    """Return a kind of programme in words; one `without_` an effect says how that is taken off."""
    effect = catalogue().get(kind.removeprefix("without_"))
    if kind.startswith("without_") and effect is not None:
        return f"a motion {effect.taken_off}"
    return _KINDS.get(kind, kind.replace("_", " "))


def _settings(rows: Sequence[Row]) -> list[tuple[str, str]]:
    """Return what to enter at the controller, joints of one setting together."""
    pose = [f"{row['joint']} {wording.given(row['value'], row['unit'])}" for row in rows if row["kind"] == "pose"]
    settings = [("Pose", ", ".join(pose))] if pose else []
    for kind, text in _SETTINGS.items():
        alike: dict[str, list[str]] = {}
        for joint, numbers in _by_joint(rows, kind).items():
            alike.setdefault(numbers, []).append(joint)
        settings += [(text.format(wording.listed(joints)), numbers) for numbers, joints in alike.items()]
    return settings + [(f"Angles of {joint}", numbers) for joint, numbers in _by_joint(rows, "held_pose").items()]


def _by_joint(rows: Sequence[Row], kind: str) -> dict[str, str]:
    """Return each joint's numbers of one kind, with their unit."""
    values: dict[str, list[str]] = {}
    units: dict[str, str] = {}
    for row in rows:
        if row["kind"] == kind:
            values.setdefault(row["joint"], []).append(wording.given(row["value"]))
            units[row["joint"]] = wording.unit_symbol(row["unit"])
    return {joint: f"{', '.join(numbers)} {units[joint]}" for joint, numbers in values.items()}


def _named(text: str, names: Mapping[str, str]) -> str:
    """Return a text with what effects are called in place of their ids."""
    for effect in sorted(names, key=len, reverse=True):
        text = text.replace(effect, names[effect])
    return text
