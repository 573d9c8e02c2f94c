"""What the gap report says from the diagnosis' own file, which the graph names: shares, intervals, the experiment."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from irtwin.effects.catalogue import catalogue
from irtwin.report import wording
from irtwin.report.questions import Answers, Row

Document = Mapping[str, Any]

_MANY = 100.0  # standard deviations: more is said as "over 100"
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
_NUMBERS = {
    "speeds": ("speeds of {}", "rad/s"),
    "amplitudes": ("amplitudes of {}", "rad"),
    "accelerations": ("accelerations of {}", "rad/s²"),
}


def shares(document: Document) -> dict[int, float]:
    """Return each cause's share of what is closed in its channel, by its rank."""
    left = [(one["effect"], one["scope"], one.get("share")) for one in document["shrink"].get("by_cause") or []]
    found = {}
    for rank, cause in enumerate(document["causes"], start=1):
        same = next((one for one in left if one[:2] == (cause["effect"], cause["scope"])), None)
        if same is not None:
            left.remove(same)
            if same[2] is not None:
                found[rank] = same[2]
    return found


def channels(document: Document) -> list[str]:
    """Return the channels that have causes, in the order of their foremost cause."""
    return list(dict.fromkeys((cause.get("evidence") or {}).get("channel", "torque") for cause in document["causes"]))


def largest_first(document: Document) -> list[int]:
    """Return the ranks of the causes in the order of their shares, channel by channel."""
    parts, order = shares(document), channels(document)
    place = {
        rank: (order.index((cause.get("evidence") or {}).get("channel", "torque")), -parts.get(rank, 0.0), rank)
        for rank, cause in enumerate(document["causes"], start=1)
    }
    return sorted(place, key=lambda rank: place[rank])


def ranked(answers: Answers, document: Document) -> Answers:
    """Return the answers with the largest cause first."""
    order = largest_first(document)
    rows = tuple(sorted(answers["causes"].rows, key=lambda row: order.index(row["rank"])))
    return {**answers, "causes": replace(answers["causes"], rows=rows)}


def locations(rows: Sequence[Row], document: Document) -> list[dict[str, Any]]:
    """Return the places of the gap with the intervals that the diagnosis gives them, None where it gives none."""
    kept = {rank: one for rank, one in enumerate(document["locations"], start=1)}
    return [
        {
            **row,
            "interval": kept[row["rank"]].get("share_interval95"),
            "excess": kept[row["rank"]].get("excess"),
            "excess_interval": kept[row["rank"]].get("excess_interval95"),
        }
        for row in rows
    ]


def budgets(document: Document) -> dict[str, dict[str, Any]]:
    """Return, for each channel, what the causes close, what more any function of the motion would, and the rest."""
    found = {}
    for channel, measured in (document["shrink"].get("yardstick") or {}).items():
        if measured.get("closeable") is None:
            continue
        closed = measured["closed"]
        nameless = min(measured["nameless"], 1.0 - closed)
        found[channel] = {"closed": closed, "nameless": nameless, "rest": 1.0 - closed - nameless, **_of(measured)}
    return found


def experiment(document: Document, names: Mapping[str, str]) -> dict[str, Any] | None:
    """Return what a page says of the next experiment; `names`: what effects are called."""
    given = document.get("next_experiment")
    if not given:
        return None
    programme = given.get("programme")
    return {
        "purpose": _named(given["purpose"], given["effects"], names),
        "motions": given.get("motions") or [],
        "facts": _facts(programme, len(document["gap"].get("torque") or {})) if programme else [],
        "settings": _settings(programme) if programme else [],
        "command": (programme or {}).get("command"),
        "enough": given.get("separation_that_is_enough"),
        "separation": _separation(given.get("expected_separation")),
        "questions": [
            {
                "effects": [_name(one, names) for one in question["effects"]],
                "now": _separation(question["separation_now"]),
                "expected": _separation(question["expected_separation"]),
            }
            for question in given.get("questions") or []
        ],
        "considered": [
            {
                "kind": _kind(one["kind"]),
                "duration": _minutes(60.0 * one["minutes"]),
                "separation": _separation(one["expected_separation"]),
                "chosen": bool(programme) and one["kind"] == programme["kind"],
            }
            for one in given.get("considered") or []
        ],
        "note": _named(given["note"], given["effects"], names) if given.get("note") else None,
    }


def _of(measured: Document) -> dict[str, Any]:
    return {"of": measured.get("of", "the gap above the floor"), "by_regression": measured.get("by_regression")}


def _facts(programme: Document, joints: int) -> list[tuple[str, str]]:
    loads = [mass for mass in programme.get("payload_mass") or [] if mass]
    named = programme["joints"]
    return [
        ("Motion", wording.duration(programme["seconds"])),
        ("Set-up", _minutes(programme.get("set_up_seconds") or 0.0)),
        ("Joints", "all" if len(named) == joints else wording.listed(named)),
        ("Payload", f"without, then with {wording.quantity(loads[0], 'kg', 2)}" if loads else ""),
        ("Temperatures", " and ".join(f"{value:g} °C" for value in programme.get("temperatures") or [])),
    ]


def _minutes(seconds: float) -> str:
    return f"{seconds / 60:.2g} min" if seconds else ""


def _kind(kind: str) -> str:
    """Return a kind of programme in words; one `without_` an effect says how that is taken off."""
    effect = catalogue().get(kind.removeprefix("without_"))
    if kind.startswith("without_") and effect is not None:
        return f"a motion {effect.taken_off}"
    return _KINDS.get(kind, kind.replace("_", " "))


def _settings(programme: Document) -> list[tuple[str, str]]:
    """Return what to enter at the controller, joints of one setting together."""
    said = []
    if programme.get("pose"):
        said.append(("Pose", ", ".join(f"{name} {wording.given(q)}" for name, q in programme["pose"].items()) + " rad"))
    for key, (text, unit) in _NUMBERS.items():
        alike: dict[tuple[float, ...], list[str]] = {}
        for joint, values in (programme.get(key) or {}).items():
            alike.setdefault(tuple(values), []).append(joint)
        for values, joints in alike.items():
            numbers = ", ".join(wording.given(value) for value in values)
            said.append((text.format(wording.listed(joints)).capitalize(), f"{numbers} {unit}"))
    for joint, values in (programme.get("poses") or {}).items():
        said.append((f"Angles of {joint}", ", ".join(wording.given(value) for value in values) + " rad"))
    return said


def _separation(value: float | None) -> str:
    if value is None:
        return wording.NONE
    return f"over {_MANY:g}" if value > _MANY else wording.number(value, 2)


def _name(effect: str, names: Mapping[str, str]) -> str:
    return names.get(effect, effect.replace("_", " "))


def _named(text: str, effects: Sequence[str], names: Mapping[str, str]) -> str:
    """Return a text with what effects are called in place of their ids."""
    for effect in sorted(effects, key=len, reverse=True):
        text = text.replace(effect, _name(effect, names))
    return text
