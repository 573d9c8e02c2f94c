"""Data sets on planned robots: a plan of plain values, the files it stands for, and the strategy that draws plans."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet
from hypothesis import strategies as st
from tests.fuzz.drawn_robots import RobotPlan, joint_names, robots, urdf

from irtwin.errors import InputError
from irtwin.robot.model import inverse_dynamics
from irtwin.robot.urdf import parse_urdf


@dataclass(frozen=True)
class RunPlan:
    """One log. A channel is None (not logged), "model" (what physics gives), or one of `_CHANNELS`."""

    seed: int = 0
    rate: float = 100.0  # Hz
    samples: int = 300
    motion: str = "swing"
    amplitude: float = 0.5
    noise: float = 1e-3
    hold: int = 1  # samples for which positions stay
    jitter: float = 0.0  # of the sampling interval
    start: float = 0.0  # s
    holes: tuple[tuple[float, float], ...] = ()  # place in the run (0..1), length in s
    torque: str | None = "model"
    current: str | None = None
    power: str | None = "model"
    speeds: str | None = None
    temperature: str | None = None
    payload: float = 0.0
    role: str = "observed"
    repeats: bool = False  # the run before
    csv: bool = False


@dataclass(frozen=True)
class DataPlan:
    """A data set: robot, runs, and lines of TOML for its data sheet and twin."""

    robot: RobotPlan
    runs: tuple[RunPlan, ...]
    sheet: tuple[tuple[str, float], ...] = ()
    effects: tuple[str, ...] | None = None
    power_at: str = "mains"


def write(plan: DataPlan, folder: Path) -> Path:
    """Write the data set into a new folder; return it."""
    (folder / "runs").mkdir(parents=True)
    text = urdf(plan.robot)
    (folder / "robot.urdf").write_text(text, encoding="utf-8")
    moving = [
        name
        for name, axis in zip(joint_names(plan.robot), plan.robot.axes, strict=True)
        if axis.kind not in ("fixed", "mimic")
    ]
    lines = ["[robot]", f"name = {_quoted(plan.robot.name)}", 'urdf = "robot.urdf"', f'power_at = "{plan.power_at}"']
    for name in moving if plan.sheet else ():
        lines += [f"[robot.joint.{_quoted(name)}]", *(f"{key} = {value}" for key, value in plan.sheet)]
    for place, run in enumerate(plan.runs):
        file = f"runs/run_{place}.{'csv' if run.csv else 'parquet'}"
        lines += ["[[run]]", f'file = "{file}"', f'role = "{run.role}"', f"payload_mass = {run.payload}"]
        if run.repeats and place:
            lines.append(f'repeat_of = "runs/run_{place - 1}.{"csv" if plan.runs[place - 1].csv else "parquet"}"')
        table = pa.table(columns(run, text, moving))
        if run.csv:
            pa.csv.write_csv(table, folder / file)
        else:
            pa.parquet.write_table(table, folder / file)
    if plan.effects is not None:
        lines += ["[twin]", f"effects = {json.dumps(plan.effects)}"]
    (folder / "dataset.toml").write_text("\n".join([*lines, ""]), encoding="utf-8")
    return folder


def columns(run: RunPlan, robot: str, moving: list[str]) -> dict[str, np.ndarray]:
    """Return a run's columns, of moving joints by name; the robot is URDF text."""
    rng = np.random.default_rng(run.seed)
    even = np.arange(run.samples) / run.rate
    q, dq, ddq = _motion(run, even, len(moving), rng)
    torque = _torque(robot, q, dq, ddq) + 3.0 * np.tanh(50 * dq) + 2.0 * dq
    power = 90.0 + (torque * dq).sum(axis=1) + 0.05 * (torque**2).sum(axis=1)
    time = run.start + even + run.jitter * rng.uniform(-0.5, 0.5, run.samples) / run.rate
    for place, seconds in run.holes:
        time[round(place * run.samples) :] += seconds
    held = np.arange(run.samples) // run.hold * run.hold
    out = {"time": time}
    signals = {"q": q[held] + 1e-2 * run.noise * rng.standard_normal(q.shape)[held]}
    for prefix, how, model in (
        ("tau", run.torque, torque),
        ("i", run.current, torque / 8),
        ("dq", run.speeds, dq),
        ("temp", run.temperature, 30 + 0 * q + even[:, None] / 100),
    ):
        if how is not None:
            signals[prefix] = _channel(how, model, run.noise, rng)
    for prefix, values in signals.items():
        out |= {f"{prefix}_{name}": values[:, place] for place, name in enumerate(moving)}
    if run.power is not None:
        out["power"] = _channel(run.power, power[:, None], 10 * run.noise, rng)[:, 0]
    return out


