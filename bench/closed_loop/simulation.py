"""Runs in closed loop: a joint controller with imperfect feedforward drives MuJoCo's forward dynamics."""

from __future__ import annotations

from dataclasses import dataclass, replace

import mujoco
import numpy as np

from closed_loop.effects import Effect, altered, pushed
from closed_loop.machine import GEAR, Machine
from closed_loop.programmes import Programme, forward

FOLLOWING = 0.5  # rad, a controller that is left behind so far stops the robot
VELOCITY_FILTER = 0.004  # s
SETTLING = 0.5  # s


@dataclass(frozen=True)
class Trace:
    """What was so in one run at each step, (T, n): states, their accelerations, and the drives' torque."""

    q: np.ndarray
    dq: np.ndarray
    ddq: np.ndarray
    tau: np.ndarray
    warmth: np.ndarray  # degC

    def every(self, stride: int) -> Trace:
        return Trace(*(getattr(self, name)[::stride] for name in ("q", "dq", "ddq", "tau", "warmth")))


@dataclass(frozen=True)
class Surroundings:
    """What differs from run to run whether the robot is healthy or not: warmth (T, n) degC, and a friction's level."""

    warmth: np.ndarray
    friction: float


def simulate(
    machine: Machine,
    programme: Programme,
    effects: tuple[Effect, ...],
    run: int,
    around: Surroundings,
) -> Trace:
    """Return what one run does; raise RuntimeError where the robot cannot follow."""
    model = altered(machine, effects, run, around.friction)
    acting = tuple(effect for effect in effects if effect.runs[run])
    data, step, most = mujoco.MjData(model), machine.step, machine.model.torque
    fed = forward(machine, programme)
    stiff, damped = (gain * machine.inertia for gain in machine.gains)
    blend = 1 - np.exp(-step / VELOCITY_FILTER)
    fine = machine.sensors.step / GEAR
    data.qpos[:] = programme.q[0]
    last, speed = measured(fine, programme.q[0]), np.zeros(model.nv)
    out = np.empty((4, *programme.q.shape))
    for row in [*[0] * round(SETTLING / step), *range(len(programme.q))]:  # the log begins when the robot stands
        mujoco.mj_step1(model, data)
        seen = measured(fine, data.qpos)
        speed += blend * ((seen - last) / step - speed)
        last = seen
        lag = programme.q[row] - seen
        if np.abs(lag).max() > FOLLOWING:
            raise RuntimeError(f"{machine.model.name} cannot follow in run {run}")
        tau = np.clip(fed[row] + stiff * lag + damped * (programme.dq[row] - speed), -most, most)
        out[0, row], out[1, row], out[3, row] = data.qpos, data.qvel, tau
        data.qfrc_applied[:] = tau
        if acting:
            data.qfrc_applied += pushed(acting, model, data, row * step, around.warmth[row])
        mujoco.mj_step2(model, data)
        out[2, row] = data.qacc
    q, dq, ddq, given = out
    return Trace(q, dq, ddq, given, around.warmth)


def measured(step: float, q: np.ndarray) -> np.ndarray:
    """Return positions as encoders of a step (rad; 0: without) show them."""
    return np.round(q / step) * step if step else np.array(q)


def planned(machine: Machine, programme: Programme, run: int, around: Surroundings, stride: int) -> Trace:
    """Return the trace of a healthy robot that follows exactly; a sample every `stride` steps, one step each."""
    some = programme.every(stride)
    trace = Trace(some.q, some.dq, some.ddq, some.q, around.warmth[::stride])
    return replace(trace, tau=torque_of(machine, trace, (), run, around.friction, machine.step * stride))


def torque_of(
    machine: Machine, trace: Trace, effects: tuple[Effect, ...], run: int, friction: float, interval: float
) -> np.ndarray:
    """Return the torque that a robot with these effects takes for the states of a trace, (T, n) N m."""
    model = altered(machine, effects, run, friction)
    acting = tuple(effect for effect in effects if effect.runs[run])
    data = mujoco.MjData(model)
    out = np.empty_like(trace.q)
    for row, state in enumerate(zip(trace.q, trace.dq, trace.ddq, trace.warmth, strict=True)):
        data.qpos[:], data.qvel[:], data.qacc[:], warmth = state
        mujoco.mj_inverse(model, data)
        out[row] = data.qfrc_inverse
        if acting:
            out[row] -= pushed(acting, model, data, row * interval, warmth)
    return out
