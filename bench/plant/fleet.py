"""Runs of one machine side by side: the same closed loop as `simulate`, stepped together, with effects."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from irtwin.demo.plant.arm import PlantPayload
from irtwin.demo.plant.machine import Machine
from irtwin.demo.plant.motion import PlantMotion
from plant.effects import LEVEL, PASSIVE, Effect, State
from plant.near_zero import NearZero

_ONLY_FRICTION = int(
    mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_LIMIT | mujoco.mjtDisableBit.mjDSBL_EQUALITY
)
_DRY_FORWARD = 0.9  # of the drawings' Coulomb friction is fed forward
_DRY_WIDTH = 0.005  # rad/s
_BRAKE = 1000.0  # N m
SETTLE = 0.4  # s, at the first pose before the log starts


@dataclass(frozen=True)
class Traces:
    """What happened, at every step and without sensors: (T, R, n)."""

    q: np.ndarray  # rad, of the links
    dq: np.ndarray  # rad/s
    ddq: np.ndarray  # rad/s^2
    torque: np.ndarray  # N m, of the motors, joint side
    temperature: np.ndarray  # degC


class Fleet:
    """R runs of one machine, each with its motion, payload and warmth."""

    def __init__(
        self,
        machine: Machine,
        motions: list[PlantMotion],
        payloads: list[PlantPayload],
        warmth: np.ndarray,
        jitter: np.ndarray,
        step: float,
        near_zero: NearZero | None = None,
        braked: np.ndarray | None = None,
    ) -> None:
        """`warmth`: (R, n) degC at the start; `jitter`: (R, 2, n) factors of Coulomb and viscous friction.

        near_zero: how dry friction turns at zero speed; None: at once. braked: (T, R) 1 while brakes hold the joints.
        """
        self.braked = np.zeros((1, len(motions))) if braked is None else braked
        self.near_zero = near_zero
        self.machine, self.payloads, self.warmth, self.jitter, self.step = machine, payloads, warmth, jitter, step
        settle = round(SETTLE / step)
        held = [motion.held(settle) for motion in motions]
        self.wanted = [np.stack([getattr(motion, name) for motion in held], axis=1) for name in ("q", "dq", "ddq")]
        self.settle = settle
        self.forward, self.inertia = self._feed_forward()

    def _feed_forward(self) -> tuple[np.ndarray, np.ndarray]:
        """Torque (T, R, n) and inertia (T, R, n) of the arm as drawn, every fourth step, drawn out between."""
        q, dq, ddq = self.wanted
        rows = np.arange(0, len(q), 4)
        torque, inertia = np.empty((len(rows), *q.shape[1:])), np.empty((len(rows), *q.shape[1:]))
        for run, payload in enumerate(self.payloads):
            arm = self.machine.drawings.arm(payload)
            for at, row in enumerate(rows):
                torque[at, run] = arm.inverse_dynamics(q[row, run], dq[row, run], ddq[row, run])
                if at % 16 == 0:
                    diagonal = arm.joint_inertia(q[row, run])
                inertia[at, run] = diagonal
        blend = np.minimum(np.arange(len(q)) / 4, len(rows) - 1)
        low = blend.astype(int)
        high, share = np.minimum(low + 1, len(rows) - 1), (blend - low)[:, None, None]
        torque = torque[low] * (1 - share) + torque[high] * share
        drawings = self.machine.drawings
        dry = _DRY_FORWARD * drawings.friction.coulomb * np.tanh(dq / _DRY_WIDTH)
        return torque + drawings.control.friction_forward * dq + dry, inertia[low]

    def run(self, effects: tuple[Effect, ...] = ()) -> Traces:  # noqa: C901 - one loop, every part of the cell in it
        """Simulate all runs with some effects. Raises RuntimeError where a robot cannot follow."""
        drive, control, friction = self.machine.drive, self.machine.drawings.control, self.machine.friction
        q_wanted, dq_wanted, _ = self.wanted
        steps, runs, n = q_wanted.shape
        step = self.step
        by_id = {effect.id: effect for effect in effects}
        soft = [by_id[i] for i in ("joint_elasticity", "backlash") if i in by_id]
        elastic = np.zeros((runs, n), bool)
        for effect in soft:
            elastic |= effect.mask(n) != 0
        arms = self._arms(by_id, elastic)
        contact = by_id.get("external_contact")
        levels = [(LEVEL[e.id], e.shape, e.mask(n)) for e in effects if e.id in LEVEL]
        passives = [(PASSIVE[e.id], e.shape, e.mask(n)) for e in effects if e.id in PASSIVE]
        encoder = by_id.get("encoder_offset")
        encoder_mask = encoder.mask(n) if encoder else None
        rotor = np.tile(drive.joint_inertia, (runs, 1))
        stiffness, gap = self._transmission(by_id, elastic)
        damping = 0.15 * np.sqrt(stiffness * rotor)
        coulomb, viscous = friction.coulomb * self.jitter[:, 0], friction.viscous * self.jitter[:, 1]
        bristled = by_id["presliding_hysteresis"].mask(n) if "presliding_hysteresis" in by_id else np.zeros((runs, n))
        dry = bristled == 0
        bristle_stiffness = np.where(dry, 0.0, coulomb / np.where(dry, 1.0, bristled))
        bristle_damping = 0.4 * np.sqrt(bristle_stiffness * rotor)
        data = [arm.data for arm in arms]
        for arm, pose in zip(arms, q_wanted[0], strict=True):
            arm.place(pose)
        q, dq, ddq = q_wanted[0].copy(), np.zeros((runs, n)), np.zeros((runs, n))
        motor_q, motor_dq = q.copy(), dq.copy()
        z, load, integral, held = np.zeros((4, runs, n))
        seen_before, velocity = q.copy(), dq.copy()
        current = self.forward[0].copy()
        integral_gain, lag_blend = step / control.integral_time, 1 - np.exp(-step / control.velocity_filter)
        drive_blend = 1 - np.exp(-step / drive.current_time_constant)
        limit, gain = drive.maximum_torque, self.inertia * control.velocity_gain
        resolution = 2 * np.pi / 2**17 / drive.gear_ratio
        kept = {name: np.empty((steps - self.settle, runs, n)) for name in ("q", "dq", "ddq", "torque", "temperature")}
        for sample in range(steps):
            time = (sample - self.settle) * step
            seen = np.round(motor_q / resolution) * resolution
            if encoder is not None:
                seen = seen + encoder_mask * (1 + 0.1 * np.sin(seen + encoder.shape["phase"]))
            velocity = velocity + lag_blend * ((seen - seen_before) / step - velocity)
            seen_before = seen
            lag = q_wanted[sample] - seen
            error = dq_wanted[sample] + control.position_gain * lag - velocity
            wanted = self.forward[sample] + gain[sample] * (error + integral)
            braked = self.braked[min(max(sample - self.settle, 0), len(self.braked) - 1), :, None]
            integral = integral + (np.abs(wanted) < limit) * error * integral_gain * (1 - braked)
            current = current + drive_blend * (np.minimum(np.maximum(wanted, -limit), limit) - current)
            temperature = self.warmth + 3.0 * (1 - np.exp(-max(time, 0) / 6))
            state = State(time, motor_q, motor_dq, ddq, load, temperature)
            level = coulomb
            for law, shape, mask in levels:
                level = level + mask * law(state, shape)
            level = np.maximum(level, 0.05 * coulomb)
            if self.near_zero is not None:
                level = level * np.maximum(self.near_zero.share(motor_dq), 1e-6)
            old = z
            z = (z + step * motor_dq) / (1 + step * bristle_stiffness * np.abs(motor_dq) / level)
            bristles = bristle_stiffness * z + bristle_damping * np.exp(-((motor_dq / 0.1) ** 2)) * (z - old) / step
            resisting = bristles + viscous * motor_dq
            for law, shape, mask in passives:
                resisting = resisting + mask * law(state, shape)
            net = current - resisting
            if soft:
                wound = motor_q - q
                open_gap = np.sign(wound) * np.maximum(np.abs(wound) - gap, 0)
                spring = stiffness * open_gap + damping * (np.abs(wound) >= gap) * (motor_dq - dq)
                free = motor_dq + step * (net - spring) / rotor
                stopping = np.clip(free * rotor / step, -level * dry, level * dry)  # what stops it, if it can
                motor_dq = np.where(elastic, free - step * stopping / rotor, 0)
                applied = np.where(elastic, spring, net)
            else:
                applied = net
            sliding = np.where(elastic | ~dry, 0.0, level) + _BRAKE * braked
            if contact is not None:
                self._push(arms, contact, time)
            at = sample - self.settle
            if at >= 0:  # before the step: torque then belongs to the second difference of the positions
                shown = motor_q  # as industrial robots do: encoders sit on the motors
                if encoder is not None:
                    shown = motor_q + encoder_mask * (1 + 0.1 * np.sin(motor_q + encoder.shape["phase"]))
                for name, value in (("q", shown), ("torque", current), ("temperature", temperature)):
                    kept[name][at] = value
                kept["dq"][at] = dq / 2
            for run, d in enumerate(data):
                arms[run].model.dof_frictionloss[:] = sliding[run]
                d.qfrc_applied[:] = applied[run]
                mujoco.mj_step(arms[run].model, d)
                q[run], dq[run], ddq[run], held[run] = d.qpos, d.qvel, d.qacc, d.qfrc_constraint
            if at >= 0:
                kept["dq"][at] += dq / 2
                kept["ddq"][at] = ddq
            load = np.where(elastic, applied, net + held - rotor * ddq)
            motor_q = np.where(elastic, motor_q + step * motor_dq, q)
            motor_dq = np.where(elastic, motor_dq, dq)
            if sample % 100 == 0 and not np.abs(lag).max() < control.following_error:
                raise RuntimeError(f"a joint cannot follow at {time:.2f} s")
        return Traces(**kept)

    def _arms(self, by_id: dict[str, Effect], elastic: np.ndarray) -> list:
        arms = []
        for run, payload in enumerate(self.payloads):
            hidden = by_id.get("payload")
            if hidden is not None and hidden.runs[run]:
                extra = hidden.strength
                mass = payload.mass + extra
                com = (payload.mass * np.array(payload.com) + extra * np.array(hidden.shape["com"])) / mass
                payload = PlantPayload(mass, tuple(com))
            arm = self.machine.arm(payload)
            arm.model.opt.timestep = self.step
            arm.model.opt.enableflags = 0
            arm.model.opt.disableflags = _ONLY_FRICTION
            arm.model.dof_frictionloss[:] = 1.0
            arm.model.dof_solimp[:] = (0.9999, 0.9999, 0.001, 0.5, 2)  # at rest it creeps by less than 1e-4 rad/s
            arm.model.dof_solref[:] = (2 * self.step, 1)
            arm.model.dof_armature[:] = np.where(elastic[run], 0, arm.model.dof_armature)
            tilt = by_id.get("base_tilt")
            if tilt is not None and tilt.runs[run]:
                a, b = tilt.strength * np.cos(tilt.shape["towards"]), tilt.strength * np.sin(tilt.shape["towards"])
                arm.model.opt.gravity[:] = 9.81 * np.array(
                    [np.sin(a), np.sin(b), -np.sqrt(1 - np.sin(a) ** 2 - np.sin(b) ** 2)]
                )
            arms.append(arm)
        return arms

    def _transmission(self, by_id: dict[str, Effect], elastic: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Stiffness (N m/rad) and half of the dead band (rad), (R, n)."""
        n = elastic.shape[1]
        usual = 1500.0 * self.machine.drive.maximum_torque
        stiffness, gap = np.tile(usual, (len(elastic), 1)), np.zeros(elastic.shape)
        if "joint_elasticity" in by_id:
            mask = by_id["joint_elasticity"].mask(n)  # compliance, relative to the usual
            stiffness = np.where(mask > 0, usual / np.maximum(mask, 1e-9), stiffness)
        if "backlash" in by_id:
            gap = by_id["backlash"].mask(n) / 2
        return stiffness, gap

    def _push(self, arms: list, contact: Effect, time: float) -> None:
        start, length = contact.shape["start"], contact.shape["length"]
        share = (time - start) / length
        force = contact.strength * np.sin(np.pi * share) ** 0.5 if 0 < share < 1 else 0.0
        for run in np.flatnonzero(contact.runs):
            arms[run].data.xfrc_applied[-1, :3] = force * np.array(contact.shape["direction"])
