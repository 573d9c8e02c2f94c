"""What to measure next: the motion, payload or warm-up that tells rivals apart."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

# what brings an effect out against those it is taken for
_BY_EFFECT = {
    "stribeck_friction": "a ladder of constant speeds, from 0.005 rad/s to a fifth of the limit, both ways",
    "nonlinear_viscous_friction": "a ladder of constant speeds up to the joint's limit, both ways",
    "asymmetric_friction": "the same constant speeds both ways, and holding still between them",
    "load_dependent_friction": "the same motion with the rated payload and without it",
    "torque_constant_error": "holding still in loaded poses with a weighed payload and without it",
    "temperature_dependent_friction": "the same motion every few minutes from a cold start, temperatures logged",
    "presliding_hysteresis": "slow reversals of 0.1 to 5 mrad around one pose",
    "backlash": "slow reversals where gravity's torque changes sign",
    "joint_elasticity": "short steps of acceleration, logged at 500 Hz or more",
    "torque_ripple": "one slow, constant speed over a full turn",
    "position_dependent_friction": "one slow, constant speed both ways over the joint's whole range",
    "cable_drag": "slow motion both ways over the joint's whole range, the hose package on and off",
    "gravity_compensation": "slow motion of the second joint over its whole range, arm stretched and folded",
    "payload": "the same motion with the tool on and off",
    "base_tilt": "the first joint turned slowly through its range with the arm stretched",
    "torque_drift": "holding one pose for ten minutes",
    "encoder_offset": "holding still in many loaded poses",
    "time_delay": "sines of rising frequency, up to 5 Hz",
    "copper_loss": "holding still in loaded poses, then in unloaded ones, brakes open",
    "inverter_loss": "holding still in poses of rising load, brakes open",
    "iron_loss": "constant speeds up to the limit in poses without load",
    "no_regeneration": "lowering a payload fast, one joint at a time, then two against each other",
    "bus_capacitor": "hard stops from full speed, power logged at 100 Hz or more",
    "holding_brakes": "standing with brakes closed, then open",
    "meter_lag": "steps of power, logged together with the motion",
    "meter_gain": "standing still with a load of known power on the same meter",
    "standby_power": "standing still for a minute, drives on",
}


def next_experiment(
    causes: Sequence[tuple[str, Sequence[str], Sequence[str]]], lacking: Sequence[str]
) -> dict[str, Any] | None:
    """Return what tells rivals apart: causes as (effect, joints, rivals); else what shows the effects `lacking`."""
    for effect, joints, rivals in causes:
        if rivals:
            motions = [_BY_EFFECT[name] for name in (effect, *rivals) if name in _BY_EFFECT]
            return {
                "purpose": f"tell {effect} from {', '.join(rivals)}",
                "effects": [effect, *rivals],
                "joints": list(joints),
                "motions": motions,
                "expected_separation": None,
            }
    motions = [_BY_EFFECT[name] for name in lacking if name in _BY_EFFECT]
    if not motions:
        return None
    return {
        "purpose": f"show {', '.join(lacking)}",
        "effects": list(lacking),
        "joints": [],
        "motions": list(dict.fromkeys(motions)),
        "expected_separation": None,
    }
