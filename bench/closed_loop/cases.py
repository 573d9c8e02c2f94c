"""`python -m closed_loop.cases MODELS FOLDER --split development --count 24`: make cases, and apart their labels.

MODELS is where `pip download --no-deps robosuite gymnasium-robotics -d MODELS` put its wheels. `labels.json` in
FOLDER_labels is in the form of the blind benchmark's, as are the cases: `blind.run FOLDER OUT` and `blind.score OUT
LABELS` read them. Its SHA-256 is printed: commit it before a diagnosis sees cases of the sealed split.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from closed_loop.data_set import write_data_set
from closed_loop.effects import EITHER, IN_THE_TWIN, NEVER_CHANGED, WHOLE_ROBOT, Effect, draw, sensed
from closed_loop.machine import Machine, build
from closed_loop.models import SOURCES, read_model
from closed_loop.programmes import Programme, exciting, working
from closed_loop.refit import COARSE, Refit, joined
from closed_loop.simulation import Surroundings, Trace, planned, simulate, torque_of

SEEDS = {
    "development": 201_000_000,
    "sealed": 307_000_000,
    "sealed_2": 409_000_000,
    "sealed_3": 503_000_000,
    "sealed_4": 601_000_000,
    "sealed_5": 701_000_000,
    "sealed_6": 809_000_000,
    "sealed_7": 907_000_000,
    "sealed_8": 1_013_000_000,
    "sealed_9": 1_103_000_000,
    "sealed_10": 1_201_000_000,
}
LEVELS = (0.5, 1.0, 2.0, 3.0, 5.0, 10.0, 20.0)  # floors that an effect leaves
SHARES = {"clean_null": 0.2, "pair": 0.1}  # of the cases; the rest has one effect
LEAST = 0.2  # of the sensor's noise: a joint that hardly moves has no lower floor
EXACT = 1e-4  # of a drive's torque: what a healthy robot's own model may leave of what its drives gave


@dataclass(frozen=True)
class Plan:
    """One case before it is made."""

    name: str
    seed: int
    robot: str
    kind: str  # clean_null, single or pair
    effects: tuple[str, ...]
    level: float
    scope: str  # missing or changed


def plans(split: str, count: int) -> list[Plan]:
    """Return the cases of a split, in an order that tells nothing."""
    rng = np.random.default_rng(SEEDS[split])
    drawn = IN_THE_TWIN + NEVER_CHANGED + EITHER
    turns = [str(effect) for _ in range(count // len(drawn) + 1) for effect in rng.permutation(drawn)]
    levels = [float(level) for _ in range(count // len(LEVELS) + 1) for level in rng.permutation(LEVELS)]
    kinds = [kind for kind, share in SHARES.items() for _ in range(round(share * count))]
    kinds = list(rng.permutation(kinds + ["single"] * (count - len(kinds))))
    robots = [str(robot) for _ in range(count // len(SOURCES) + 1) for robot in rng.permutation(list(SOURCES))]
    made = []
    for number, kind in enumerate(kinds):
        scope = "changed" if rng.random() < 0.5 else "missing"
        effects: tuple[str, ...] = ()
        if kind == "single":
            effects = (turns.pop(0),)
            scope = "changed" if effects[0] in IN_THE_TWIN else "missing" if effects[0] in NEVER_CHANGED else scope
        elif kind == "pair":
            pool = EITHER + (IN_THE_TWIN if scope == "changed" else NEVER_CHANGED)
            effects = tuple(str(effect) for effect in rng.choice(pool, 2, replace=False))
        level = (levels.pop(0) if kind == "single" else float(rng.choice(LEVELS[2:]))) if effects else 0.0
        made.append(Plan(f"case_{number:04d}", SEEDS[split] + number, robots[number], str(kind), effects, level, scope))
    return made


class Case:
    """A machine with its programmes, and what of its effects a refit of the healthy twin leaves."""

    def __init__(self, plan: Plan, models: Path) -> None:
        self.plan, self.rng = plan, np.random.default_rng([plan.seed, 2])
        self.machine: Machine = build(read_model(models, plan.robot), plan.seed)
        self.seconds = float(self.rng.integers(6, 11))
        self._runs()
        runs, n, rows = len(self.programmes), len(self.machine.model.joints), len(self.programmes[0].q)
        self.around = [
            Surroundings(warmth, 1 + self.machine.wander * float(np.clip(self.rng.standard_normal(), -2, 2)))
            for warmth in self._warmth(runs, n, rows)
        ]
        self.planned = [
            planned(self.machine, programme, run, self.around[run], round(COARSE / self.machine.step))
            for run, programme in enumerate(self.programmes)
        ]
        self.refit = Refit(self.machine, self.planned, COARSE)
        self._floor(joined(self.planned, "tau"), COARSE)

    def _runs(self) -> None:
        """Draw programmes, repeats and roles; what has changed is seen in other runs of some of the programmes."""
        rng = self.rng
        style = rng.choice(["both", "exciting", "working"], p=(0.5, 0.25, 0.25))
        own = int(rng.integers(6, 8)) if self.plan.scope == "missing" else int(rng.integers(4, 6))
        made: list[Programme] = []
        for number in range(own):
            excites = style == "exciting" or (style == "both" and number % 2 == 0)
            made.append((exciting if excites else working)(self.machine, self.seconds, rng))
        repeated: list[int] = rng.permutation(own)[: rng.integers(1, 3)].tolist() if rng.random() < 0.5 else []
        self.programmes = made + [made[k] for k in repeated]
        self.repeats: list[int | None] = [*[None] * own, *repeated]
        self.roles = ["observed"] * len(self.programmes)
        if self.plan.scope == "changed":
            before = int(rng.integers(3, 5))
            same = rng.random() < 0.5
            for number in range(before):
                excites = style == "exciting" or (style == "both" and number % 2 == 0)
                other = made[number % own] if same else (exciting if excites else working)(
                    self.machine, self.seconds, rng
                )  # fmt: skip
                self.programmes.insert(number, other)
            self.roles = ["reference"] * before + self.roles
            self.repeats = [*[None] * before, *(None if k is None else k + before for k in self.repeats)]
        self.observed = np.array([role == "observed" for role in self.roles])

    def _warmth(self, runs: int, joints: int, rows: int) -> np.ndarray:
        """Return how warm joints are, (R, T, n): they warm up over the runs, or are as warm throughout."""
        moves = "temperature_dependent_friction" in self.plan.effects or self.rng.random() < 0.3
        rise = self.rng.uniform(8, 20, joints) if moves else np.zeros(joints)
        time = (np.arange(runs)[:, None] + np.linspace(0, 1, rows)) / runs
        return np.asarray(26 + self.rng.uniform(-2, 2, joints) + rise * (1 - np.exp(-3 * time[..., None])))

    def _floor(self, tau: np.ndarray, interval: float) -> None:
        """Find what the twin leaves of a healthy robot: noise, and the softness of MuJoCo's friction."""
        sensors = self.machine.sensors
        share = np.sqrt(self.machine.interval / (interval * self.refit.stride))  # of white noise, by what is fitted
        noise = share * sensors.torque * np.random.default_rng([self.plan.seed, 4]).standard_normal(tau.shape)
        self.soft = self.refit.left(tau)
        self.floor = np.maximum(self.refit.left(tau + noise), LEAST * sensors.torque)

    def torque(self, trace: Trace, effects: tuple[Effect, ...], run: int, interval: float) -> np.ndarray:
        """Return the torque that a robot with these effects takes for a trace's states, `interval` apart, (T, n)."""
        return torque_of(self.machine, trace, effects, run, self.around[run].friction, interval)

    def expected(self, effect: Effect) -> float:
        """Return the gap in floors that an effect would leave if the robot went exactly as programmed."""
        more = np.zeros((len(self.planned[0].q), len(self.planned), len(self.floor)))
        for run in map(int, np.flatnonzero(effect.runs)):
            trace = self.planned[run]
            told = sensed((effect,), trace.tau, COARSE, run)
            more[:, run] = self.torque(trace, (effect,), run, COARSE) - trace.tau + told - trace.tau
        return self.gap(more)

    def gap(self, more: np.ndarray) -> float:
        """Return what the twin leaves of torque besides the healthy robot's, in floors, on the joint with the most."""
        return float((self.refit.left(more) / self.floor).max())

    def calibrate(self, effect: Effect) -> Effect:
        """Find the strength that is expected to leave the plan's level."""
        for _ in range(5):
            miss = self.plan.level / max(self.expected(effect), 1e-9)
            if abs(np.log(miss)) < 0.1 or (miss > 1 and abs(effect.strength) >= effect.most):
                break
            effect = effect.at(effect.strength * float(np.clip(miss, 0.02, 50)))
        return effect

    def make(self) -> tuple[list[Trace], list[Effect], list[float]]:
        """Return the traces, the effects, and the gap that each leaves alone (of a pair: as programmed).

        Raises RuntimeError where what the drives gave is not what the true model says of the traces.
        """
        placed = [
            self.calibrate(draw(name, self.machine, self.observed, self.plan.scope == "missing", self.rng))
            for name in self.plan.effects
        ]
        acting, machine, interval = tuple(placed), self.machine, self.machine.interval
        expected = [self.expected(effect) for effect in placed]
        traces = [
            simulate(machine, programme, acting, run, self.around[run]) for run, programme in enumerate(self.programmes)
        ]
        stride = round(interval / machine.step)
        logged = [trace.every(stride) for trace in traces]
        true = [self.torque(trace, acting, run, interval) for run, trace in enumerate(logged)]
        missed = joined(logged, "tau") - np.stack(true, axis=1)
        self.inexact = float((np.abs(missed) / machine.model.torque).max())
        if self.inexact > EXACT:
            raise RuntimeError(f"{self.plan.name}: the true model leaves {self.inexact:.1e} of the drives' torque")
        healthy = np.stack([self.torque(trace, (), run, interval) for run, trace in enumerate(logged)], axis=1)
        self.refit = Refit(machine, logged, interval)
        self._floor(healthy, interval)
        if len(placed) != 1:
            return traces, placed, expected
        seen = [sensed(acting, trace.tau, machine.step, run)[::stride] for run, trace in enumerate(traces)]
        return traces, placed, [self.gap(np.stack(seen, axis=1) - healthy)]


