"""Diagnoses written by hand, one for each verdict, of a six-axis robot and its runs."""

from __future__ import annotations

import copy
import math
from typing import Any

from irtwin.document.curves import Curves
from irtwin.document.document import CauseParameter, Document
from irtwin.effects.catalogue import catalogue

JOINTS = [f"joint_a{number}" for number in range(1, 7)]
RUNS = ["reference_1", "reference_2", "work_1", "work_2", "work_3", "work_4"]
REGIMES = ["standstill", "low_speed", "steady_speed", "accelerating", "braking", "reversal", "loaded"]
VERDICTS = ("no_gap", "attributed", "ambiguous", "unexplained")
_NOTHING: dict[str, Any] = {"locations": [], "causes": [], "not_testable": [], "next_experiment": None}
_UNTESTABLE = [
    {"effect": "temperature_dependent_friction", "why": "no joint temperature was logged"},
    {"effect": "payload", "why": "visibility 0.02: joint 6 never turns the load against gravity"},
]


def document(verdict: str) -> Document:
    """A diagnosis as its document."""
    return Document.from_json(diagnosis(verdict))


def diagnosis(verdict: str) -> dict[str, Any]:
    """The JSON of a diagnosis, to be changed at will."""
    said = {"verdict": verdict, "robot": "KR6", "gap": _gap(verdict)} | _NOTHING | _CASES[verdict]
    return copy.deepcopy(with_findings(said))


def curves(verdict: str) -> Curves:
    """What a page draws of it."""
    return Curves.from_json(evidence(verdict))


def evidence(verdict: str) -> dict[str, Any]:
    """The JSON of what a page draws, to be changed at will."""
    if verdict == "no_gap":
        return {"heat_map": _heat_map(0.0), "follows": [], "runs": [], "experiment": None}
    x = [0.02 * step - 1.0 for step in range(101)]
    fitted = [1.8 * math.copysign(1, value or 1) * math.exp(-abs(value) / 0.1) for value in x]
    residual = [value + 0.1 * math.sin(9 * place) for place, value in enumerate(fitted)]
    curve = {
        "channel": "torque",
        "effect": None if verdict == "unexplained" else "stribeck_friction",
        "joint": "joint_a3",
        "variable": "speed",
        "unit": "rad/s",
        "x": x,
        "residual": residual,
        "low": [value - 0.2 for value in residual],
        "high": [value + 0.2 for value in residual],
        "fitted": None if verdict == "unexplained" else fitted,
    }
    judged = [
        {"run": run, "joint": joint, "before": 1.4 + 0.1 * k, "after": 0.5 + 0.05 * k, "floor": 0.4}
        for k, run in enumerate(RUNS[2:])
        for joint in ("joint_a3", None)
    ]
    found = {"heat_map": _heat_map(3.0), "follows": [curve], "runs": judged}
    if verdict == "attributed":
        found |= {"friction": [_friction("joint_a3", "reference", 1.0), _friction("joint_a1", "observed", 2.0)]}
        found["friction"].append(_friction("joint_a3", "observed", 1.5))
    time = [0.5 * step for step in range(100)]
    move = {"time": time, "joints": ["joint_a3"], "units": ["rad"], "q": [[math.sin(value) for value in time]]}
    return found | {"experiment": move if verdict == "ambiguous" else None}


def parameter(value: float, interval: tuple[float, float] | None, simulator: float | None = None) -> CauseParameter:
    """Return a parameter of a cause: how far one joint's dry friction is off a simulator's."""
    return CauseParameter(
        name="Fc", joint="joint_a2", value=value, unit="N m", interval95=interval, simulator=simulator,
        robot=None if simulator is None else simulator + value,
    )  # fmt: skip


def _friction(joint: str, role: str, size: float) -> dict[str, Any]:
    torque = [-size, 0.0, size]
    side = {"speed": [-1.0, 0.0, 1.0], "torque": torque, "low": [t - 0.1 for t in torque]}
    side["high"] = [t + 0.2 for t in torque]
    number = {"effect": "coulomb_friction", "name": "Fc", "value": size, "unit": "N m"}
    numbers = [number | {"lower": size - 0.123, "upper": size + 0.123}]
    points = side | {"torque": [t + 0.05 for t in torque]} if role == "observed" else None
    return (
        {"joint": joint, "role": role, "speed_unit": "rad/s", "unit": "N m", "numbers": numbers}
        | side
        | {"measured": points}
    )


