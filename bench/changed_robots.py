"""Arms that others modelled, under a plant that nothing else here knows; in each one thing changes.

In bench/: `python changed_robots.py MODELS FOLDER [--only N...]`, MODELS the folder of `pip download --no-deps
example-robot-data -d MODELS`. Friction is LuGre's bristles with Stribeck's drop, load and viscosity, gears ripple, arms
are controlled by Pinocchio's forward dynamics, encoders are coarse, and torque is a noisy current. A twin of the
baseline effects so lacks presliding, load friction and ripple in all runs; what changed is named beside.
"""

from __future__ import annotations

import argparse
import re
import shutil
import time
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio as pin

from irtwin.gap.diagnosis import diagnose
from irtwin.signals.log import read_data_set

ARMS = {
    "z1": ("z1_description/urdf/z1.urdf", 6),
    "ur5": ("ur_description/urdf/ur5_robot.urdf", 6),
    "panda": ("panda_description/urdf/panda.urdf", 7),
    "ur10": ("ur_description/urdf/ur10_robot.urdf", 6),
}
CHANGES = (
    (None, True), (None, False), (None, True), ("coulomb_friction", True), ("viscous_friction", True),
    ("payload", True), ("torque_constant_error", True), ("encoder_offset", True), ("coulomb_friction", False),
    ("payload", False), ("base_tilt", True), ("torque_constant_error", False),
)  # fmt: skip
SEED, STEP, SECONDS = 200, 5e-4, 12
FIXED = r'(<joint\s+name="(?:jointGripper|panda_finger_joint\d)"[^>]*?type=")\w+"'

Motion = tuple[np.ndarray, np.ndarray, np.ndarray]  # positions, speeds, accelerations, (N, n)


