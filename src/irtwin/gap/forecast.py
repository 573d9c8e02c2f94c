"""The forecast: what a diagnosis will take, said before one that is long begins."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from irtwin.effects.catalogue import catalogue
from irtwin.effects.effect import Effect
from irtwin.effects.local import LocalEffect
from irtwin.effects.stack import Stack
from irtwin.gap.data.baseline import Baseline
from irtwin.gap.regression.hypotheses import candidate_columns, place_of
from irtwin.gap.regression.normal_equations import Sizes
from irtwin.signals.conditioning import choose_cutoff
from irtwin.signals.filter import decimation
from irtwin.signals.log import DataSet, Run

LONG = 30.0  # s: of less nothing is said
_GROUPS = 8  # at least: few runs are cut in time
_BLOCKS = 40  # at least

# Set by hand to what `bench/diagnosis_speed.py` took, with power: 12x1000 of 6, 12, 20, 30 and 40 joints, and 12x5000
# of 6 (docs/findings/gap-diagnosis.md, "Many joints"). How often is searched depends on what is found.
_PER_SAMPLE = 2.6e-5  # s, of each sample and joint
_PER_COLUMN = 5e-3  # s, of each column of the equations
_PER_PRODUCT = 4.2e-6  # s, of each product of a term of the twin with a column, in each group
_BEFORE = 0.2e9  # bytes that the program has without data
_HELD = 2.0  # times what the equations' products take: those of torque alone, and the next experiment's, stand beside


@dataclass(frozen=True)
class Forecast:
    """What a diagnosis of some joints and runs will take: `seconds` of one processor, and `memory`, bytes."""

    joints: int
    runs: int
    seconds: float
    memory: float

    @property
    def long(self) -> bool:
        """Whether it is worth saying."""
        return self.seconds > LONG

    @property
    def line(self) -> str:
        """It in words."""
        minutes = self.seconds / 60
        time = f"{minutes:.0f} minutes" if minutes >= 1.5 else f"{10 * round(self.seconds / 10)} s"
        return f"{self.joints} joints, {self.runs} runs: about {time} of processor and {self.memory / 1e9:.1f} GB"


def forecast(data_set: DataSet, begun: Baseline) -> Forecast:
    """Return what the diagnosis of a data set will take, whose twin begins so."""
    sizes = _sizes(data_set, begun)
    joints, runs = len(begun.robot.joints), len(data_set.runs)
    return forecast_of(sizes, joints, runs, sum(len(run.signals.time) for run in data_set.runs))


def forecast_of(sizes: Sizes, joints: int, runs: int, samples: int) -> Forecast:
    """Return what a diagnosis takes whose equations have such sizes, of so many samples in all runs."""
    products = (int(sizes.group.max()) + 1) * sizes.base * sizes.size
    seconds = _PER_SAMPLE * samples * joints + _PER_COLUMN * sizes.size + _PER_PRODUCT * products
    return Forecast(joints, runs, seconds, _BEFORE + _HELD * sizes.bytes)


def _sizes(data_set: DataSet, begun: Baseline) -> Sizes:
    """Return the sizes that the equations of torque and power will have, but for what screening takes off."""
    stack = Stack(begun.robot, begun.effects)
    power = any(run.signals.power is not None for run in data_set.runs)
    tried = candidate_columns(begun.robot, _tried(begun, data_set.runs, power=power))
    placed = [place_of(column.term) for column in tried if column.effect.signal == "torque"]
    columns = stack.pattern.sum(axis=1) + np.array(
        [sum(place in (name, None) for place in placed) for name in begun.robot.joint_names]
    )
    base = len(stack.torque_terms) + power * int((~stack.fixed).sum())
    if power:
        columns = np.append(columns, base + len(tried))
    group = _group(data_set.runs)
    return Sizes(
        _rows(data_set, len(group), len(columns)),
        columns + 1,
        group,
        base,
        base + len(tried) * _copies(data_set.runs),
    )


def _copies(runs: Sequence[Run]) -> int:
    """Return how often each column stands there: as it is, and where runs differ in role as a change."""
    return len({run.role == "observed" for run in runs})


def _tried(begun: Baseline, runs: Sequence[Run], *, power: bool) -> list[Effect]:
    """Return the effects that the search will try; those at a place are found before."""
    bodies = any(run.role == "simulated" for run in runs)
    return [
        shape
        for effect in catalogue().values()
        if not effect.disturbance
        and (bodies or not effect.bodies)
        and (power or effect.signal == "torque")
        and not isinstance(effect, LocalEffect)
        for shape in (*effect.candidates(begun.robot), *(effect.changes() if _copies(runs) > 1 else ()))
    ]


def _group(runs: Sequence[Run]) -> np.ndarray:
    """Return the group of each block of time, (B,): a programmed motion's in either role; few are cut in time."""
    motions = {(run.role == "observed", run.repeat_of or run.name) for run in runs}
    groups = max(len(motions), _GROUPS)
    blocks = max(_BLOCKS, len(runs), groups)
    return np.arange(blocks) * groups // blocks


def _rows(data_set: DataSet, blocks: int, equations: int) -> np.ndarray:
    """Return how many rows a block leaves of each equation, (B, g), behind the filter."""
    cutoff = data_set.cutoff or choose_cutoff(data_set.runs)
    left = sum(len(run.signals.time) / decimation(_rate(run), cutoff) for run in data_set.runs)
    return np.full((blocks, equations), max(1, round(left / blocks)))


def _rate(run: Run) -> float:
    """Return how often a run was sampled in the mean, Hz."""
    time = run.signals.time
    return (len(time) - 1) / max(float(time[-1] - time[0]), np.finfo(float).tiny)
