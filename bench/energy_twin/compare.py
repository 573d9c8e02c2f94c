"""`python -m energy_twin.compare [--seeds N...]`: the twin that nobody chose effects for, beside others.

Each case's runs are split as `irtwin run` splits them; what is judged took no part in a fit, nor in the choice.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import nnls

from energy_twin.cases import Case, cases
from energy_twin.coverage import KINDS, checks, inconsistent
from irtwin.effects.catalogue import BASELINE
from irtwin.effects.stack import Stack
from irtwin.gap.choice import identified
from irtwin.identification.cutoff import cutoff_for
from irtwin.identification.validation import Split, energy, energy_error, split
from irtwin.signals.conditioning import condition
from irtwin.signals.motion import Motion
from irtwin.twin.twin import Twin

PLAIN, CHOSEN = "least squares", "chosen"
METHODS = (PLAIN, "baseline", "listed", CHOSEN)


@dataclass(frozen=True)
class Row:
    """What a method made of a case: energy errors of held-out runs, %, what intervals held, ratios to truth.

    `held`: by kind of figure, which 95 % intervals hold what is true. `missed`: those that do not.
    """

    errors: list[float]
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
    return Row(errors, ratio, float(np.mean(copper)), seconds, held, missed, inconsistent(twin), listed)


def least_squares(case: Case, parts: Split, effects: Sequence[str]) -> Row:
    """Torque by plain least squares, then power by such that nothing is negative, where the robot takes some."""
    began = time.perf_counter()
    stack = Stack(
        case.data_set.robot, [one for one in effects if one not in ("no_regeneration", "load_dependent_friction")]
    )
    rows = np.concatenate([stack.torque_columns(m).reshape(-1, len(stack.torque_terms)) for m in parts.fit])
    values = np.linalg.lstsq(rows, np.concatenate([m.torque.ravel() for m in parts.fit]), rcond=1e-9)[0]

    def columns(motion: Motion) -> tuple[np.ndarray, np.ndarray]:
        every = stack.predicted_power_columns(motion, values)
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
    return Row(errors, standby, float(np.mean(copper)), time.perf_counter() - began)


def methods(case: Case, names: Sequence[str]) -> dict[str, Row]:
    """Return what each of the named methods makes of a case."""
    robot = case.data_set.robot
    cutoff = cutoff_for(robot, case.data_set.runs, None).hz
    parts = split([condition(run, robot, cutoff) for run in case.data_set.runs])
    fitted = {motion.run for motion in parts.fit}
    runs = tuple(run for run in case.data_set.runs if run.name in fitted)
    known = replace(case.data_set, runs=runs, cutoff=cutoff)
    listed = (*BASELINE, *case.effects)

    def made(name: str) -> Row:
        if name == PLAIN:
            return least_squares(case, parts, listed)
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
    parts = (name, f"{np.mean(errors):.2f}", f"{max(errors):.2f}", *cover, *bodies, *ranges, f"{seconds:.0f}")
    return "| " + " | ".join(parts) + " |"


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m energy_twin.compare", description=__doc__)
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2])
    parser.add_argument("--only", default="", help="cases whose name has this word")
    parser.add_argument("--methods", nargs="+", choices=METHODS, default=METHODS)
    arguments = parser.parse_args()
    kinds: dict[str, dict[str, list[Row]]] = {}
    for case in cases(arguments.seeds, arguments.only):
        kind = f"{case.name.split()[0]}{', more' if ' more ' in case.name else ''}"
        for name, row in methods(case, arguments.methods).items():
            kinds.setdefault(kind, {}).setdefault(name, []).append(row)
            print(f"# {case.name}, {name}: {np.mean(row.errors):.2f} {max(row.errors):.2f} {row.chosen}", flush=True)
            print(*(f"#   missed: {one}" for one in row.missed if name == CHOSEN), sep="\n", flush=True)
    heads = ("effects", "energy error, %: mean", "worst", *(f"{kind} held" for kind in KINDS), "inconsistent bodies")
    heads = (*heads, "standby / truth", "copper / truth", "s")
    print("| " + " | ".join(heads) + " |")
    print("| --- " * len(heads) + "|")
    for kind, of_kind in kinds.items():
        for name, rows in of_kind.items():
            print(line(f"{kind}: {name}", rows))


if __name__ == "__main__":
    main()
