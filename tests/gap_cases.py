"""Diagnoses written by hand, one for each verdict, of a six-axis robot and its runs."""

from __future__ import annotations

import copy
import math
from typing import Any

JOINTS = [f"joint_a{number}" for number in range(1, 7)]
RUNS = ["reference_1", "reference_2", "work_1", "work_2", "work_3", "work_4"]
REGIMES = ["standstill", "low_speed", "steady_speed", "accelerating", "braking", "reversal", "loaded"]
VERDICTS = ("no_gap", "attributed", "ambiguous", "unexplained")
_NOTHING: dict[str, Any] = {"locations": [], "causes": [], "not_testable": [], "next_experiment": None}
_UNTESTABLE = [
    {"effect": "temperature_dependent_friction", "why": "no joint temperature was logged"},
    {"effect": "payload", "why": "visibility 0.02: joint 6 never turns the load against gravity"},
]


def diagnosis(verdict: str) -> dict[str, Any]:
    """A diagnosis as the contract's schema wants it, to be changed at will."""
    return copy.deepcopy(
        {"verdict": verdict, "robot": "KR6", "gap": _gap(verdict), "shrink": {}} | _NOTHING | _CASES[verdict]
    )


def evidence(verdict: str) -> dict[str, Any]:
    """The arrays behind it."""
    if verdict == "no_gap":
        return {"heat_map": _heat_map(0.0), "follows": [], "runs": []}
    x = [0.02 * step - 1.0 for step in range(101)]
    fitted = [1.8 * math.copysign(1, value or 1) * math.exp(-abs(value) / 0.1) for value in x]
    residual = [value + 0.1 * math.sin(9 * place) for place, value in enumerate(fitted)]
    curve = {
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
    time = [0.5 * step for step in range(100)]
    move = {"time": time, "joints": ["joint_a3"], "q": [[math.sin(value) for value in time]]}
    return found | ({"experiment": move} if verdict == "ambiguous" else {})


def _gap(verdict: str) -> dict[str, Any]:
    torque = {
        joint: {
            "rmse": 1.4 if joint == "joint_a3" and verdict != "no_gap" else 0.41,
            "noise_floor": 0.4,
            "excess": 0.05,
        }
        for joint in JOINTS
    }
    return {
        "torque": torque,
        "power": {"rmse": 21.0, "noise_floor": None, "excess": None},
        "energy_error_percent": 1.2 if verdict == "no_gap" else 8.4,
    }


def _heat_map(size: float) -> dict[str, Any]:
    excess = [
        [size if (joint, regime) == ("joint_a3", "low_speed") else 0.02 * place for place, regime in enumerate(REGIMES)]
        for joint in JOINTS
    ]
    return {"joints": JOINTS, "regimes": REGIMES, "excess": excess}


def _cause(effect: str, confidence: float, rivals: list[str], scope: str = "changed") -> dict[str, Any]:
    return {
        "effect": effect,
        "joints": ["joint_a3"],
        "scope": scope,
        "confidence": confidence,
        "parameters": [
            {"name": "Fs", "joint": "joint_a3", "value": 1.82, "unit": "Nm", "interval95": [1.6, 2.04]},
            {"name": "d", "value": 1.0, "unit": "1", "interval95": None},
        ],
        "indistinguishable_from": rivals,
        "evidence": {"p_value": 0.002, "visibility": 0.61, "gain_on_held_out_runs": 0.83},
    }


def _shrink(closed: float | None, after: float, scope: str = "changed") -> dict[str, Any]:
    return {
        "held_out_runs": RUNS[2:],
        "noise_floor_from": "repeats",
        "torque_rmse": {
            "before": 1.45,
            "after": after,
            "noise_floor": 0.4,
            "interval95_after": [after - 0.05, after + 0.05],
        },
        "power_rmse": {"before": 21.0, "after": 17.0, "noise_floor": None, "interval95_after": None},
        "energy_error_percent": {"before": 8.4, "after": 2.1, "interval95_after": [1.0, 3.3]},
        "closed_fraction": None if closed is None else {"value": closed, "interval95": [closed - 0.05, closed + 0.04]},
        "yardstick": {
            "torque": {
                "closed": 0.9,
                "closeable": 0.95,
                "by_regression": 0.7,
                "nameless": 0.04,
                "of": "the gap above the floor",
            },
            "power": {"closed": None, "closeable": None, "by_regression": None, "nameless": None},
        },
        "by_cause": [
            {
                "effect": "viscous_friction",
                "scope": scope,
                "channel": "torque",
                "share": 0.7,
                "rmse_before": [1.4, 1.5],
                "rmse_alone": [0.8, 0.72],
                "rmse_when_left_out": [1.2, 1.25],
            },
            {
                "effect": "stribeck_friction",
                "scope": scope,
                "channel": "torque",
                "share": 0.3,
                "rmse_before": [1.4, 1.5],
                "rmse_alone": [0.6, 0.62],
                "rmse_when_left_out": [1.3, 1.45],
            },
        ],
    }


_LOCATED = [
    {"channel": "torque", "joint": "joint_a3", "regime": "low_speed", "follows": "speed", "runs": None, "share": 0.81},
    {"channel": "power", "joint": None, "regime": None, "follows": None, "runs": ["work_1", "work_2"], "share": 0.12},
]
_CASES: dict[str, dict[str, Any]] = {
    "no_gap": {
        "shrink": {
            "held_out_runs": RUNS[2:],
            "noise_floor_from": "out_of_band",
            "closed_fraction": None,
            "by_cause": [],
        },
        "not_testable": _UNTESTABLE,
    },
    "attributed": {
        "locations": _LOCATED,
        "causes": [_cause("stribeck_friction", 0.96, []), _cause("viscous_friction", 0.7, [])],
        "not_testable": _UNTESTABLE,
        "shrink": _shrink(0.93, 0.5),
    },
    "ambiguous": {
        "locations": _LOCATED,
        "causes": [
            _cause("stribeck_friction", 0.52, ["nonlinear_viscous_friction"], "missing"),
            _cause("nonlinear_viscous_friction", 0.44, ["stribeck_friction"], "missing"),
        ],
        "shrink": _shrink(0.9, 0.5, "missing"),
        "next_experiment": {
            "purpose": "tell stribeck_friction from nonlinear_viscous_friction",
            "effects": ["stribeck_friction", "nonlinear_viscous_friction"],
            "joints": ["joint_a3"],
            "motions": ["joint_a3: a ladder of 8 constant speeds, each both ways"],
            "expected_separation": 7.24,
            "separation_now": 1.1,
            "separation_that_is_enough": 5.0,
            "questions": [
                {
                    "effects": ["stribeck_friction", "nonlinear_viscous_friction"],
                    "separation_now": 1.1,
                    "expected_separation": 7.24,
                    "not_imitated_now": 0.01,
                    "expected_not_imitated": 0.4,
                }
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
    "unexplained": {"locations": _LOCATED, "not_testable": _UNTESTABLE, "shrink": _shrink(None, 1.4)},
}