def make(plan: Plan, models: Path, folder: Path) -> dict[str, Any]:
    """Make one case and return its label. The folder appears when it is whole."""
    case = Case(plan, models)
    traces, placed, gaps = case.make()
    temporary = folder / f".{plan.name}"
    shutil.rmtree(temporary, ignore_errors=True)
    tells = [sensed(tuple(placed), trace.tau, case.machine.step, run) for run, trace in enumerate(traces)]
    write_data_set(temporary, case.machine, traces, tells, case.roles, case.repeats, plan.seed)
    shutil.rmtree(folder / plan.name, ignore_errors=True)
    temporary.rename(folder / plan.name)
    return _label(case, placed, gaps)


def _label(case: Case, placed: list[Effect], gaps: list[float]) -> dict[str, Any]:
    plan, machine = case.plan, case.machine
    names = machine.model.joints
    return {
        "robot": plan.robot,
        "kind": plan.kind,
        "scope": plan.scope,
        "level": plan.level,
        "floor": dict(zip(names, case.floor.tolist(), strict=True)),
        "soft": dict(zip(names, case.soft.tolist(), strict=True)),
        "noise": dict(zip(names, machine.sensors.torque.tolist(), strict=True)),
        "interval": machine.interval,
        "hard": machine.hard,
        "inexact": case.inexact,
        "effects": [
            {
                "effect": effect.id,
                "channel": "torque",
                "joints": [] if effect.id in WHOLE_ROBOT else [names[joint] for joint in effect.joints],
                "strength": effect.strength,
                "gap_over_floor": gap,
                "regimes": [],
                "runs": [f"run_{run:02d}" for run in np.flatnonzero(effect.runs)],
                "shape": {key: np.asarray(value).tolist() for key, value in effect.shape.items()},
            }
            for effect, gap in zip(placed, gaps, strict=True)
        ],
    }


