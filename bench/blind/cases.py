"""`python -m blind.cases FOLDER --split development --count 24`: make cases, and apart from them their labels.

A case is a folder in the log format; names and order tell nothing. `labels.json` beside the cases holds what each has,
and its SHA-256 is printed: commit it before a diagnosis sees the cases. FOLDER_healthy holds the same robots and runs
without the effect, for strong singles: what their twin leaves, no refit with the true form could close.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import shutil
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from blind.catalogue import LOCAL, POWER, REGIMES, SLIGHT, TORQUE, UNKNOWN_EFFECTS, WHOLE_ROBOT, Draw, draw
from blind.motions import exciting, work
from blind.projection import STRIDE, Basis, low_pass
from irtwin.demo.plant.arm import PlantPayload
from irtwin.demo.plant.machine import Machine, build
from plant.drawings import read_drawings
from plant.effects import POWER as POWER_EFFECTS
from plant.effects import SENSED, TRANSMISSION, Effect
from plant.fleet import Fleet, Traces
from plant.logger import coloured, power, torque, winding_rise
from plant.near_zero import LAWS, NearZero

ROBOTS = ("pall4", "elbow6", "slim7")
SEEDS = {
    "development": 1_000_000,
    "development_2": 7_000_000,  # a test once, as the next
    "development_3": 13_000_000,
    "development_4": 19_000_000,
    "test": 25_000_000,
    "test_2": 31_000_000,
    "test_3": 37_000_000,
    "test_4": 43_000_000,
    "test_5": 49_000_000,
    "test_6": 55_000_000,
    "local": 84_000_000,  # development
    "laws": 90_000_000,  # development
    "test_7": 96_000_000,
    "test_8": 102_000_000,
    "test_9": 108_000_000,
    "test_10": 114_000_000,
    "test_11": 120_000_000,
    "test_12": 130_000_000,
    "test_13": 137_000_000,
    "test_14": 144_000_000,
    "test_15": 155_000_000,
}
OF_THEIR_OWN = {"local": (LOCAL, (1.0, 3.0))}  # effects and levels of splits that do not draw from all
# Splits that draw how dry friction turns at zero speed, the rate of the logs, and whether these name their repeats.
DRAWN_LAWS = ("laws", "test_7", "test_8", "test_9", "test_10", "test_11", "test_12", "test_13", "test_14", "test_15")
NARROWEST, WIDEST = 1e-3, 0.03  # rad/s, widths of that turn
INTERVALS = (0.004, 0.008, 0.02)  # s
LEVELS = (0.1, 0.3, 1.0, 3.0)
SECONDS = 8.0
SLIGHT_IN_DIRTY_NULL, SLIGHT_ELSEWHERE = 0.15, 0.05  # floors that each leaves
WINDING_SHARE = 0.8  # of the winding's rise that the logged temperature shows
BASELINE = (
    "rigid_body", "rotor_inertia", "coulomb_friction", "viscous_friction", "torque_offset", "mechanical_power",
    "standby_power",
)  # fmt: skip
# motion, and payload told (share of the rated one); a quote mark repeats the motion before it
MISSING = ("x", "'", "w", "x", "xp", "'", "w", "'", "xs", "wp", "x", "wp")
CHANGED = ("x", "'", "w", "xp", "wp", "x")


@dataclass(frozen=True)
class Plan:
    """One case before it is made."""

    name: str
    seed: int
    robot: str
    kind: str  # clean_null, dirty_null, single, pair, unknown, poor
    effects: tuple[str, ...]
    level: float
    scope: str  # missing or changed
    reference: str = "reference"  # or simulated
    law: str | None = None  # of dry friction about zero speed; None: the plant's own, sharp
    interval: float | None = None  # s, of the log; None: the robot's own
    tells_repeats: bool = True


def plans(split: str, count: int) -> list[Plan]:
    """Return the cases of a split: the mix is the same for any count, in an order that tells nothing."""
    rng = np.random.default_rng(SEEDS[split])
    drawn, levels = OF_THEIR_OWN.get(split, (TORQUE + POWER, LEVELS))
    singles = [(effect, level) for effect in drawn for level in levels]
    rng.shuffle(singles)
    kinds = _kinds(count, rng)
    made = []
    single = 0
    for number, kind in enumerate(kinds):
        effects: tuple[str, ...] = ()
        level = 0.0
        if kind in {"single", "poor", "simulated"}:
            chosen, level = singles[single % len(singles)]
            effects, single = (str(chosen),), single + 1
            level = float(level) if kind == "single" else 3.0
        elif kind == "pair":
            effects, level = tuple(str(e) for e in rng.choice(drawn, 2, replace=False)), 2.0
        elif kind == "unknown":
            effects, level = (str(rng.choice(UNKNOWN_EFFECTS)),), 3.0
        scope = "changed" if kind == "simulated" or rng.random() < 0.4 else "missing"
        reference = "simulated" if kind == "simulated" else "reference"
        robot = str(rng.choice(ROBOTS))
        plan = Plan(f"case_{number:04d}", SEEDS[split] + number + 1, robot, kind, effects, level, scope, reference)
        if split in DRAWN_LAWS:
            law, interval = str(rng.choice(sorted(LAWS))), float(rng.choice(INTERVALS))
            plan = replace(plan, law=law, interval=interval, tells_repeats=bool(rng.random() < 0.5))
        made.append(plan)
    return made


def _kinds(count: int, rng: np.random.Generator) -> list[str]:
    shares = {"clean_null": 0.11, "dirty_null": 0.11, "pair": 0.09, "unknown": 0.07, "poor": 0.04, "simulated": 0.02}
    kinds = [kind for kind, share in shares.items() for _ in range(round(share * count))]
    kinds += ["single"] * (count - len(kinds))
    rng.shuffle(kinds)
    return kinds


class Case:
    """A machine with its runs, simulated as often as it takes to find the strengths."""

    def __init__(self, plan: Plan) -> None:
        self.plan, self.rng = plan, np.random.default_rng(plan.seed)
        drawings = read_drawings(plan.robot)
        soft = bool(TRANSMISSION & set(plan.effects))
        drawings = replace(drawings, step=0.0005 if soft else 0.002)
        self.machine: Machine = build(drawings, plan.seed)
        self.step, self.interval = drawings.step, plan.interval or drawings.log_interval
        self.stride = round(self.interval / self.step)
        self.seconds = SECONDS
        self._runs()
        rng, n, runs = self.rng, len(drawings.joints), len(self.motions)
        warmth = np.sort(rng.uniform(24, 46, runs))[:, None] if plan.scope == "missing" else self._warmth(runs)
        if "temperature_dependent_friction" not in plan.effects and rng.random() < 0.5:
            warmth = rng.uniform(25, 45) + 0 * warmth
        warmth = warmth + rng.uniform(-2, 2, n)
        jitter = 1 + drawings.tolerance.friction_per_run * np.clip(rng.standard_normal((runs, 2, n)), -2, 2)
        self.near_zero = self._near_zero(n)
        self.fleet = Fleet(self.machine, self.motions, self.payloads, warmth, jitter, self.step, self.near_zero)
        self.noise = np.random.default_rng([plan.seed, 9])
        self.known = self._known()
        self.slight: tuple[Effect, ...] = ()

    def _near_zero(self, joints: int) -> NearZero | None:
        if self.plan.law is None:
            return None
        rng = np.random.default_rng([self.plan.seed, 11])
        return NearZero(self.plan.law, np.exp(rng.uniform(np.log(NARROWEST), np.log(WIDEST), joints)))

    def _warmth(self, runs: int) -> np.ndarray:
        half = np.sort(self.rng.uniform(24, 46, runs // 2))
        return np.concatenate([half, half])[:, None]

    def _runs(self) -> None:
        """Choose motions, payloads told, repeats and roles."""
        plan, drawings, rng = self.plan, self.machine.drawings, self.rng
        n = len(drawings.joints)
        layout = MISSING if plan.scope == "missing" else CHANGED
        told = 0.3 * drawings.rated_payload
        motions, payloads, repeats = [], [], []
        for at, kind in enumerate(layout):
            if kind == "'":
                motions.append(motions[-1])
                payloads.append(payloads[-1])
                repeats.append(at - 1)
                continue
            if plan.kind == "poor":
                motion = work(drawings, SECONDS, 2, 0.35, rng)
            elif kind[0] == "x":
                reach, speed = (0.9, 0.35) if "s" in kind else (0.9, 0.75)
                motion = exciting(drawings, SECONDS, reach, speed, rng)
            else:
                motion = work(drawings, SECONDS, n, 0.7, rng)
            motions.append(motion)
            payloads.append(PlantPayload(told, (0.0, 0.0, 0.04)) if "p" in kind else PlantPayload())
            repeats.append(None)
        self.roles = ["observed"] * len(layout)
        if plan.scope == "changed":
            size = len(layout)
            self.roles = [plan.reference] * size + self.roles
            motions, payloads = motions * 2, payloads * 2
            repeats = repeats + [None if r is None else r + size for r in repeats]
        self.motions, self.payloads, self.repeats = motions, payloads, repeats
        self.observed = np.array([role == "observed" for role in self.roles])

    def _known(self) -> tuple[Effect, ...]:
        """What the robot has and its twin knows: copper loss, in some cases."""
        has = "winding_temperature" in self.plan.effects
        if not has and ("copper_loss" in self.plan.effects or self.rng.random() > 0.3):
            return ()
        everywhere = np.ones(len(self.motions), bool)
        return (Effect("copper_loss", tuple(range(len(self.machine.drawings.joints))), everywhere, 1.0),)

    def _slight(self) -> tuple[Effect, ...]:
        """A few effects well below the floor, on every run; none in a clean null."""
        if self.plan.kind == "clean_null":
            return ()
        everywhere = np.ones(len(self.motions), bool)
        names = self.rng.choice([s for s in SLIGHT if s not in self.plan.effects], 3, replace=False)
        target = SLIGHT_IN_DIRTY_NULL if self.plan.kind == "dirty_null" else SLIGHT_ELSEWHERE
        drawn = [draw(str(name), self.machine, everywhere, True, self.rng).effect for name in names]
        return tuple(effect.at(effect.strength * target / max(self.gap((effect,)), 1e-6)) for effect in drawn)

    def simulate(self, effects: tuple[Effect, ...]) -> tuple[Traces, np.ndarray, np.ndarray]:
        """Return traces, torque (T, R, n) and power (T, R) at the log's rate, before noise."""
        effects = self.known + self.slight + effects
        mechanical = tuple(sorted((e.id, e.joints, e.strength) for e in effects if e.id not in POWER_EFFECTS | SENSED))
        if getattr(self, "_last", (None,))[0] != mechanical:
            self._last = (mechanical, self.fleet.run(effects))
        traces = self._last[1]
        seen, drawn = torque(traces, self.machine, effects, self.step), power(traces, self.machine, effects, self.step)
        return traces, seen[:: self.stride], drawn[:: self.stride]

    def noisy(self, seen: np.ndarray, drawn: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        sensors, rng = self.machine.drawings.sensors, np.random.default_rng([self.plan.seed, 5])
        quiet = np.array([role != "simulated" for role in self.roles])
        torque_noise = sensors.torque_noise * coloured(rng, seen.shape) * quiet[:, None]
        power_noise = sensors.meter_noise * coloured(rng, drawn.shape) * quiet
        return seen + torque_noise, drawn + power_noise

    def prepare(self) -> None:
        """Simulate the healthy robot: its floor, what a refit can imitate, and what else is slightly wrong with it."""
        traces, seen, drawn = self.simulate(())
        self.healthy = seen, drawn
        sensors = self.machine.drawings.sensors
        payload = self.payloads[[p.mass > 0 for p in self.payloads].index(True)]
        tool = self.machine.drawings.arm(PlantPayload()).model.body("flange").pos
        com = payload.mass * (np.array(payload.com) + tool)
        told = np.concatenate([[payload.mass], com, np.zeros(6)])
        known = np.array([p.mass > 0 for p in self.payloads])
        arm = self.machine.drawings.arm(PlantPayload())
        self.basis = Basis(
            arm, *(x[:: self.stride] for x in (traces.q, traces.dq, traces.ddq)), payload=told, known=known,
            weights=1 / sensors.torque_noise, interval=self.interval, near_zero=self.near_zero,
        )  # fmt: skip
        noisy_torque, noisy_power = self.noisy(seen, drawn)
        least = 0.2 * sensors.torque_noise  # of a joint that hardly moves
        self.floor = np.maximum(np.sqrt((self.basis.left(noisy_torque) ** 2).mean(axis=(0, 1))), least)
        rest = low_pass(noisy_power - drawn, self.interval)
        self.power_floor = float(np.sqrt((rest**2).mean()))
        self.slight = self._slight()
        self.healthy = self.simulate(())[1:]

    def gap(self, effects: tuple[Effect, ...]) -> float:
        """Return what these effects leave after a refit, in floors, on the joint (or meter) that shows it most."""
        _, seen, drawn = self.simulate(effects)
        active = np.any([effect.runs for effect in effects], axis=0)
        if all(effect.id in POWER_EFFECTS for effect in effects):
            more = low_pass(drawn - self.healthy[1], self.interval)[::STRIDE]
            more = more - more.mean()
            return float(np.sqrt((more[:, active] ** 2).mean())) / self.power_floor
        left = self.basis.left(seen - self.healthy[0])[:, active]
        gap = float((np.sqrt((left**2).mean(axis=(0, 1))) / self.floor).max())
        if not np.isfinite(gap):
            raise RuntimeError("the robot shook itself apart")
        return gap

    def calibrate(self, drawn: Draw, target: float) -> tuple[Effect, float]:
        """Find the strength that leaves `target` floors, by secants; return the effect and the gap it makes."""
        effect = drawn.effect
        best: tuple[float, Effect, float] | None = None
        for _ in range(5):
            try:
                gap = self.gap((effect,))
            except RuntimeError:  # the robot cannot work with so much of it
                effect = effect.at(effect.strength / 2)
                continue
            miss = abs(np.log(max(gap, 1e-6) / target))
            if best is None or miss < best[0]:
                best = (miss, effect, gap)
            if miss < 0.15:
                break
            factor = float(np.clip(target / max(gap, 1e-6), 0.05, 20))
            bounded = float(np.sign(effect.strength) * min(abs(effect.strength) * factor, drawn.most))
            if bounded == effect.strength:
                break
            effect = effect.at(bounded)
        if best is None:
            raise RuntimeError(f"{self.plan.name}: the robot cannot work with {effect.id}")
        return best[1], best[2]


def make(plan: Plan, folder: Path) -> dict[str, Any]:
    """Make one case and return its label. The folder appears when it is whole."""
    case = Case(plan)
    case.prepare()
    everywhere = plan.scope == "changed"
    placed, gaps = [], []
    for name in plan.effects:
        drawn = draw(name, case.machine, case.observed, everywhere, case.rng)
        effect, gap = case.calibrate(drawn, plan.level)
        placed.append(effect)
        gaps.append(gap)
    traces, seen, drawn_power = case.simulate(tuple(placed))
    warm = traces.temperature + WINDING_SHARE * winding_rise(placed, traces, case.step)
    traces = replace(traces, temperature=warm)
    label = _label(plan, case, placed, gaps)
    _write(case, folder / plan.name, traces, seen, drawn_power)
    if plan.kind == "single" and plan.level >= 1:
        _write(case, healthy_beside(folder) / plan.name, *case.simulate(()))
    return label


def healthy_beside(folder: Path) -> Path:
    """Return the folder of the same robots without their effect."""
    return folder.with_name(folder.name + "_healthy")


def _write(case: Case, place: Path, traces: Traces, seen: np.ndarray, drawn: np.ndarray) -> None:
    temporary = place.with_name(f".{place.name}")
    shutil.rmtree(temporary, ignore_errors=True)
    (temporary / "runs").mkdir(parents=True)
    write_runs(case, temporary, traces, *case.noisy(seen, drawn))
    shutil.rmtree(place, ignore_errors=True)
    temporary.rename(place)


def _label(plan: Plan, case: Case, placed: list[Effect], gaps: list[float]) -> dict[str, Any]:
    names = case.machine.drawings.joints
    return {
        "robot": plan.robot,
        "kind": plan.kind,
        "scope": plan.scope,
        "level": plan.level,
        **({"law": plan.law, "interval": plan.interval, "tells_repeats": plan.tells_repeats} if plan.law else {}),
        "floor": dict(zip(names, case.floor.tolist(), strict=True)),
        "power_floor": case.power_floor,
        "effects": [
            {
                "effect": effect.id,
                "channel": "power" if effect.id in POWER_EFFECTS else "torque",
                "joints": [] if effect.id in WHOLE_ROBOT else [names[j] for j in effect.joints],
                "strength": effect.strength,
                "gap_over_floor": gap,
                "regimes": sorted(REGIMES.get(effect.id, ())),
                "runs": [_run_name(index) for index in np.flatnonzero(effect.runs)],
                **({"shape": effect.shape} if effect.id in LOCAL else {}),
            }
            for effect, gap in zip(placed, gaps, strict=True)
        ],
    }


def _run_name(index: int) -> str:
    return f"run_{index:02d}"


def write_runs(case: Case, folder: Path, traces: Traces, seen: np.ndarray, drawn: np.ndarray) -> None:
    machine, drawings = case.machine, case.machine.drawings
    names, stride = drawings.joints, case.stride
    resolution = 2 * np.pi / 2**drawings.sensors.encoder_bits / machine.drive.gear_ratio
    q = np.round(traces.q[::stride] / resolution) * resolution
    rng = np.random.default_rng([case.plan.seed, 6])
    temperature = np.round(traces.temperature[::stride] + 0.05 * rng.standard_normal(q.shape), 1)
    time = np.round(case.interval * np.arange(len(q)), 6)
    for run in range(q.shape[1]):
        columns = {"time": pa.array(time)}
        for prefix, values in (("q", q), ("tau", seen), ("temp", temperature)):
            for joint, name in enumerate(names):
                columns[f"{prefix}_{name}"] = pa.array(np.ascontiguousarray(values[:, run, joint]))
        columns["power"] = pa.array(np.round(drawn[:, run], 1))
        pq.write_table(pa.table(columns), folder / "runs" / f"{_run_name(run)}.parquet", compression="zstd")
    (folder / "robot.urdf").write_text(drawings.urdf, encoding="utf-8")
    (folder / "dataset.toml").write_text(_describe(case), encoding="utf-8")


def _describe(case: Case) -> str:
    drawings = case.machine.drawings
    drive = drawings.drive
    lines = ["[robot]", f'name = "{case.plan.robot}"', 'urdf = "robot.urdf"', 'power_at = "dc_bus"', ""]
    lines += [f"ambient_temperature = {drawings.thermal.ambient}", "simulated = true", ""]
    for index, name in enumerate(drawings.joints):
        lines += [
            f"[robot.joint.{name}]",
            f"gear_ratio = {drive.gear_ratio[index]:.1f}",
            f"torque_constant = {drive.joint_torque_constant[index]:.3f}",
            f"winding_resistance = {drive.resistance[index]:.2f}",
            "",
        ]
    effects = BASELINE + tuple(effect.id for effect in case.known)
    lines += ["[twin]", f"effects = {json.dumps(list(effects))}", ""]
    for index, (role, payload, repeat) in enumerate(zip(case.roles, case.payloads, case.repeats, strict=True)):
        lines += ["[[run]]", f'file = "runs/{_run_name(index)}.parquet"', f'role = "{role}"']
        lines += [f"payload_mass = {payload.mass}", f"payload_com = {list(payload.com)}"]
        if repeat is not None and case.plan.tells_repeats:
            lines.append(f'repeat_of = "runs/{_run_name(repeat)}.parquet"')
        lines.append("")
    return "\n".join(lines)


def _job(task: tuple[Plan, Path, Path]) -> tuple[str, str]:
    plan, folder, labels = task
    file = labels / f"{plan.name}.json"
    if file.exists() and (folder / plan.name).exists():
        return plan.name, "kept"
    try:
        label = make(plan, folder)
    except RuntimeError as error:
        return plan.name, f"failed: {error}"
    file.write_text(json.dumps(label, indent=1), encoding="utf-8")
    return plan.name, " + ".join(f"{e['gap_over_floor']:.2f}" for e in label["effects"]) or "null"


def make_all(split: str, count: int, folder: Path, workers: int = 2) -> Iterator[tuple[str, str]]:
    """Make the cases that are not there yet; labels go to FOLDER_labels, sealed when all are there."""
    labels = folder.with_name(folder.name + "_labels")
    for place in (folder, labels, healthy_beside(folder)):
        place.mkdir(parents=True, exist_ok=True)
    tasks = [(plan, folder, labels) for plan in plans(split, count)]
    if workers == 1:
        yield from map(_job, tasks)
    else:
        with ProcessPoolExecutor(workers) as pool:
            yield from pool.map(_job, tasks)
    every = {task[0].name: task[2] / f"{task[0].name}.json" for task in tasks}
    whole = {name: json.loads(file.read_text(encoding="utf-8")) for name, file in every.items() if file.exists()}
    text = json.dumps(whole, indent=1, sort_keys=True)
    (labels / "labels.json").write_text(text, encoding="utf-8")
    yield "labels.json", f"sha256 {hashlib.sha256(text.encode()).hexdigest()}"


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m blind.cases", description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--split", choices=sorted(SEEDS), default="development")
    parser.add_argument("--count", type=int, default=24)
    parser.add_argument("--workers", type=int, default=2)
    arguments = parser.parse_args()
    for name, what in make_all(arguments.split, arguments.count, arguments.folder, arguments.workers):
        print(name, what, flush=True)


if __name__ == "__main__":
    main()
