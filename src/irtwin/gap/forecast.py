"""The forecast: what a diagnosis will take, said before one that is long begins."""

from __future__ import annotations

from dataclasses import dataclass

from irtwin.signals.log import DataSet

LONG = 30.0  # s: of less nothing is said
_GROUPS = 8  # at least: few runs are cut in time

# Set by hand to what `bench/diagnosis_speed.py` took, with power: 12x1000 of 6, 12, 20 and 30 joints, 12x5000 of 6, and
# 1x200000. How often is searched depends on what is found.
_PER_SAMPLE = 4.5e-5  # s, of each sample and joint
_OF_TORQUE = (8.47e-3, 2.022)  # s, of each group and either role: times joints to a power
_OF_POWER = 1.1  # as much together, where power was measured too
_BEFORE = 0.2e9  # bytes that the program has without data
_HELD = (1.57e6, 1.4)  # bytes, of each group and either role: times joints to a power
_PER_VALUE = 800.0  # bytes, of each sample and joint


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
        taken = f"about {time} of processor, more where much differs, and {self.memory / 1e9:.1f} GB"
        return f"{self.joints} joints, {self.runs} runs: {taken}"


def forecast(data_set: DataSet) -> Forecast:
    """Return what the diagnosis of a data set will take."""
    runs, joints = data_set.runs, len(data_set.robot.joints)
    groups = max(len({(run.role == "observed", run.repeat_of or run.name) for run in runs}), _GROUPS)
    power = any(run.signals.power is not None for run in runs)
    equations = groups * len({run.role == "observed" for run in runs}) * (_OF_POWER if power else 1.0)
    values = joints * sum(len(run.signals.time) for run in runs)
    seconds, held = (per * equations * joints**grown for per, grown in (_OF_TORQUE, _HELD))
    return Forecast(joints, len(runs), _PER_SAMPLE * values + seconds, _BEFORE + held + _PER_VALUE * values)
