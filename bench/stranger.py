"""Arms of others under a plant written from the log format alone: how right is a diagnosis where laws are not its own?

In bench/: `python stranger.py MODELS FOLDER --seed SEED --count 40`, `python -m blind.run FOLDER OUT`, `python
stranger_score.py OUT FOLDER_labels.json`. MODELS is the folder of `pip download --no-deps robosuite gymnasium-robotics
-d MODELS`. Motions are prescribed; torque is that of bodies off their drawings, rotors, and one of nine laws of
friction that differs by up to 5 % from run to run; encoders are coarse, torque is a quantised current that may lag.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pyarrow as pa
import pyarrow.parquet as pq

from closed_loop.models import SOURCES, read_model
from closed_loop.urdf import urdf

STEP = 1e-3  # s, of the plant
RATES = (50, 100, 125, 250, 500)
LAWS = ("sharp", "tanh", "arctangent", "root", "stribeck", "lugre", "dahl", "power", "stiction")
NAME_OF_LAW = {
    "stribeck": ["stribeck_friction"],
    "lugre": ["presliding_hysteresis", "stribeck_friction"],
    "dahl": ["presliding_hysteresis"],
    "power": ["nonlinear_viscous_friction"],
}
BASELINE = ["rigid_body", "rotor_inertia", "coulomb_friction", "viscous_friction", "torque_offset"]
POWER = ["mechanical_power", "standby_power", "copper_loss"]
ALWAYS = ("time_delay", "joint_elasticity", "backlash", "torque_ripple", "joint_coupling", "gravity_compensation")
CHANGING = (
    "coulomb_friction", "viscous_friction", "torque_constant_error", "torque_offset", "encoder_offset", "base_tilt",
    "payload",
)  # fmt: skip
EITHER = ("load_dependent_friction", "asymmetric_friction", "cable_drag", "temperature_dependent_friction")
UNKNOWN = ("friction of another joint's angle", "vibration while moving", "product of two speeds", "weakened field")
WHOLE = ("base_tilt", "payload")
SENSED = ("torque_constant_error", "torque_offset", "encoder_offset")  # what a reading has and the power does not
FRICTIONS = {"coulomb_friction": 1.0, "asymmetric_friction": 0.5, "temperature_dependent_friction": 0.3}
UNIT = {"encoder_offset": 0.01, "base_tilt": 0.02, "payload": 0.5, "time_delay": 4e-3, "joint_elasticity": 1e-4}

Trace = tuple[np.ndarray, np.ndarray, np.ndarray]  # positions, speeds, accelerations, (N, n)


@dataclass
class Change:
    """An effect that nobody told: where, in which runs, and how large in its unit."""

    effect: str
    joint: int
    scope: str  # missing: in all runs; changed: in the observed ones
    size: float = 1.0
    shape: float = 0.0  # of those that have one: phase or wave number

    def acts(self, role: str) -> bool:
        return self.scope == "missing" or role == "observed"


@dataclass
class Arm:
    """A robot as built; arrays are of its joints, (n,)."""

    name: str
    joints: tuple[str, ...]
    drawn: str
    model: pin.Model
    law: str
    rng: np.random.Generator
    differs: float  # share by which dry friction differs from run to run
    scale: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        n, rng, still = self.model.nv, self.rng, np.zeros(self.model.nv)
        for inertia in self.model.inertias[1:]:
            inertia.mass *= (share := rng.uniform(0.8, 1.2))
            inertia.inertia = inertia.inertia * share
        data = self.model.createData()
        poses = [pin.randomConfiguration(self.model) for _ in range(50)]
        held = np.abs([pin.rnea(self.model, data, pose, still, still) for pose in poses])
        bodies = np.mean([np.diag(pin.crba(self.model, data, pose)) for pose in poses], axis=0)
        self.scale = np.maximum(held.max(axis=0), 0.15 * held.max())
        self.rotor, self.dry = bodies * rng.uniform(0.2, 1.2, n), self.scale * rng.uniform(0.05, 0.2, n)
        self.viscous, self.drop = self.scale * rng.uniform(0.02, 0.15, n), rng.uniform(0.2, 0.6, n)
        widths = {"sharp": (1e-4, 1e-3), "tanh": (3e-3, 15e-3), "arctangent": (5e-3, 20e-3), "root": (3e-3, 15e-3)}
        self.width = rng.uniform(*widths.get(self.law, (5e-4, 2e-3)), n)
        self.fading, self.bristle = rng.uniform(0.02, 0.12, n), rng.uniform(5e-4, 6e-3, n)
        self.noise, self.step = self.scale * rng.uniform(2e-3, 8e-3), self.scale * rng.uniform(5e-4, 4e-3)

    def bodies(self, trace: Trace, load: float = 0.0, tilt: float = 0.0) -> np.ndarray:
        """Return what bodies alone ask, (N, n) N m, under a load of the flange, kg, and a tilt of the base, rad."""
        model = self.model.copy()
        model.gravity.linear = np.array([np.sin(tilt), 0.0, -np.cos(tilt)]) * 9.81
        model.inertias[model.nv] += pin.Inertia(load, np.array([0.02, 0.01, 0.12]), np.eye(3) * 1e-3 * load)
        data = model.createData()
        return np.array([pin.rnea(model, data, *each) for each in zip(*trace, strict=True)])

    def turn(self, speed: np.ndarray) -> np.ndarray:
        """Return the dry friction's direction over speed, -1 to 1."""
        match self.law:
            case "arctangent":
                return 2 / np.pi * np.arctan(speed / self.width)
            case "root":
                return speed / np.sqrt(speed**2 + self.width**2)
            case _:
                return np.tanh(speed / self.width)

    def dry_friction(self, trace: Trace) -> np.ndarray:
        """Return dry friction of a run, (N, n) N m, without what differs from run to run."""
        q, dq, _ = trace
        if self.law in ("lugre", "dahl"):
            return self.dry * self._bristles(dq)
        peak = 1 + self.drop * np.exp(-((dq / self.fading) ** 2)) if self.law == "stribeck" else 1.0
        dry = self.dry * peak * self.turn(dq)
        if self.law == "stiction":
            resting = np.abs(dq) < 1e-4
            dry[resting] = (0.7 * self.dry * np.sin(5 * q + 1))[resting]
        return dry

    def _bristles(self, dq: np.ndarray) -> np.ndarray:
        state, states = np.zeros(dq.shape[1]), np.empty_like(dq)
        drop = self.drop if self.law == "lugre" else 0.0
        limits = 1 + drop * np.exp(-((dq / self.fading) ** 2))
        for at, (speed, limit) in enumerate(zip(dq, limits, strict=True)):
            settles = np.exp(-np.abs(speed) * STEP / (self.bristle * limit))
            end = limit * np.sign(speed)
            state = np.where(speed == 0, state, end + (state - end) * settles)
            states[at] = state
        return states

    def other_friction(self, trace: Trace) -> np.ndarray:
        """Return what grows with speed, (N, n) N m."""
        dq = trace[1]
        return self.viscous * (np.sign(dq) * np.abs(dq) ** 0.6 if self.law == "power" else dq)


