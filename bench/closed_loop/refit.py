"""What a refit of the healthy twin leaves of torque."""

from __future__ import annotations

import numpy as np

from blind.projection import Basis
from closed_loop.machine import Machine
from closed_loop.simulation import Trace
from irtwin.demo.plant.arm import Arm, PlantPayload
from plant.near_zero import NearZero

COARSE = 0.008  # s, between the samples that are fitted


class Refit:
    """A twin that knows states and the turn of dry friction, and fits bodies, rotors, friction and offsets."""

    def __init__(self, machine: Machine, traces: list[Trace], interval: float) -> None:
        """`traces`: of all runs, which are fitted at once; their samples `interval` s apart."""
        self.stride = max(round(COARSE / interval), 1)
        q, dq, ddq = (joined(traces, name)[:: self.stride] for name in ("q", "dq", "ddq"))
        self.basis = Basis(
            Arm(machine.urdf, machine.real.dof_armature.copy(), PlantPayload(), machine.step),
            q,
            dq,
            ddq,
            payload=np.zeros((len(traces), 10)),
            known=np.zeros(len(traces), bool),
            weights=1 / machine.sensors.torque,
            interval=interval * self.stride,
            near_zero=NearZero("ramp", machine.friction_width),
        )

    def left(self, torque: np.ndarray) -> np.ndarray:
        """Return the RMS of what the refit leaves of a torque (T, R, n), (n,) N m."""
        left = self.basis.left(torque[:: self.stride])
        return np.asarray(np.sqrt((left**2).mean(axis=(0, 1))))


def joined(traces: list[Trace], name: str) -> np.ndarray:
    """Return a signal of all runs side by side, (T, R, n)."""
    return np.stack([getattr(trace, name) for trace in traces], axis=1)
