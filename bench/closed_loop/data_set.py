"""The data set that a user would hand over: what sensors showed of the traces, and what is known of the runs."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from closed_loop.machine import Machine
from closed_loop.simulation import Trace, measured

TWIN = (
    "rigid_body", "rotor_inertia", "coulomb_friction", "viscous_friction", "torque_offset", "mechanical_power",
    "standby_power",
)  # fmt: skip


def write_data_set(
    folder: Path,
    machine: Machine,
    traces: list[Trace],
    seen: list[np.ndarray],
    roles: list[str],
    repeats: list[int | None],
    seed: int,
) -> None:
    """Write dataset.toml, robot.urdf and the runs; `seen`: the torque of each as its sensors would show it."""
    (folder / "runs").mkdir(parents=True)
    for run, (trace, tau) in enumerate(zip(traces, seen, strict=True)):
        rng = np.random.default_rng([seed, 5, run])
        pq.write_table(_log(machine, trace, tau, rng), folder / "runs" / f"run_{run:02d}.parquet", compression="zstd")
    (folder / "robot.urdf").write_text(machine.urdf, encoding="utf-8")
    (folder / "dataset.toml").write_text(_described(machine, roles, repeats), encoding="utf-8")


def _log(machine: Machine, trace: Trace, tau: np.ndarray, rng: np.random.Generator) -> pa.Table:
    sensors, stride = machine.sensors, round(machine.interval / machine.step)
    q, dq, given, told = (signal[::stride] for signal in (trace.q, trace.dq, trace.tau, tau))
    signals = {
        "q": measured(sensors.step, q + sensors.position * rng.standard_normal(q.shape)),
        "tau": told + sensors.offset + sensors.torque * rng.standard_normal(q.shape),
    }
    if sensors.speed is not None:
        signals["dq"] = dq + sensors.speed * rng.standard_normal(q.shape)
    if sensors.temperature or np.ptp(trace.warmth) > 5:
        signals["temp"] = np.round(trace.warmth[::stride] + 0.05 * rng.standard_normal(q.shape), 1)
    columns = {"time": np.round(machine.interval * np.arange(len(q)), 6)}
    for prefix, values in signals.items():
        columns |= {f"{prefix}_{name}": values[:, k].copy() for k, name in enumerate(machine.model.joints)}
    if sensors.meter is not None:
        copper = machine.resistance * (given / machine.torque_constant) ** 2
        power = machine.standby + (given * dq + copper).sum(axis=1) + sensors.meter * rng.standard_normal(len(q))
        columns["power"] = np.round(power, 1)
    return pa.table(columns)


def _described(machine: Machine, roles: list[str], repeats: list[int | None]) -> str:
    with_power = machine.sensors.meter is not None
    lines = ["[robot]", f'name = "{machine.model.name}"', 'urdf = "robot.urdf"', "simulated = true"]
    lines += ['power_at = "dc_bus"', ""] if with_power else [""]
    for index, name in enumerate(machine.model.joints if with_power else ()):
        lines += [
            f"[robot.joint.{name}]",
            f"torque_constant = {machine.torque_constant[index]:.3f}",
            f"winding_resistance = {machine.resistance[index]:.3f}",
            "",
        ]
    effects = [*TWIN, "copper_loss"] if with_power else list(TWIN)
    lines += ["[twin]", f"effects = {json.dumps(effects)}", ""]
    for run, (role, repeat) in enumerate(zip(roles, repeats, strict=True)):
        lines += ["[[run]]", f'file = "runs/run_{run:02d}.parquet"', f'role = "{role}"']
        lines += ["payload_mass = 0.0", "payload_com = [0.0, 0.0, 0.0]"]
        lines += [f'repeat_of = "runs/run_{repeat:02d}.parquet"'] if repeat is not None else []
        lines.append("")
    return "\n".join(lines)