def _gap(verdict: str) -> dict[str, Any]:
    known = {"noise_floor": 0.4, "excess": 0.05, "sensor_noise": 0.3}
    rmse = dict.fromkeys(JOINTS, 0.41) | ({} if verdict == "no_gap" else {"joint_a3": 1.4})
    return {
        "torque": {joint: {"rmse": size} | known for joint, size in rmse.items()},
        "power": {"rmse": 21.0, "noise_floor": None, "excess": None},
        "energy_error_percent": 1.2 if verdict == "no_gap" else 8.4,
    }


def _heat_map(size: float) -> dict[str, Any]:
    excess = [
        [size if (joint, regime) == ("joint_a3", "low_speed") else 0.02 * place for place, regime in enumerate(REGIMES)]
        for joint in JOINTS
    ]
    return {"joints": JOINTS, "regimes": REGIMES, "excess": excess}


def _cause(effect: str, confidence: float, share: float, rivals: list[str], scope: str = "changed") -> dict[str, Any]:
    return {
        "id": f"{effect}@joint_a3",
        "effect": effect,
        "joints": ["joint_a3"],
        "scope": scope,
        "confidence": confidence,
        "parameters": [
            {"name": "Fs", "joint": "joint_a3", "value": 1.82, "unit": "Nm", "interval95": [1.6, 2.04]},
            {"name": "d", "joint": None, "value": 1.0, "unit": "1", "interval95": None},
        ],
        "indistinguishable_from": rivals,
        "evidence": {
            "channel": "torque",
            "share_of_what_is_closed": share,
            "closed_where_it_acts": 0.91,
            "gain": 0.83,
            "log_odds": 6.4,
            "probability_of_rivals": {rival: 0.99 - confidence for rival in rivals} | {"backlash": 0.012},
        },
    }


