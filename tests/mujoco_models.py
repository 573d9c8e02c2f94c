"""Models in MuJoCo's format of the synthetic arms."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np

from irtwin.robot.description import Robot


def write(file: Path, robot: Robot, **numbers: np.ndarray) -> Path:
    """Write the robot's model; `numbers` (n,) of its joints: armature, damping, frictionloss."""
    spec = mujoco.MjSpec.from_string(robot.urdf)
    for place, name in enumerate(robot.joint_names):
        for number, values in numbers.items():
            value = float(values[place])
            setattr(spec.joint(name), number, [value, 0.0, 0.0] if number == "damping" else value)
    spec.compile()
    file.write_text(spec.to_xml(), encoding="utf-8")
    return file