@dataclass
class Plant:
    """A robot with numbers that a change may alter; arrays are of its joints, (n,)."""

    model: pin.Model
    coulomb: np.ndarray
    stribeck: np.ndarray
    stribeck_speed: np.ndarray
    viscous: np.ndarray
    bristle: np.ndarray
    load: np.ndarray
    rotor: np.ndarray
    ripple: np.ndarray
    teeth: np.ndarray
    fastest: np.ndarray
    noise: np.ndarray
    encoder: float
    inertia: np.ndarray
    scale: np.ndarray
    gain: np.ndarray
    offset: np.ndarray
    tilt: np.ndarray
    payload: float = 0.0

    @classmethod
    def drawn(cls, model: pin.Model, rng: np.random.Generator) -> Plant:
        n, data = model.nv, model.createData()
        still = np.zeros(n)
        held = [np.abs(pin.rnea(model, data, pin.randomConfiguration(model), still, still)) for _ in range(200)]
        inertia = np.mean([np.diag(pin.crba(model, data, pin.randomConfiguration(model))) for _ in range(50)], axis=0)
        scale = np.maximum(np.max(held, axis=0), 0.15 * np.max(held))
        coulomb = scale * rng.uniform(0.08, 0.2, n)
        stribeck, speed = coulomb * rng.uniform(1.0, 1.5, n), rng.uniform(0.01, 0.08, n)
        viscous, bristle = scale * rng.uniform(0.05, 0.2, n), rng.uniform(2e-4, 2e-3, n)
        load, rotor = rng.uniform(0, 0.05, n), inertia * rng.uniform(0.3, 1.0, n)
        rotor = np.maximum(rotor, 4 * coulomb / bristle * STEP**2)  # bristles are stiff
        ripple, teeth = scale * rng.uniform(0, 0.01, n), rng.integers(20, 101, n)
        fastest, noise = rng.uniform(1.0, 2.0, n), 0.004 * scale + 0.002 * scale.max()
        encoder = 2 * np.pi / 2 ** rng.integers(15, 20)
        return cls(
            model, coulomb, stribeck, speed, viscous, bristle, load, rotor, ripple, teeth, fastest, noise, encoder,
            inertia + rotor, scale, np.ones(n), np.zeros(n), np.zeros(3),
        )  # fmt: skip

    def changed(self, effect: str, rng: np.random.Generator) -> str | None:
        """Change one thing; return the joint where, by its name."""
        joint = int(rng.integers(0, len(self.scale) - 2))
        if effect == "payload":
            self.payload = rng.uniform(0.05, 0.1) * self.scale.max() / 9.81 / 0.6
        elif effect == "base_tilt":
            self.tilt = np.radians([1.5, 1.0, 0.0])
        elif effect == "encoder_offset":
            joint = min(joint, 2) or 1  # about a vertical axis nothing shows it
            self.offset[joint] = np.radians(1.0)
        elif effect == "torque_constant_error":
            self.gain[joint] = 0.93
        elif effect == "viscous_friction":
            self.viscous[joint] *= 1.8
        else:
            self.coulomb[joint] *= 1.5
            self.stribeck[joint] *= 1.5
        return None if effect in ("payload", "base_tilt") else str(self.model.names[joint + 1])

    def bodies(self) -> pin.Model:
        """Return the bodies as they are, with what is carried, on the base as it stands."""
        model = self.model.copy()
        model.armature = self.rotor.copy()
        if self.payload:
            load = pin.Inertia(self.payload, np.array([0.02, 0.0, 0.06]), np.eye(3) * self.payload * 0.003)
            model.appendBodyToJoint(model.njoints - 1, load, pin.SE3.Identity())
        model.gravity.linear = pin.exp3(self.tilt).T @ model.gravity.linear
        return model

    def logged(self, motion: Motion, rate: int, drift: float, rng: np.random.Generator) -> np.ndarray:
        """Return what a log shows of a motion, (N, 1 + 2 n): time, positions, torques. Friction drifts by the run."""
        coulomb, stribeck, viscous = (
            each * (1 + drift * rng.standard_normal(len(each))) for each in (self.coulomb, self.stribeck, self.viscous)
        )
        real, known = self.bodies(), self.model.copy()
        known.armature = self.rotor.copy()
        data, feed = real.createData(), known.createData()
        stiff = coulomb / self.bristle
        proportional = np.maximum(900 * self.inertia, self.coulomb / 0.003)
        damping = 1.4 * np.sqrt(proportional * self.inertia)
        q, dq, bend, rows = motion[0][0].copy(), np.zeros(len(coulomb)), np.zeros(len(coulomb)), []
        for wanted, speed, acceleration in zip(*motion, strict=True):
            forward = pin.rnea(known, feed, wanted, speed, acceleration)
            for part in range(round(1 / rate / STEP)):
                drive = proportional * (wanted - q) + damping * (speed - dq) + forward
                if part == 0:
                    rows.append(np.concatenate([q, drive]))
                most = coulomb + self.load * np.abs(drive)
                most = most + np.maximum(stribeck - coulomb, 0) * np.exp(-((dq / self.stribeck_speed) ** 2))
                full = most / stiff * np.sign(dq)
                bend = np.where(dq == 0, bend, full + (bend - full) * np.exp(-stiff * np.abs(dq) / most * STEP))
                friction = stiff * bend + viscous * dq + self.ripple * np.sin(self.teeth * q)
                dq = dq + STEP * pin.aba(real, data, q, dq, drive - friction)
                q = q + STEP * dq
        position, torque = np.split(np.array(rows), 2, axis=1)
        position = np.round((position + self.offset) / self.encoder) * self.encoder
        torque = torque * self.gain + self.noise * rng.standard_normal(torque.shape)
        return np.column_stack([np.arange(len(rows)) / rate, position, torque])


def read_arm(models: Path, name: str) -> tuple[pin.Model, str]:
    """Return an arm without its hand, and its URDF with the hand fixed."""
    path, joints = ARMS[name]
    (wheel,) = models.glob("example_robot_data-*.whl")
    with zipfile.ZipFile(wheel) as packed:
        urdf = packed.read(f"cmeel.prefix/share/example-robot-data/robots/{path}").decode()
    urdf = re.sub(r"<mimic[^>]*/>", "", re.sub(FIXED, r'\1fixed"', urdf))
    model = pin.buildModelFromXML(urdf)
    others = list(range(joints + 1, model.njoints))
    return (pin.buildReducedModel(model, others, pin.neutral(model)) if others else model), urdf


def sums_of_sines(plant: Plant, rng: np.random.Generator, time: np.ndarray) -> Motion:
    lower, upper = (np.clip(end, -2.6, 2.6) for end in _limits(plant))
    slowest, positions = 4 * np.pi / SECONDS, np.zeros((len(time), len(lower)))
    for joint, (low, high) in enumerate(zip(lower, upper, strict=True)):
        turns = [rng.standard_normal(2) / k for k in range(1, 6)]
        angle = sum(
            a * np.sin(k * slowest * time) + b * np.cos(k * slowest * time) for k, (a, b) in enumerate(turns, 1)
        )
        angle = angle - angle.mean()
        speed = np.abs(np.gradient(angle, time)).max()
        most = min(0.8 * plant.fastest[joint] / speed, 0.4 * (high - low) / np.abs(angle).max())
        positions[:, joint] = 0.35 * (low + high) + most * angle
    return _moved(positions, time)