def motion(kind: str, lower: np.ndarray, upper: np.ndarray, seconds: float, rng: np.random.Generator) -> Trace:
    """Return a motion within a joint's way: moves with pauses, splines through poses, sums of sines, or creep."""
    n, middle, reach = len(lower), (lower + upper) / 2, np.minimum((upper - lower) / 2 * 0.7, 1.2)
    reach = reach * np.where(rng.random(n) < 0.15, 0.03, 1.0)  # joints that hardly move
    grid = np.arange(0, seconds, STEP)
    if kind == "sines":
        own = [rng.uniform(-1, 1, (2, n)) / k for k in range(1, 5)]
        beat = 2 * np.pi / rng.uniform(6, 10)
        q = sum(
            a * np.sin(k * beat * grid[:, None]) + b * np.cos(k * beat * grid[:, None])
            for k, (a, b) in enumerate(own, 1)
        )
        q = middle + reach * q / np.abs(q).max(axis=0)
    else:
        poses, fastest = (
            [middle + reach * rng.uniform(-1, 1, n)],
            rng.uniform(0.1, 0.2) if kind == "creep" else rng.uniform(0.6, 1.5),
        )
        pieces: list[np.ndarray] = []
        while sum(map(len, pieces)) < len(grid) + 200:
            goal = middle + reach * rng.uniform(-1, 1, n)
            count = int(np.max(np.abs(goal - poses[-1])) / fastest / STEP) + 50
            pieces.append(poses[-1] + np.linspace(0, 1, count)[:, None] * (goal - poses[-1]))
            if kind == "moves":
                pieces.append(np.repeat(goal[None], int(rng.uniform(0.2, 1.0) / STEP), axis=0))
            poses.append(goal)
        q = np.concatenate(pieces)
        for window in (int(rng.uniform(60, 250)), int(rng.uniform(30, 120)), 20):
            total = np.cumsum(np.concatenate([np.repeat(q[:1], window, axis=0), q]), axis=0)
            q = (total[window:] - total[:-window]) / window
        q = q[200 : 200 + len(grid)]
    dq = np.gradient(q, STEP, axis=0)
    dq[np.abs(dq) < 1e-9] = 0.0
    return q, dq, np.gradient(dq, STEP, axis=0)


