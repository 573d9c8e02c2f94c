"""`python -m energy_twin.compare [--seeds N] [--only WORD]`: the twin that nobody chose effects for, beside others.

Each case's runs are split as `irtwin run` splits them; what is judged took no part in a fit, nor in the choice.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import nnls

from energy_twin.cases import Case, cases
from irtwin.effects.catalogue import BASELINE
from irtwin.effects.effect import NORMAL
from irtwin.effects.stack import Stack
from irtwin.gap.choice import identified
from irtwin.identification.cutoff import cutoff_for
from irtwin.identification.validation import Split, energy, energy_error, split
from irtwin.signals.conditioning import condition
from irtwin.signals.motion import Motion
from irtwin.twin.account import ledger_covariance
from irtwin.twin.price import cost
from irtwin.twin.twin import Twin


@dataclass(frozen=True)
class Row:
    """What a method made of a case: energy errors of held-out runs, %, whether 95 % intervals held, ratios to truth."""

    errors: list[float]
    covered: list[bool]
    copper_covered: list[bool]
    standby_covered: bool | None
    standby: float
    copper: float
    seconds: float
    chosen: str = ""


def of_twin(case: Case, twin: Twin, parts: Split, seconds: float) -> Row:
    errors, covered, copper, copper_covered = [], [], [], []
    for motion in parts.held_out:
        assert motion.power is not None
        told, taken = energy(motion.time, motion.power), cost(twin, [motion]).energy
        errors.append(100 * abs(taken.value - told) / told)
        covered.append(taken.half_width is not None and abs(taken.value - told) <= taken.half_width)
        ledger, true = twin.ledger(motion), case.copper[motion.run]
        own = [place for place, entry in enumerate(ledger) if entry.effect == "copper_loss"]
        heat = sum(ledger[place].energy for place in own)
        copper.append(heat / true)
        if own:
            variance = ledger_covariance(twin, motion, ledger)[np.ix_(own, own)].sum()
            copper_covered.append(bool(abs(heat - true) <= NORMAL * variance**0.5))
    rest = next(one for one in twin.parameters if one.effect == "standby_power")
    held = rest.lower is not None and rest.upper is not None and rest.lower <= case.standby <= rest.upper
    listed = ", ".join(one for one in twin.effect_ids if one not in BASELINE)
    mean = float(np.mean(copper))
    return Row(errors, covered, copper_covered, held, rest.value / case.standby, mean, seconds, listed)


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
        known, own = columns(motion)
        modelled = np.maximum(known + own @ np.where(rest, 0.0, free), 0.0) + own @ np.where(rest, free, 0.0)
        errors.append(energy_error(energy(motion.time, motion.power), energy(motion.time, modelled)))
        copper.append(energy(motion.time, own @ np.where(heat, free, 0.0)) / case.copper[motion.run])
    standby = free[names.index("standby_power")] / case.standby
    return Row(errors, [], [], None, standby, float(np.mean(copper)), time.perf_counter() - began)


def methods(case: Case) -> dict[str, Row]:
    """Return what each method makes of a case."""
    robot = case.data_set.robot
    cutoff = cutoff_for(robot, case.data_set.runs, None).hz
    parts = split([condition(run, robot, cutoff) for run in case.data_set.runs])
    fitted = {motion.run for motion in parts.fit}
    runs = tuple(run for run in case.data_set.runs if run.name in fitted)
    known = replace(case.data_set, runs=runs, cutoff=cutoff)
    listed = (*BASELINE, *case.effects)
    found = {"least squares, listed": least_squares(case, parts, listed)}
    for name, effects in (("baseline", BASELINE), ("listed", listed), ("chosen", None)):
        began = time.perf_counter()
        twin = identified(replace(known, effects=effects), parts.fit)
        found[name] = of_twin(case, twin, parts, time.perf_counter() - began)
    return found


def line(name: str, rows: Sequence[Row]) -> str:
    """Return a line of the table over cases."""
    errors = [error for row in rows for error in row.errors]
    covered = [held for row in rows for held in row.covered]
    copper = [held for row in rows for held in row.copper_covered]
    standby = [row.standby_covered for row in rows if row.standby_covered is not None]
    cover = [f"{100 * np.mean(held):.0f} %" if held else "-" for held in (covered, standby, copper)]
    ranges = (
        f"{min(values):.2f} to {max(values):.2f}" for values in zip(*((r.standby, r.copper) for r in rows), strict=True)
    )
    seconds = np.mean([row.seconds for row in rows])
    parts = (name, f"{np.mean(errors):.2f}", f"{max(errors):.2f}", *cover, *ranges, f"{seconds:.0f}")
    return "| " + " | ".join(parts) + " |"


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m energy_twin.compare", description=__doc__)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--only", default="", help="cases whose name has this word")
    arguments = parser.parse_args()
    kinds: dict[str, dict[str, list[Row]]] = {}
    for case in cases(arguments.seeds, arguments.only):
        kind = f"{case.name.split()[0]}{', more' if ' more ' in case.name else ''}"
        for name, row in methods(case).items():
            kinds.setdefault(kind, {}).setdefault(name, []).append(row)
            print(f"# {case.name}, {name}: {np.mean(row.errors):.2f} {max(row.errors):.2f} {row.chosen}", flush=True)
    heads = ("effects", "energy error, %: mean", "worst", "covered: energy", "standby", "copper")
    print("| " + " | ".join((*heads, "standby / truth", "copper / truth", "s")) + " |")
    print("| --- " * 9 + "|")
    for kind, of_kind in kinds.items():
        for name, rows in of_kind.items():
            print(line(f"{kind}: {name}", rows))


if __name__ == "__main__":
    main()
