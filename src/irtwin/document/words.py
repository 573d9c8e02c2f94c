"""The words of a diagnosis: what its texts name, and what its numbers are measured in."""

from __future__ import annotations

from typing import Annotated

from irtwin.document.form import OneOf
from irtwin.document.told import Names

ONTOLOGY = "https://w3id.org/irtwin"

Measured = Annotated[str, OneOf("torque", "power"), Names(f"{ONTOLOGY}/channel/{{}}", "channel")]
Channel = Annotated[str, OneOf("torque", "power", "position"), Names(f"{ONTOLOGY}/channel/{{}}", "channel")]
Effect = Annotated[str, Names(f"{ONTOLOGY}/effect/{{}}", "effect")]
Joint = Annotated[str, Names("joint/{robot_id}/{}", "joint")]
Regime = Annotated[str, Names(f"{ONTOLOGY}/regime/{{}}")]
Run = Annotated[str, Names("run/{}", "run_id")]

UNITS = {  # of what is measured or set, by its word; where that is of a joint, one that turns
    "torque": "N m",
    "torque_rmse": "N m",
    "power": "W",
    "power_rmse": "W",
    "position": "rad",
    "position_rmse": "rad",
    "flange_rmse": "m",
    "energy_error_percent": "%",
    "pose": "rad",
    "held_pose": "rad",
    "amplitude": "rad",
    "speed": "rad/s",
    "acceleration": "rad/s^2",
}