def make_all(split: str, count: int, models: Path, folder: Path) -> Iterator[tuple[str, str]]:
    """Make the cases that are not there yet; labels go to FOLDER_labels, sealed when all are there."""
    labels = folder.with_name(folder.name + "_labels")
    for place in (folder, labels):
        place.mkdir(parents=True, exist_ok=True)
    whole: dict[str, Any] = {}
    for plan in plans(split, count):
        file = labels / f"{plan.name}.json"
        if not (file.exists() and (folder / plan.name).exists()):
            try:
                label = make(plan, models, folder)
            except RuntimeError as error:
                yield plan.name, f"failed: {error}"
                continue
            file.write_text(json.dumps(label, indent=1), encoding="utf-8")
        whole[plan.name] = json.loads(file.read_text(encoding="utf-8"))
        gaps = " + ".join(f"{effect['gap_over_floor']:.2f}" for effect in whole[plan.name]["effects"])
        yield plan.name, gaps or "null"
    text = json.dumps(whole, indent=1, sort_keys=True)
    (labels / "labels.json").write_text(text, encoding="utf-8")
    yield "labels.json", f"sha256 {hashlib.sha256(text.encode()).hexdigest()}"


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m closed_loop.cases", description=__doc__)
    parser.add_argument("models", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--split", choices=sorted(SEEDS), default="development")
    parser.add_argument("--count", type=int, default=24)
    arguments = parser.parse_args()
    for name, what in make_all(arguments.split, arguments.count, arguments.models, arguments.folder):
        print(name, what, flush=True)


if __name__ == "__main__":
    main()