def from_pose_to_pose(plant: Plant, rng: np.random.Generator, time: np.ndarray) -> Motion:
    lower, upper = (np.clip(end, -2.2, 2.2) for end in _limits(plant))
    here, rate = 0.35 * (lower + upper), 1 / (time[1] - time[0])
    rows: list[np.ndarray] = []
    while len(rows) < len(time):
        there = lower + (upper - lower) * rng.uniform(0.15, 0.85, len(lower))
        x = np.linspace(0, 1, int(max(1.2, (1.9 * np.abs(there - here) / plant.fastest).max()) * rate))
        rows += [*(here + np.outer(10 * x**3 - 15 * x**4 + 6 * x**5, there - here))]
        rows += [there] * int(rng.uniform(0.2, 0.8) * rate)
        here = there
    return _moved(np.array(rows[: len(time)]), time)


def _limits(plant: Plant) -> tuple[np.ndarray, np.ndarray]:
    return plant.model.lowerPositionLimit, plant.model.upperPositionLimit


def _moved(positions: np.ndarray, time: np.ndarray) -> Motion:
    speeds = np.gradient(positions, time, axis=0)
    return positions, speeds, np.gradient(speeds, time, axis=0)


def make(models: Path, folder: Path, number: int) -> str:
    """Write a case's data set, and return what is true of it."""
    effect, repeated = CHANGES[number]
    rng = np.random.default_rng(SEED + number)
    name = list(ARMS)[number % len(ARMS)]
    model, urdf = read_arm(models, name)
    pin.seed(SEED + number)
    plant = Plant.drawn(model, rng)
    rate, drift = int(rng.choice([100, 200, 250])), float(rng.choice([0, 0.01, 0.03]))
    time = np.arange(SECONDS * rate) / rate
    programmes = [made(plant, rng, time) for made in (sums_of_sines, sums_of_sines, *[from_pose_to_pose] * 2)]
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "runs").mkdir(parents=True)
    (folder / "robot.urdf").write_text(urdf, encoding="utf-8")
    said = [f'[robot]\nname = "{name}_{number}"\nurdf = "robot.urdf"\n']
    joints = list(model.names)[1:]
    header = ",".join(["time", *(f"q_{joint}" for joint in joints), *(f"tau_{joint}" for joint in joints)])

    def log(role: str, motions: Sequence[Motion]) -> None:
        for place, motion in enumerate(motions):
            first = f"runs/{role}_{place}.csv"
            for again in range(2 if repeated else 1):
                file = f"runs/{role}_{place}_again.csv" if again else first
                rows = plant.logged(motion, rate, drift, rng)
                np.savetxt(folder / file, rows, "%.7g", ",", header=header, comments="")
                repeat = f'repeat_of = "{first}"\n' if again else ""
                said.append(f'[[run]]\nfile = "{file}"\nrole = "{role}"\n{repeat}')

    log("reference", programmes)
    where = plant.changed(effect, rng) if effect else None
    log("observed", programmes[:3])
    (folder / "dataset.toml").write_text("\n".join(said), encoding="utf-8")
    return f"{name}, {rate} Hz, friction drifts {drift:.0%}: {effect or 'nothing'} {where or ''}"


def diagnosed(folder: Path) -> str:
    """Return what a diagnosis says of a data set: causes of 0.5 and more, those that changed first."""
    began = time.process_time()
    document = diagnose(read_data_set(folder)).to_json()
    causes = [cause for cause in document["causes"] if cause["confidence"] >= 0.5]
    causes.sort(key=lambda cause: cause["scope"] != "changed")
    told = [
        f"{cause['effect']} {cause['scope']} at {len(cause['joints'])} joints ({', '.join(cause['joints'][:2])}) "
        f"{cause['confidence']:.2f}"
        for cause in causes
    ]
    return f"{document['verdict']}: {'; '.join(told) or 'nothing'}; {time.process_time() - began:.0f} s"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("models", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", type=int, nargs="+", default=range(len(CHANGES)), help="numbers of cases")
    arguments = parser.parse_args()
    for number in arguments.only:
        folder = arguments.folder / f"case_{number:02d}"
        true = make(arguments.models, folder, number)
        print(f"{number:2d} {true}\n   {diagnosed(folder)}", flush=True)


if __name__ == "__main__":
    main()