def shifted(values: np.ndarray, seconds: float) -> np.ndarray:
    """Return a signal later by some time."""
    grid = np.arange(len(values)) * STEP
    return np.column_stack([np.interp(grid - seconds, grid, column) for column in values.T])


def play(q: np.ndarray, width: float) -> np.ndarray:
    """Return where the motor is that moves a link through a play of this width."""
    motor, at = np.empty_like(q), q[0]
    for index, link in enumerate(q):
        at = min(max(at, link - width / 2), link + width / 2)
        motor[index] = at
    return 2 * q - motor


def joined(
    arm: Arm, trace: Trace, changes: list[Change], warmth: np.ndarray, factor: np.ndarray
) -> tuple[Trace, np.ndarray]:
    """Return what motors do and give of a run: their trace, and the torque that sensors would show, (N, n) N m."""
    told = {change.effect: change for change in changes}
    size = {name: change.size * UNIT.get(name, 1.0) for name, change in told.items()}
    bodies = arm.bodies(trace, size.get("payload", 0.0), size.get("base_tilt", 0.0))
    motors = [part.copy() for part in trace]
    for name in ("joint_elasticity", "backlash"):
        if name in told:
            k = told[name].joint
            moved = (
                trace[0][:, k] + size[name] * bodies[:, k] * 10 / arm.scale[k]
                if name == "joint_elasticity"
                else play(trace[0][:, k], 1e-3 * size[name])
            )
            motors[0][:, k] = moved
            motors[1][:, k] = np.gradient(moved, STEP)
            motors[2][:, k] = np.gradient(motors[1][:, k], STEP)
    seen: Trace = (motors[0], motors[1], motors[2])
    dry = factor * arm.dry_friction(seen)
    tau = bodies + arm.rotor * seen[2] + dry + arm.other_friction(seen)
    for change in changes:
        tau[:, change.joint] += _added(arm, seen, bodies, dry, warmth, change)
    for change in changes:
        k = change.joint
        if change.effect == "torque_constant_error":
            tau[:, k] *= 1 + 0.1 * change.size
        if change.effect == "weakened field":
            tau[:, k] *= 1 + 0.2 * change.size * seen[1][:, k] ** 2
        if change.effect == "time_delay":
            tau[:, k] = shifted(tau[:, k : k + 1], size["time_delay"])[:, 0]
        if change.effect == "encoder_offset":
            seen[0][:, k] += size["encoder_offset"]
    return seen, tau


