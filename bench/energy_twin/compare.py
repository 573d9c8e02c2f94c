"""`python -m energy_twin.compare [--seeds N...]`: the twin that nobody chose effects for, beside others.

Each case's runs are split as `irtwin run` splits them; what is judged took no part in a fit, nor in the choice.
figaroh identifies torque alone: its energies are those of its torque by the least squares of power beside it.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import nnls

from beside_figaroh import figaroh_torque
from energy_twin.cases import Case, cases
from energy_twin.coverage import KINDS, checks, inconsistent
from irtwin.effects.catalogue import BASELINE
from irtwin.effects.stack import Stack
from irtwin.gap.choice import identified
from irtwin.identification.cutoff import cutoff_for
from irtwin.identification.validation import Split, energy, energy_error, split
from irtwin.signals.conditioning import condition
from irtwin.signals.filter import low_pass
from irtwin.signals.motion import Motion
from irtwin.twin.twin import Twin

PLAIN, FIGAROH, CHOSEN = "least squares", "figaroh", "chosen"
METHODS = (PLAIN, FIGAROH, "baseline", "listed", CHOSEN)


@dataclass(frozen=True)
class Row:
    """What a method made of a case: energy errors of held-out runs, %, what intervals held, ratios to truth.

    `torque_left`: RMS of what is left of held-out torque over its own, %, in the mean over the joints.
    `held`: by kind of figure, which 95 % intervals hold what is true. `missed`: those that do not.
    """

    errors: list[float]
    torque_left: float
    standby: float
    copper: float
    seconds: float
    held: dict[str, list[bool]] = field(default_factory=dict)
    missed: tuple[str, ...] = ()
    inconsistent: int | None = None
    chosen: str = ""


def of_twin(case: Case, twin: Twin, parts: Split, seconds: float) -> Row:
    checked = list(checks(case, twin, parts.held_out))
    held: dict[str, list[bool]] = {kind: [] for kind in KINDS}
    for check in checked:
        held[check.kind].append(check.holds)
    missed = tuple(str(check) for check in checked if not check.holds)
    errors, copper = [], []
    for motion in parts.held_out:
        assert motion.power is not None
        told, taken = energy(motion.time, motion.power), twin.energy(motion)
        errors.append(100 * abs(taken - told) / told)
        heat = sum(entry.energy for entry in twin.ledger(motion) if entry.effect == "copper_loss")
        copper.append(heat / case.truth.energies[motion.run]["copper_loss"].sum())
    rest = next(one for one in twin.parameters if one.effect == "standby_power")
    listed = ", ".join(one for one in twin.effect_ids if one not in BASELINE)
    ratio = rest.value / case.truth.numbers["standby_power", None, "P0"]
    left = torque_left(parts, {motion.run: twin.torque(motion) for motion in parts.held_out})
    return Row(errors, left, ratio, float(np.mean(copper)), seconds, held, missed, inconsistent(twin), listed)


def torque_left(parts: Split, told: Mapping[str, np.ndarray]) -> float:
    logged = np.concatenate([motion.torque for motion in parts.held_out])
    passed = [low_pass(told[motion.run], motion.rate, motion.cutoff) for motion in parts.held_out]
    left = logged - np.concatenate(passed)
    return float(100 * np.mean(np.sqrt((left**2).mean(axis=0) / (logged**2).mean(axis=0))))


def least_squares(case: Case, parts: Split, stack: Stack) -> Row:
    """Torque by plain least squares, then power by `of_torque`."""
    began = time.perf_counter()
    rows = np.concatenate([stack.torque_columns(m).reshape(-1, len(stack.torque_terms)) for m in parts.fit])
    values = np.linalg.lstsq(rows, np.concatenate([m.torque.ravel() for m in parts.fit]), rcond=1e-9)[0]
    motions = (*parts.fit, *parts.held_out)
    real = {motion.run: stack.real_torque(motion, values) for motion in motions}
    left = torque_left(parts, {motion.run: stack.shown_torque(motion, values) for motion in parts.held_out})
    return of_torque(case, parts, stack, real, left, began)


def by_figaroh(case: Case, parts: Split, stack: Stack, python: str) -> Row:
    """Torque by figaroh, then power by `of_torque`."""
    began = time.perf_counter()
    motions = [*parts.fit, *parts.held_out]
    told, _ = figaroh_torque(case.data_set.robot.urdf, list(parts.fit), motions, python)
    torque = {motion.run: own for motion, own in zip(motions, told, strict=True)}
    return of_torque(case, parts, stack, torque, torque_left(parts, torque), began)


def of_torque(
    case: Case, parts: Split, stack: Stack, torque: Mapping[str, np.ndarray], left_of_torque: float, began: float
) -> Row:
    """Power on the torque of each run by least squares such that nothing is negative, where the robot takes some."""

    def columns(motion: Motion) -> tuple[np.ndarray, np.ndarray]:
        every = stack.power_columns(motion, torque[motion.run])
        return every[:, stack.fixed].sum(axis=1), every[:, ~stack.fixed]

    fitted = [(*columns(m), m.power) for m in parts.fit]
    taking = [known > 0 for known, _, _ in fitted]
    left = np.concatenate([(power - known)[on] for (known, _, power), on in zip(fitted, taking, strict=True)])
    free = nnls(np.concatenate([own[on] for (_, own, _), on in zip(fitted, taking, strict=True)]), left)[0]
    names = [effect.id for effect, term in stack.power_terms if not term.fixed]
    rest = np.array([name in ("standby_power", "holding_brakes") for name in names])
    heat = np.array([name == "copper_loss" for name in names])
    errors, copper = [], []
    for motion in parts.held_out:
        true = case.truth.energies[motion.run]["copper_loss"].sum()
        known, own = columns(motion)
        modelled = np.maximum(known + own @ np.where(rest, 0.0, free), 0.0) + own @ np.where(rest, free, 0.0)
        errors.append(energy_error(energy(motion.time, motion.power), energy(motion.time, modelled)))
        copper.append(energy(motion.time, own @ np.where(heat, free, 0.0)) / true)
    standby = free[names.index("standby_power")] / case.truth.numbers["standby_power", None, "P0"]
    return Row(errors, left_of_torque, standby, float(np.mean(copper)), time.perf_counter() - began)


def methods(case: Case, names: Sequence[str], python: str) -> dict[str, Row]:
    """Return what each of the named methods makes of a case; `python`: that which has figaroh."""
    robot = case.data_set.robot
    cutoff = cutoff_for(robot, case.data_set.runs, None).hz
    parts = split([condition(run, robot, cutoff) for run in case.data_set.runs])
    fitted = {motion.run for motion in parts.fit}
    runs = tuple(run for run in case.data_set.runs if run.name in fitted)
    known = replace(case.data_set, runs=runs, cutoff=cutoff)
    listed = (*BASELINE, *case.effects)
    stack = Stack(robot, [one for one in listed if one not in ("no_regeneration", "load_dependent_friction")])

    def made(name: str) -> Row:
        if name == PLAIN:
            return least_squares(case, parts, stack)
        if name == FIGAROH:
            return by_figaroh(case, parts, stack, python)
        began = time.perf_counter()
        twin = identified(replace(known, effects={"baseline": BASELINE, "listed": listed}.get(name)), parts.fit)
        return of_twin(case, twin, parts, time.perf_counter() - began)

    return {name: made(name) for name in names}


def line(name: str, rows: Sequence[Row]) -> str:
    """Return a line of the table over cases."""
    errors = [error for row in rows for error in row.errors]
    kinds = ([held for row in rows for held in row.held.get(kind, ())] for kind in KINDS)
    cover = [f"{sum(held)} of {len(held)}" if held else "-" for held in kinds]
    bodies = [str(sum(row.inconsistent or 0 for row in rows)) if rows[0].inconsistent is not None else "-"]
    ranges = (
        f"{min(values):.2f} to {max(values):.2f}" for values in zip(*((r.standby, r.copper) for r in rows), strict=True)
    )
    seconds = np.mean([row.seconds for row in rows])
    left = f"{np.mean([row.torque_left for row in rows]):.2f}"
    parts = (name, f"{np.mean(errors):.2f}", f"{max(errors):.2f}", left, *cover, *bodies, *ranges, f"{seconds:.0f}")
    return "| " + " | ".join(parts) + " |"


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m energy_twin.compare", description=__doc__)
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2])
    parser.add_argument("--only", default="", help="cases whose name has this word")
    parser.add_argument("--methods", nargs="+", choices=METHODS, default=[one for one in METHODS if one != FIGAROH])
    parser.add_argument("--motor-current", action="store_true", help="torque is logged as that of the motors")
    parser.add_argument("--figaroh", metavar="PYTHON", default="", help="the python that has figaroh, for its method")
    arguments = parser.parse_args()
    kinds: dict[str, dict[str, list[Row]]] = {}
    for case in cases(arguments.seeds, arguments.only, motor_current=arguments.motor_current):
        kind = f"{case.name.split()[0]}{', more' if ' more ' in case.name else ''}"
        for name, row in methods(case, arguments.methods, arguments.figaroh).items():
            kinds.setdefault(kind, {}).setdefault(name, []).append(row)
            print(f"# {case.name}, {name}: {np.mean(row.errors):.2f} {max(row.errors):.2f} {row.chosen}", flush=True)
            print(*(f"#   missed: {one}" for one in row.missed if name == CHOSEN), sep="\n", flush=True)
    heads = (
        "effects",
        "energy error, %: mean",
        "worst",
        "torque left, %",
        *(f"{kind} held" for kind in KINDS),
        "inconsistent bodies",
    )
    heads = (*heads, "standby / truth", "copper / truth", "s")
    print("| " + " | ".join(heads) + " |")
    print("| --- " * len(heads) + "|")
    for kind, of_kind in kinds.items():
        for name, rows in of_kind.items():
            print(line(f"{kind}: {name}", rows))


if __name__ == "__main__":
    main()
