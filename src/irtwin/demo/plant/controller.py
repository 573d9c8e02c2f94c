"""The controller: position loop over velocity loop, fed forward by the nominal model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irtwin.demo.plant.arm import Arm
from irtwin.demo.plant.motion import PlantMotion


@dataclass(frozen=True)
class ControlData:
    """Gains of the cascade, the same for every joint."""

    position_gain: float  # 1/s
    velocity_gain: float  # 1/s
    integral_time: float  # s
    velocity_filter: float  # s
    friction_forward: np.ndarray  # (n,) N m s/rad, viscous friction that the maker feeds forward
    following_error: float  # rad, the controller stops the robot beyond it


class PlantController:
    """Cascaded position and velocity control of all joints along one motion."""

    def __init__(
        self, data: ControlData, nominal: Arm, maximum_torque: np.ndarray, motion: PlantMotion, step: float
    ) -> None:
        """`nominal` is the arm as its maker thinks it is, `maximum_torque` (n,) N m what the drives may give."""
        self.data, self.maximum_torque, self.motion, self.step = data, maximum_torque, motion, step
        self.forward = np.array(
            [nominal.inverse_dynamics(*state) for state in zip(motion.q, motion.dq, motion.ddq, strict=True)]
        )
        self.forward += data.friction_forward * motion.dq
        self.inertia = np.array([nominal.joint_inertia(q) for q in motion.q[::50]])
        self.integral = np.zeros(motion.q.shape[1])
        self.last = motion.q[0].copy()
        self.velocity = np.zeros_like(self.last)

    def torque(self, sample: int, measured: np.ndarray) -> np.ndarray:
        """Return the joint torque (n,) N m wanted at a sample of the motion, for the measured positions, rad.

        Raises RuntimeError where the robot cannot follow: the motion asks more torque than the drives have.
        """
        d, motion = self.data, self.motion
        blend = 1 - np.exp(-self.step / d.velocity_filter)
        self.velocity = self.velocity + blend * ((measured - self.last) / self.step - self.velocity)
        self.last = measured
        lag = motion.q[sample] - measured
        if np.abs(lag).max() > d.following_error:
            raise RuntimeError(f"joint {np.abs(lag).argmax() + 1} cannot follow at {sample * self.step:.2f} s")
        error = motion.dq[sample] + d.position_gain * lag - self.velocity
        gain = self.inertia[sample // 50] * d.velocity_gain
        wanted = self.forward[sample] + gain * (error + self.integral)
        free = np.abs(wanted) < self.maximum_torque  # no wind-up while saturated
        self.integral = self.integral + free * error * self.step / d.integral_time
        return np.asarray(np.clip(wanted, -self.maximum_torque, self.maximum_torque))