def _added(
    arm: Arm, seen: Trace, bodies: np.ndarray, dry: np.ndarray, warmth: np.ndarray, change: Change
) -> np.ndarray:
    """Return what an effect adds to its joint's torque, (N,) N m."""
    (q, dq, _), k, n = seen, change.joint, len(arm.joints)
    turn, scale, other = arm.turn(dq)[:, k], arm.scale[k], (k + 1) % n
    forms: dict[str, Callable[[], np.ndarray]] = {
        "coulomb_friction": lambda: dry[:, k],
        "viscous_friction": lambda: 0.1 * scale * dq[:, k],
        "load_dependent_friction": lambda: 0.1 * np.abs(bodies[:, k]) * turn,
        "asymmetric_friction": lambda: 0.5 * np.maximum(dry[:, k], 0),
        "temperature_dependent_friction": lambda: -0.02 * (warmth[:, k] - 30) * dry[:, k],
        "cable_drag": lambda: 0.1 * scale * (q[:, k] - change.shape),
        "torque_ripple": lambda: 0.03 * scale * np.sin(round(20 + 60 * abs(change.shape)) * q[:, k] + change.shape),
        "gravity_compensation": lambda: -0.2 * scale * np.sin(q[:, k] + change.shape),
        "joint_coupling": lambda: 0.05 * scale * dq[:, k - 1],
        "torque_offset": lambda: np.full(len(q), 0.05 * scale),
        UNKNOWN[0]: lambda: 0.3 * dry[:, k] * np.sin(2 * q[:, other]),
        UNKNOWN[1]: lambda: (
            0.03 * scale * np.sin(2 * np.pi * 7 * np.arange(len(q)) * STEP) * np.minimum(np.abs(dq[:, k]), 0.5)
        ),
        UNKNOWN[2]: lambda: 0.2 * scale * dq[:, other] * dq[:, k - 1],
    }
    form = forms.get(change.effect)
    return change.size * form() if form else np.zeros(len(q))


@dataclass
class Case:
    """A case before its runs: who moves how, and what of it is logged."""

    arm: Arm
    changes: list[Change]
    roles: list[str]
    repeats: list[int | None]
    traces: list[Trace]
    factors: list[np.ndarray]
    warmth: list[np.ndarray]

    def run(self, index: int, effects: bool = True, sensed: bool = True) -> tuple[Trace, np.ndarray]:
        told = [
            change
            for change in self.changes
            if effects and change.acts(self.roles[index]) and (sensed or change.effect not in SENSED)
        ]
        return joined(self.arm, self.traces[index], told, self.warmth[index], self.factors[index])

    def left(self, effects: bool) -> np.ndarray:
        """Return what a refitted twin leaves of each joint over the noise of a sample, (n,)."""
        every, arm = 10, self.arm
        data, rows, seen_torque = arm.model.createData(), [], []
        for index in range(len(self.traces)):
            seen, tau = self.run(index, effects)
            dry, other = arm.dry_friction(self.traces[index]), arm.other_friction(self.traces[index])
            for at in range(0, len(tau), every):
                body = pin.computeJointTorqueRegressor(arm.model, data, *(part[at] for part in seen))
                rows.append((body, np.stack([dry[at], other[at], seen[2][at], np.ones(len(tau[at]))], axis=1)))
                seen_torque.append(tau[at])
        torque = np.array(seen_torque)
        left = np.empty_like(torque)
        for k in range(torque.shape[1]):
            columns = np.array([np.concatenate([body[k], own[k]]) for body, own in rows])
            columns /= np.maximum(np.linalg.norm(columns, axis=0), 1e-12)
            left[:, k] = torque[:, k] - columns @ np.linalg.lstsq(columns, torque[:, k], rcond=1e-8)[0]
        return np.sqrt(np.mean(left**2, axis=0)) / arm.noise