def findings_of(causes: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The findings of causes: those of one family, scope and joints together."""
    known = catalogue()
    joined: dict[tuple[str, ...], list[dict[str, Any]]] = {}
    for one in causes:
        joined.setdefault((known[one["effect"]].family, one["scope"], *one["joints"]), []).append(one)
    return [
        {
            "id": "@".join(key),
            "family": key[0],
            "scope": key[1],
            "joints": some[0]["joints"],
            "channel": some[0]["evidence"]["channel"],
            "confidence": max(one["confidence"] for one in some),
            "share": 0.93 * sum(one["evidence"]["share_of_what_is_closed"] for one in some),
            "share_interval95": [0.21 * some[0]["confidence"], 0.98 * some[0]["confidence"]],
            "share_of": "the gap above the floor",
            "matters": True,
            "members": [
                {"cause": one["id"], "effect": effect, "family": known[effect].family, "confidence": sure}
                for one in some
                for effect, sure in (
                    (one["effect"], one["confidence"]),
                    *((rival, 0.3 * one["confidence"]) for rival in one["indistinguishable_from"]),
                )
            ],
        }
        for key, some in joined.items()
    ]


def with_findings(said: dict[str, Any]) -> dict[str, Any]:
    """A diagnosis whose findings are those of its causes."""
    return said | {"findings": findings_of(said["causes"])}


def _by_cause(cause: dict[str, Any]) -> dict[str, Any]:
    alone, without = ([0.6, 0.62], [1.3, 1.45]) if "stribeck" in cause["effect"] else ([0.8, 0.72], [1.2, 1.25])
    return {
        "cause": cause["id"],
        **{name: cause[name] for name in ("effect", "joints", "scope")},
        "channel": "torque",
        "share": cause["evidence"]["share_of_what_is_closed"],
        "rmse_before": [1.4, 1.5],
        "rmse_alone": alone,
        "rmse_when_left_out": without,
        "rmse_with_all": [0.5, 0.5],
    }


def _shrink(closed: float | None, after: float, causes: list[dict[str, Any]]) -> dict[str, Any]:
    interval = [after - 0.05, after + 0.05]
    return {
        "held_out_runs": RUNS[2:],
        "noise_floor_from": "repeats",
        "torque_rmse": {"before": 1.45, "after": after, "noise_floor": 0.4, "interval95_after": interval},
        "power_rmse": {"before": 21.0, "after": 17.0, "noise_floor": None, "interval95_after": None},
        "energy_error_percent": {"before": 8.4, "after": 2.1, "noise_floor": None, "interval95_after": [1.0, 3.3]},
        "closed_fraction": None if closed is None else {"value": closed, "interval95": [closed - 0.05, closed + 0.04]},
        "by_cause": [_by_cause(cause) for cause in causes],
    }


def _caused(closed: float, *causes: dict[str, Any]) -> dict[str, Any]:
    """Causes, and what they close."""
    return {"causes": list(causes), "shrink": _shrink(closed, 0.5, list(causes))}


_UNKNOWN = dict.fromkeys(("torque_rmse", "power_rmse", "energy_error_percent"))
_SURE = {"share_interval95": [0.1, 0.9], "excess_interval95": [8.0, 15.0], "false_discovery_rate": 0.001}
_LOCATED = [
    {"channel": "torque", "joint": "joint_a3", "regime": "low_speed", "follows": "speed", "runs": None, "share": 0.81}
    | {"excess": 12.0, "concentration": 2.5}
    | _SURE,
    {"channel": "power", "joint": None, "regime": None, "follows": None, "runs": ["work_1", "work_2"], "share": 0.12}
    | {"excess": 11.0, "concentration": 1.5}
    | _SURE,
]
_CASES: dict[str, dict[str, Any]] = {
    "no_gap": {
        "shrink": _shrink(None, 1.45, []) | _UNKNOWN | {"noise_floor_from": "out_of_band"},
        "not_testable": _UNTESTABLE,
    },
    "attributed": {
        "locations": _LOCATED,
        "not_repeating": [
            {
                **{"id": "line@joint_a3", "channel": "torque", "joint": "joint_a3", "kind": "line"},
                **{"rms": 0.77, "share": 0.66, "explained_by": "viscous_friction@joint_a3"},
                "quantities": [
                    {"name": "f", "joint": "joint_a3", "value": 2.9, "unit": "Hz", "interval95": [2.88, 2.92]},
                    {"name": "A", "joint": "joint_a3", "value": 1.09, "unit": "N m", "interval95": None},
                ],
            }
        ],
        **_caused(0.93, _cause("viscous_friction", 0.7, 0.7, []), _cause("stribeck_friction", 0.96, 0.3, [])),
        "not_testable": _UNTESTABLE,
        "refused": [
            {
                "effect": "torque_constant_error",
                "joints": ["joint_a2"],
                "why": "g = 2.1 (2.05 to 2.16); 0.7 to 1.4 is possible",
            },
            {"effect": "payload", "joints": [], "why": "m = -9 kg (-9.2 to -8.8); at least -3 is possible"},
        ],
        "torque_scale": {
            "uncertainty95": 0.1,
            "source": "assumed",
            "low": 0.9,
            "high": 0.94,
            "why": "The scale of torque is uncertain by 10 %: torque of drives comes from nominal constants",
        },
        "cutoff": {"hz": 9.786, "stated": False, "why": "found: 10 times the bandwidth of the motion"},
    },
    "ambiguous": {
        "locations": _LOCATED,
        **_caused(
            0.9,
            _cause("stribeck_friction", 0.52, 0.6, ["nonlinear_viscous_friction"], "missing"),
            _cause("nonlinear_viscous_friction", 0.44, 0.4, ["stribeck_friction"], "missing"),
        ),
        "next_experiment": {
            "purpose": "tell stribeck_friction from nonlinear_viscous_friction",
            "effects": ["stribeck_friction", "nonlinear_viscous_friction"],
            "joints": ["joint_a3"],
            "motions": ["joint_a3: a ladder of 8 constant speeds, each both ways"],
            "expected_separation": 7.24,
            "separation_now": 1.1,
            "separation_that_is_enough": 2.25,
            "questions": [
                {"effects": ["stribeck_friction", "nonlinear_viscous_friction"]}
                | {"separation_now": 1.1, "expected_separation": 7.24}
            ],
            "programme": {
                "kind": "speed_ladder",
                "joints": ["joint_a3"],
                "seconds": 55.8,
                "set_up_seconds": 0.0,
                "payload_mass": [0.0],
                "taken_off": [],
                "pose": {joint: 0.1 for joint in JOINTS},
                "speeds": {"joint_a3": [0.005, 0.05, 0.5]},
                "amplitudes": {"joint_a3": [0.01, 0.1, 1.0]},
            },
            "considered": [
                {"kind": "speed_ladder", "minutes": 0.9, "expected_separation": 7.24},
                {"kind": "payload", "minutes": 5.7, "expected_separation": 250.0},
            ],
            "note": None,
        },
    },
    "unexplained": {
        "unexplained_because": "much_is_left",
        "locations": _LOCATED,
        "not_testable": _UNTESTABLE,
        "shrink": _shrink(None, 1.4, []),
    },
}
