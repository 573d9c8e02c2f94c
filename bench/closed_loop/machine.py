"""A machine: an arm with friction, rotors, controller and sensors drawn for it. The seed makes it."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from closed_loop.models import Model
from closed_loop.urdf import urdf

GEAR = 100  # a drive reads its motor's encoder: so much finer than what the log shows of the joint
STEPS = (0.0005, 0.001)  # s, of the integration
INTERVALS = (0.002, 0.004, 0.008, 0.02)  # s, of the log


@dataclass(frozen=True)
class Sensors:
    """What a log shows: `step` rad of encoders, RMS of positions, speeds and torque (n,), meter W; what is logged."""

    step: float
    position: float
    speed: float | None
    torque: np.ndarray
    offset: np.ndarray  # (n,) N m
    meter: float | None
    temperature: bool


@dataclass(frozen=True)
class Machine:
    """A robot as it is (`real`) and as its maker and controller think it is (`nominal`)."""

    model: Model
    real: mujoco.MjModel
    nominal: mujoco.MjModel
    hard: bool  # friction stiffer than MuJoCo's own
    wander: float  # relative, of friction from run to run
    gains: tuple[float, float]  # 1/s^2 and 1/s, per joint inertia
    friction_forward: np.ndarray  # (n,) N m s/rad
    interval: float  # s, of the log
    sensors: Sensors
    torque_constant: np.ndarray  # (n,) N m/A at the joint
    resistance: np.ndarray  # (n,) ohm
    standby: float  # W

    @property
    def step(self) -> float:
        return float(self.real.opt.timestep)

    @property
    def urdf(self) -> str:
        """What the data set says of the robot: masses are the maker's."""
        return urdf(self.model, self.nominal)

    @property
    def inertia(self) -> np.ndarray:
        """Diagonal of the inertia matrix in the middle of the ranges, (n,) kg m^2."""
        data, n = mujoco.MjData(self.real), self.real.nv
        data.qpos[:] = (self.model.lower + self.model.upper) / 2
        mujoco.mj_forward(self.real, data)
        full = np.zeros((n, n))
        mujoco.mj_fullM(self.real, data, full)
        return full.diagonal().copy()

    @property
    def friction_width(self) -> np.ndarray:
        """Speeds at which MuJoCo's dry friction is whole, (n,) rad/s.

        Until then it is (inertia) d/(1 - d) (2 dq/(most T) + ddq), by solref (T) and solimp (d, most).
        """
        real = self.real
        time, (impedance, most) = real.dof_solref[:, 0], real.dof_solimp[:, :2].T
        slope = impedance / (1 - impedance) * 2 / (most * time) / real.dof_invweight0
        return np.asarray(real.dof_frictionloss / slope)


def build(model: Model, seed: int) -> Machine:
    """Draw a machine: friction and rotors by the torque of each drive."""
    rng = np.random.default_rng([seed, 1])
    n = len(model.joints)
    real = model.compiled()
    real.opt.timestep = rng.choice(STEPS, p=(0.3, 0.7))
    real.dof_frictionloss[:] = model.torque * rng.uniform(0.015, 0.05, n)
    real.dof_damping[:] = real.dof_frictionloss * rng.uniform(0.4, 1.5, n)
    real.dof_armature[:] = model.torque * rng.uniform(0.001, 0.006, n)
    hard = bool(rng.random() < 0.5)
    if hard:
        real.dof_solref[:] = [2 * real.opt.timestep, 1.0]
        real.dof_solimp[:, :2] = 0.95, 0.99
    mujoco.mj_setConst(real, mujoco.MjData(real))
    nominal = model.compiled()
    nominal.opt.timestep = real.opt.timestep
    scale = 1 + rng.uniform(-0.2, 0.2, nominal.nbody)
    nominal.body_mass[:] *= scale
    nominal.body_inertia[:] *= scale[:, None]
    mujoco.mj_setConst(nominal, mujoco.MjData(nominal))
    nominal.dof_armature[:] = real.dof_armature * rng.uniform(0.8, 1.2, n)
    bandwidth, damping = rng.uniform(20, 45), rng.uniform(0.7, 1.0)
    return Machine(
        model=model,
        real=real,
        nominal=nominal,
        hard=hard,
        wander=0.01 if rng.random() < 0.5 else 0.0,
        gains=(bandwidth**2, 2 * damping * bandwidth),
        friction_forward=real.dof_damping * rng.uniform(0, 0.8),
        interval=float(rng.choice(INTERVALS)),
        sensors=_sensors(model, rng),
        torque_constant=model.torque / rng.uniform(6, 15, n),
        resistance=rng.uniform(0.5, 3.0, n),
        standby=float(rng.uniform(30, 150)),
    )


def _sensors(model: Model, rng: np.random.Generator) -> Sensors:
    n = len(model.joints)
    encoder = rng.random() < 0.6
    return Sensors(
        step=float(2 * np.pi / 2 ** rng.integers(17, 21)) if encoder else 0.0,
        position=0.0 if encoder else float(10 ** rng.uniform(-5.3, -4.3)),
        speed=float(rng.uniform(0.0005, 0.003)) if rng.random() < 0.5 else None,
        torque=model.torque * rng.uniform(0.0005, 0.003),
        offset=model.torque * rng.uniform(-0.01, 0.01, n),
        meter=float(rng.uniform(0.5, 3.0)) if rng.random() < 1 / 3 else None,
        temperature=bool(rng.random() < 0.5),
    )