def drawn(models: Path, rng: np.random.Generator) -> tuple[Case, str]:
    """Draw a case and its kind."""
    name, law = str(rng.choice(sorted(SOURCES))), str(rng.choice(LAWS))
    source = read_model(models, name)
    text = urdf(source, source.compiled())
    pin.seed(int(rng.integers(2**31)))
    arm = Arm(
        name, source.joints, text, pin.buildModelFromXML(text), law, rng, float(rng.choice([0, 0.01, 0.03, 0.05]))
    )
    with_references, repeated = rng.random() < 0.5, rng.random() < 0.5
    roles = ["observed"] * int(rng.integers(1, 4))
    roles = ["reference"] * (len(roles) + 1) + roles if with_references else roles
    lower, upper = np.maximum(source.lower, -2.5), np.minimum(source.upper, 2.5)
    seconds = rng.uniform(25, 60) / roles.count("observed")
    traces, repeats, warmth = [], [], []
    for index in range(len(roles)):
        again = repeated and index > 0 and roles[index] == roles[index - 1] and rng.random() < 0.6
        trace = (
            traces[-1]
            if again
            else motion(
                str(rng.choice(["moves", "splines", "sines", "creep"], p=[0.4, 0.25, 0.25, 0.1])),
                lower,
                upper,
                seconds,
                rng,
            )
        )
        traces.append(trace)
        repeats.append(index - 1 if again else None)
        start = rng.uniform(25, 45) if index else 22.0
        warmth.append(start + 10 * np.linspace(0, 1, len(trace[0]))[:, None] * rng.uniform(0.5, 1, len(lower)))
    factors = [1 + arm.differs * rng.standard_normal(len(lower)) for _ in roles]
    kind = str(rng.choice(["clean_null", "single", "pair", "unknown"], p=[0.35, 0.45, 0.1, 0.1]))
    pool = [*ALWAYS, *EITHER, *(CHANGING if with_references else ())]
    names = {"clean_null": [], "unknown": [str(rng.choice(UNKNOWN))]}.get(kind)
    if names is None:
        names = [str(each) for each in rng.choice(pool, 1 if kind == "single" else 2, replace=False)]
    changes = []
    for each in names:
        changed = each in CHANGING or (with_references and each in EITHER and rng.random() < 0.5)
        joint = (
            len(lower) - 1
            if each == "joint_coupling"
            else 1
            if each == "gravity_compensation"
            else int(rng.integers(len(lower)))
        )
        changes.append(Change(each, joint, "changed" if changed else "missing", shape=float(rng.uniform(-1, 1))))
    return Case(arm, changes, roles, repeats, traces, factors, warmth), kind


def law_numbers(arm: Arm) -> dict[str, dict[str, list[float]]]:
    """Return what the law of friction has of shapes of the catalogue's effects, by effect and name, joint by joint."""
    alike, fading, bristle = np.ones(len(arm.joints)), arm.fading.tolist(), arm.bristle.tolist()
    known = {
        "stribeck_friction": {"vs": fading, "d": (2.0 * alike).tolist()},
        "presliding_hysteresis": {"d": bristle},
        "nonlinear_viscous_friction": {"d": (0.6 * alike).tolist()},
    }
    return {effect: known[effect] for effect in NAME_OF_LAW.get(arm.law, [])}


def make(models: Path, folder: Path, seed: int, number: int) -> dict[str, Any]:
    """Write one case, return its label."""
    rng = np.random.default_rng([seed, number])
    case, kind = drawn(models, rng)
    gaps: list[list[float]] = []
    if case.changes:
        level, healthy = float(np.exp(rng.uniform(np.log(0.5), np.log(10)))), case.left(False)
        for change in case.changes:
            own = Case(
                case.arm,
                [change],
                *(getattr(case, part) for part in ("roles", "repeats", "traces", "factors", "warmth")),
            )
            for _ in range(3):
                gap = np.sqrt(np.maximum(own.left(True) ** 2 - healthy**2, 1e-6))
                change.size = float(np.clip(change.size * level / gap.max(), 1e-3, 30))
            gaps.append(np.sqrt(np.maximum(own.left(True) ** 2 - healthy**2, 0)).tolist())
    named = rng.random() < 0.6
    write(folder / f"case_{number:03d}", case, named, rng)
    return {
        "robot": case.arm.name, "joints": case.arm.joints, "law": case.arm.law, "named": named,
        "differs": case.arm.differs, "kind": kind,
        "scope": case.changes[0].scope if case.changes else "-",
        "also": [] if named else NAME_OF_LAW.get(case.arm.law, []), "law_numbers": law_numbers(case.arm),
        "effects": [
            {"effect": change.effect, "joints": [] if change.effect in WHOLE else [case.arm.joints[change.joint]],
             "gap_over_floor": max(gap), "size": change.size, "shape": change.shape}
            for change, gap in zip(case.changes, gaps, strict=True)
        ],
    }  # fmt: skip


