"""One run of a machine: closed loop, from the first pose to the last, and what its logger wrote."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from irtwin.demo.plant.arm import PlantPayload
from irtwin.demo.plant.controller import PlantController
from irtwin.demo.plant.drive import Drive, Losses
from irtwin.demo.plant.friction import Friction
from irtwin.demo.plant.machine import Machine, scatter
from irtwin.demo.plant.motion import PlantMotion
from irtwin.demo.plant.sensors import PowerMeter, TorqueSensors, encoder_steps, quantise
from irtwin.demo.plant.supply import Flow, Supply
from irtwin.demo.plant.thermal import Thermal

SETTLE = 0.6  # s, at the first pose before the log starts


@dataclass
class EnergyBook:
    """Where the energy of a run went, J. `grid` is the sum of the others."""

    grid: float = 0.0
    standby: float = 0.0
    rectifier: float = 0.0
    chopper: float = 0.0
    bus: float = 0.0  # more in the capacitor at the end than at the start
    copper: float = 0.0
    iron: float = 0.0
    inverter: float = 0.0
    friction: float = 0.0
    mechanical: float = 0.0  # more kinetic and potential energy at the end

    def residual(self) -> float:
        """Return what is unaccounted for: zero but for the integration error."""
        return 2 * self.grid - float(sum(vars(self).values()))


@dataclass(frozen=True)
class PlantRecording:
    """What the logger wrote, (N,) and (N, n), and what no logger could know."""

    time: np.ndarray  # s
    q: np.ndarray  # rad
    torque: np.ndarray  # N m, joint side
    temperature: np.ndarray  # degC
    power: np.ndarray  # W
    true_q: np.ndarray  # rad
    true_torque: np.ndarray  # N m
    book: EnergyBook = field(repr=False)
    mean_winding_loss: np.ndarray  # (n,) W
    mean_body_loss: np.ndarray  # (n,) W

    def write(self, file: Path, joints: list[str]) -> None:
        """Write the log; single precision holds every sensor's resolution but the clock's."""
        columns = {"time": pa.array(np.round(self.time, 6))}
        for prefix, values in (("q", self.q), ("tau", self.torque), ("temp", self.temperature)):
            for joint, column in zip(joints, values.T, strict=True):
                columns[f"{prefix}_{joint}"] = pa.array(column.astype(np.float32))
        columns["power"] = pa.array(self.power.astype(np.float32))
        file.parent.mkdir(parents=True, exist_ok=True)
        pq.write_table(pa.table(columns), file, compression="zstd", compression_level=15, store_schema=False)


class _Cell:
    """A machine at work: all parts and their states."""

    def __init__(
        self, machine: Machine, motion: PlantMotion, payload: PlantPayload, thermal: Thermal, seed: int
    ) -> None:
        drawings = machine.drawings
        rng = np.random.default_rng([machine.seed, seed])
        jitter = drawings.tolerance.friction_per_run
        friction = scatter(machine.friction, {"coulomb": jitter, "viscous": jitter}, rng)
        self.step = drawings.step
        self.thermal = thermal
        self.arm = machine.arm(payload)
        self.arm.place(motion.q[0])
        self.controller = PlantController(
            drawings.control, drawings.arm(payload), drawings.drive.maximum_torque, motion, self.step
        )
        self.drive = Drive(machine.drive)
        self.friction = Friction(friction, machine.drive.joint_inertia)
        self.supply = Supply(drawings.supply)
        self.encoder_steps = encoder_steps(drawings.sensors, machine.drive.gear_ratio)
        self.torque_sensors = TorqueSensors(drawings.sensors, machine.torque_offset, rng)
        self.meter = PowerMeter(drawings.sensors, machine.meter_gain, drawings.supply.standby, rng)
        self.nominal_constant = drawings.drive.joint_torque_constant
        self.winding_share = drawings.sensors.winding_share
        self.temperature_resolution = drawings.sensors.temperature_resolution
        self.load = np.zeros(motion.q.shape[1])
        self.torque = np.zeros_like(self.load)

    def advance(self, sample: int) -> tuple[Losses, np.ndarray, Flow]:
        """Move on by one step; return electrical losses, friction loss (n,) W and where the power went."""
        data, thermal = self.arm.data, self.thermal
        q, before = data.qpos.copy(), data.qvel.copy()
        wanted = self.controller.torque(sample, quantise(q, self.encoder_steps))
        self.torque = self.drive.torque(wanted, thermal.body, self.step)
        friction = self.friction.torque(q, before, self.load, thermal.body, self.step)
        acceleration = self.arm.advance(self.torque - friction)
        self.load = self.torque - friction - self.drive.data.joint_inertia * acceleration
        speed = 0.5 * (before + data.qvel)
        losses = self.drive.losses(speed, thermal.winding)
        flow = self.supply.advance(float(self.torque @ speed) + losses.total, self.step)
        self.meter.advance(flow.grid, self.step)
        friction_loss = friction * speed
        thermal.advance(losses.copper, np.maximum(friction_loss, 0) + losses.iron, self.step)
        return losses, friction_loss, flow

    def read(self) -> np.ndarray:
        """Return one row of the log without time: q, torque, temperature, power."""
        thermal = self.thermal
        temperature = thermal.body + self.winding_share * (thermal.winding - thermal.body)
        return np.concatenate(
            [
                quantise(self.arm.data.qpos, self.encoder_steps),
                self.torque_sensors.read(self.drive.current * self.nominal_constant),
                quantise(temperature, self.temperature_resolution),
                [self.meter.read()],
            ]
        )


Watch = Callable[[float, float, float], None]


def simulate(
    machine: Machine,
    motion: PlantMotion,
    payload: PlantPayload,
    thermal: Thermal,
    seed: int,
    watch: Watch = lambda time, power, energy: None,
) -> PlantRecording:
    """Let a machine do a motion; `thermal` is warmed by it, `seed` makes the run's noise.

    `watch` is told each sample that is logged: time, s, power by the meter, W, and energy so far, J.
    """
    drawings = machine.drawings
    settle = round(SETTLE / drawings.step)
    stride = round(drawings.log_interval / drawings.step)
    cell = _Cell(machine, motion.held(settle), payload, thermal, seed)
    for sample in range(settle):
        cell.advance(sample)
    n = motion.q.shape[1]
    book, start = EnergyBook(), (cell.supply.stored, cell.arm.energy())
    winding_loss, body_loss = np.zeros(n), np.zeros(n)
    rows, truth = [], []
    for sample in range(len(motion.q)):
        if sample % stride == 0:
            rows.append(cell.read())
            watch(sample * drawings.step, float(rows[-1][-1]), book.grid)
            truth.append(np.concatenate([cell.arm.data.qpos, cell.torque]))
        losses, friction_loss, flow = cell.advance(settle + sample)
        _enter(book, losses, friction_loss, flow, drawings.supply.standby, drawings.step)
        winding_loss += losses.copper / len(motion.q)
        body_loss += (np.maximum(friction_loss, 0) + losses.iron) / len(motion.q)
    book.bus = cell.supply.stored - start[0]
    book.mechanical = cell.arm.energy() - start[1]
    log, true = np.array(rows), np.array(truth)
    return PlantRecording(
        time=drawings.log_interval * np.arange(len(log)),
        q=log[:, :n],
        torque=log[:, n : 2 * n],
        temperature=log[:, 2 * n : 3 * n],
        power=log[:, -1],
        true_q=true[:, :n],
        true_torque=true[:, n:],
        book=book,
        mean_winding_loss=winding_loss,
        mean_body_loss=body_loss,
    )


def _enter(
    book: EnergyBook, losses: Losses, friction_loss: np.ndarray, flow: Flow, standby: float, step: float
) -> None:
    book.grid += step * flow.grid
    book.standby += step * standby
    book.rectifier += step * flow.rectifier
    book.chopper += step * flow.chopper
    book.copper += step * float(losses.copper.sum())
    book.iron += step * float(losses.iron.sum())
    book.inverter += step * float(losses.inverter.sum())
    book.friction += step * float(friction_loss.sum())
