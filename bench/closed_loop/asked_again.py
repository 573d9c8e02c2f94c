"""`python -m closed_loop.asked_again MODELS [--split SPLIT --count N] [--only CASE...]`: do next experiments tell?

Each case is diagnosed; the motion that is proposed is made by the same robot, and both logs are diagnosed together. A
row says what was asked, how far apart rivals were, were expected to be, and what is named then. A payload or cover
that is to be put on or taken off is not simulated: of such experiments the motion alone is made.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from closed_loop.cases import SEEDS, Case, Plan, plans
from closed_loop.data_set import write_data_set
from closed_loop.effects import Effect, sensed
from closed_loop.programmes import Programme
from closed_loop.simulation import Surroundings, Trace, simulate
from irtwin.document.document import Document
from irtwin.document.experiment import Experiment
from irtwin.gap.diagnosis import diagnose
from irtwin.signals.log import read_data_set
from irtwin.signals.motion import Motion


@dataclass(frozen=True)
class Answer:
    """What was said before an experiment, what it asked, and what was said after it; None: it was not made."""

    true: tuple[Effect, ...]
    before: Document
    asked: Experiment
    after: Document | None


def answer(plan: Plan, models: Path) -> Answer | None:
    """Return what a case's experiment told; None where there is none to make."""
    case = Case(plan, models)
    traces, effects, _ = case.make()
    true = tuple(effects)
    before, planned = _diagnosed(case, true, traces)
    if before.next_experiment is None or planned is None:
        return None
    try:
        more = list(_made(case, true, before.next_experiment, planned))
    except RuntimeError:  # the robot cannot follow
        return Answer(true, before, before.next_experiment, None)
    return Answer(true, before, before.next_experiment, _diagnosed(case, true, [*traces, *more])[0])


def _diagnosed(case: Case, effects: tuple[Effect, ...], traces: list[Trace]) -> tuple[Document, Motion | None]:
    """Diagnose a case's traces, and others made as its last run was."""
    more = len(traces) - len(case.roles)
    tells = [sensed(effects, trace.tau, case.machine.step, _run(case, k)) for k, trace in enumerate(traces)]
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "case"
        roles, repeats = [*case.roles, *["observed"] * more], [*case.repeats, *[None] * more]
        write_data_set(place, case.machine, traces, tells, roles, repeats, case.plan.seed)
        found = diagnose(read_data_set(place))
    return found.document, found.planned


def _run(case: Case, number: int) -> int:
    return number if number < len(case.roles) else int(np.flatnonzero(case.observed)[-1])


def _made(case: Case, effects: tuple[Effect, ...], asked: Experiment, planned: Motion) -> Iterator[Trace]:
    """Yield what the robot does, run by run, as warm as it was last or as it is asked to be."""
    time = np.arange(0.0, planned.time[-1] - planned.time[0], case.machine.step)
    law = CubicSpline(planned.time - planned.time[0], planned.q)
    programme = Programme(*(law(time, order) for order in range(3)))
    last = _run(case, len(case.roles))
    assert asked.programme is not None
    for run in asked.programme.runs:
        warm = case.around[last].warmth[-1]
        warm = warm if run.temperature_degc is None else np.full_like(warm, run.temperature_degc)
        wander = 1 + case.machine.wander * float(np.clip(case.rng.standard_normal(), -2, 2))
        yield simulate(case.machine, programme, effects, last, Surroundings(np.tile(warm, (len(time), 1)), wander))


def row(name: str, one: Answer) -> str:
    """Return a case's row in Markdown."""
    true = ", ".join(effect.id for effect in one.true) or "nothing"
    asked = "; ".join(
        f"{' or '.join(each.effects)}: {each.separation_now:g}, {each.expected_separation:g}"
        for each in one.asked.questions
    )
    return f"| {name} | {true} | {_named(one.before)} | {asked} | {_named(one.after)} |"


def _named(said: Document | None) -> str:
    if said is None:
        return "could not be made"
    causes = [
        f"{'/'.join([one.effect, *one.indistinguishable_from])} {one.confidence:.2f}"
        for one in sorted(said.causes, key=lambda one: -one.confidence)
    ]
    return ", ".join([str(said.verdict), *causes])


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m closed_loop.asked_again", description=__doc__)
    parser.add_argument("models", type=Path)
    parser.add_argument("--split", choices=sorted(SEEDS), default="development")
    parser.add_argument("--count", type=int, default=24)
    parser.add_argument("--only", nargs="*", default=[], help="names of cases")
    arguments = parser.parse_args()
    print("| case | true | said | asked: apart now, expected | said then |\n| --- | --- | --- | --- | --- |")
    for plan in plans(arguments.split, arguments.count):
        if plan.name in (arguments.only or [plan.name]) and (one := answer(plan, arguments.models)) is not None:
            print(row(plan.name, one), flush=True)


if __name__ == "__main__":
    main()