def write(folder: Path, case: Case, named: bool, rng: np.random.Generator) -> None:
    """Write the data set that a user would hand over."""
    arm, every = case.arm, round(1 / STEP / rng.choice(RATES))
    encoder, lag = np.exp(rng.uniform(np.log(1e-5), np.log(4e-4))), rng.choice([0.0, 0.0, 1.5e-3])
    speeds, power, warm = rng.random() < 0.5, rng.random() < 0.3, any(c.effect.startswith("temp") for c in case.changes)
    resistance = rng.uniform(0.02, 0.1) / arm.scale
    (folder / "runs").mkdir(parents=True, exist_ok=True)
    lines = ["[robot]", f'name = "{arm.name}"', 'urdf = "robot.urdf"', *(['power_at = "dc_bus"'] if power else [])]
    for joint, ohm in zip(arm.joints, resistance, strict=True) if power else ():
        lines += [f"[robot.joint.{joint}]", "torque_constant = 1.0", f"winding_resistance = {ohm:.5f}"]
    effects = BASELINE + (POWER if power else []) + (NAME_OF_LAW.get(arm.law, []) if named else [])
    lines += ["[twin]", f"effects = {json.dumps(effects)}"]
    for index, role in enumerate(case.roles):
        (q, dq, _), tau = case.run(index)
        (_, turned, _), given = case.run(index, sensed=False)
        tau = shifted(tau, lag) if lag else tau
        shown = slice(0, None, every)
        signals = {"q": np.round(q[shown] / encoder) * encoder}
        signals["tau"] = (
            np.round((tau[shown] + arm.noise * rng.standard_normal(signals["q"].shape)) / arm.step) * arm.step
        )
        if speeds:
            signals["dq"] = shifted(dq, 2e-3)[shown] + 0.5 * encoder / 2e-3 * 0.02 * rng.standard_normal(
                signals["q"].shape
            )
        if warm:
            signals["temp"] = np.round(case.warmth[index][shown], 1)
        columns = {"time": np.round(np.arange(len(signals["q"])) * every * STEP, 6)}
        columns |= {
            f"{key}_{name}": part[:, k].copy() for key, part in signals.items() for k, name in enumerate(arm.joints)
        }
        if power:
            drawn_power = 40 + (given * turned + resistance * given**2).sum(axis=1)[shown]
            columns["power"] = np.round(drawn_power + 0.5 * rng.standard_normal(len(drawn_power)), 1)
        pq.write_table(pa.table(columns), folder / "runs" / f"run_{index:02d}.parquet")
        lines += ["[[run]]", f'file = "runs/run_{index:02d}.parquet"', f'role = "{role}"', "payload_mass = 0.0"]
        repeat = case.repeats[index]
        lines += [f'repeat_of = "runs/run_{repeat:02d}.parquet"'] if repeat is not None else []
    (folder / "robot.urdf").write_text(arm.drawn, encoding="utf-8")
    (folder / "dataset.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(prog="python stranger.py", description=__doc__)
    parser.add_argument("models", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--count", type=int, default=40)
    given = parser.parse_args()
    labels = {f"case_{k:03d}": make(given.models, given.folder, given.seed, k) for k in range(given.count)}
    given.folder.with_name(given.folder.name + "_labels.json").write_text(
        json.dumps(labels, indent=1), encoding="utf-8"
    )


if __name__ == "__main__":
    main()