def _motion(
    run: RunPlan, time: np.ndarray, joints: int, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    speeds, phases = 2 * np.pi * rng.uniform(0.2, 1.5, (2, joints)), rng.uniform(0, 6, (2, joints))
    angle = time[:, None, None] * speeds + phases
    size = run.amplitude * np.ones(joints)
    if run.motion == "one joint":
        size[1:] = 0.0
    if run.motion == "still":
        size[:] = 0.0
    q = (size * np.sin(angle)).sum(axis=1)
    dq, ddq = (size * speeds * np.cos(angle)).sum(axis=1), -(size * speeds**2 * np.sin(angle)).sum(axis=1)
    if run.motion == "steps":
        q = np.round(q * 4) / 4
    if run.motion == "stops":
        moves = (time // 0.5).astype(int) % 2 == 0
        q, dq, ddq = q[np.maximum.accumulate(np.where(moves, np.arange(len(time)), 0))], dq * moves[:, None], ddq
    return q, dq, ddq


def _torque(robot: str, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray) -> np.ndarray:
    try:
        model = parse_urdf(robot).model
    except InputError:
        return np.zeros_like(q)
    if model.nv != q.shape[1]:
        return np.zeros_like(q)
    return inverse_dynamics(model, q, dq, ddq)


_CHANNELS: dict[str, Callable[[np.ndarray, np.random.Generator], np.ndarray]] = {  # what is logged of values, (N, n)
    "zero": lambda values, rng: np.zeros_like(values),
    "constant": lambda values, rng: np.full_like(values, 1.25),
    "random": lambda values, rng: rng.standard_normal(values.shape),
    "huge": lambda values, rng: values * 1e4,
    "tiny": lambda values, rng: values * 1e-12,
    "one dead": lambda values, rng: np.where(np.arange(values.shape[1]) > 0, values, 0.0),
    "last only": lambda values, rng: np.where(np.arange(len(values))[:, None] == len(values) - 1, values, 0.0),
}


def _channel(how: str, model: np.ndarray, noise: float, rng: np.random.Generator) -> np.ndarray:
    values = np.nan_to_num(model) + noise * rng.standard_normal(model.shape)
    return np.clip(_CHANNELS[how](values, rng) if how in _CHANNELS else values, -9e5, 9e5)


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


_EFFECTS = ("rigid_body", "rotor_inertia", "coulomb_friction", "viscous_friction", "torque_offset", "standby_power")
_LOGGED = st.sampled_from(("model",) * 8 + (None, *_CHANNELS))


def _mostly(usual: object, *others: object) -> st.SearchStrategy:
    return st.sampled_from((usual,) * 6 + others)


@st.composite
def _runs(draw: st.DrawFn, plain: bool, large: bool) -> RunPlan:
    run = RunPlan(seed=draw(st.integers(0, 9999)), csv=draw(st.booleans()), torque=draw(_LOGGED), power=draw(_LOGGED))
    if plain:
        return replace(run, torque="model", samples=draw(st.sampled_from((300, 600) if large else (120, 200, 300))))
    return replace(
        run,
        rate=draw(_mostly(100.0, 1.0, 8.0, 25.0, 500.0, 1e-3, 1e5)),
        samples=draw(_mostly(300 if large else 160, 1, 2, 5, 20, 21, 40, 60, 800)),
        motion=draw(_mostly("swing", "still", "one joint", "steps", "stops")),
        amplitude=draw(_mostly(0.5, 1e-9, 1e-3, 1.2, 30.0)),
        noise=draw(_mostly(1e-3, 0.0, 1.0, 1e3)),
        hold=draw(_mostly(1, 2, 3, 7, 100)),
        jitter=draw(_mostly(0.0, 0.5, 0.99)),
        start=draw(_mostly(0.0, -5.0, 1e9, 9.9e10)),
        holes=draw(_mostly((), ((0.5, 10.0),), ((0.3, 2.0), (0.7, 1e3)), ((0.99, 1e6),), ((0.5, 1e9),))),
        current=draw(_mostly(None, "model", "zero", "huge")),
        speeds=draw(_mostly(None, "model", "zero", "random")),
        temperature=draw(_mostly(None, "model", "random", "one dead")),
        payload=draw(_mostly(0.0, 2.0, 1e-9, 1e6)),
        role=draw(_mostly("observed", "reference", "simulated")),
        repeats=draw(_mostly(False, True)),
    )


@st.composite
def data_sets(draw: st.DrawFn, large: bool) -> DataPlan:
    """Draw a data set: a plain robot or plain runs half of the time each, so that something is left to work on."""
    plain = draw(st.booleans())
    return DataPlan(
        robot=draw(robots(large)),
        runs=tuple(draw(st.lists(_runs(plain, large), min_size=1, max_size=4 if large else 2))),
        sheet=draw(st.sampled_from(((), (), (("torque_constant", 8.0),), (("rotor_inertia", 0.0),)))),
        effects=draw(_mostly(None, (), _EFFECTS, ("standby_power",), ("rigid_body",), ("coulomb_friction",))),
        power_at=draw(_mostly("mains", "dc_bus")),
    )
