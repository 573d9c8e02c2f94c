"""What a page draws of a diagnosis: curves and maps, too long for rows. Numbers are None where there is none."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from irtwin.document import form
from irtwin.document.told import part, tells, told
from irtwin.document.words import Channel, Joint, Regime, Run

Numbers = tuple[float | None, ...]
Known = tuple[float, ...]


@part("Gap_Regime_Excess", of="regime_Excess_of")
class RegimeExcess:
    """The excess of a joint in a regime, `rank` its place among them; None where it did not move so."""

    joint: Joint = told("located_in_Joint", key=True)
    regime: Regime = told("located_in_Regime", key=True)
    rank: int = told("Rank")
    excess: float | None = told("Gap_Excess")


@part()
class ExcessMap:
    """The excess over the noise floor of each joint (a row of `excess`) in each regime (a column)."""

    joints: tuple[str, ...]
    regimes: tuple[str, ...]
    excess: tuple[Numbers, ...]

    @property
    @tells()
    def cells(self) -> tuple[RegimeExcess, ...]:
        """The map, joint by joint."""
        return tuple(
            RegimeExcess(joint=joint, regime=regime, rank=rank, excess=excess)
            for joint, values in zip(self.joints, self.excess, strict=True)
            for rank, (regime, excess) in enumerate(zip(self.regimes, values, strict=True), start=1)
        )


@dataclass(frozen=True, kw_only=True)
class Followed:
    """A residual (N m or W) against the `variable` that it follows, in bins.

    `x` in the variable's `unit`; `residual`: the mean of a bin, `low` and `high` its quartiles; `fitted`: what the
    effect adds there, None where no effect explains it.
    """

    channel: Channel
    joint: str | None
    effect: str | None
    variable: str
    unit: str
    x: Numbers
    residual: Numbers
    low: Numbers
    high: Numbers
    fitted: Numbers | None


@part("Gap_Run_Change", of="change_of", ranked=True, unit_of="measure", constants=(("Change_Part", "run"),))
class RunError:
    """RMSE of a run that was left out of the fit, without and with the causes, in the measure's unit.

    `of`: "position" of a joint or over all of them, "flange", of its place; None: torque or power, of a joint or robot.
    """

    run: Run = told("change_in_Run")
    joint: Joint | None = told("located_in_Joint")
    before: float | None = told("Change_Before")
    after: float | None = told("Change_After")
    floor: float | None = told("Noise_Floor", column="noise_floor")
    of: str | None = None

    @property
    @tells("Change_Measure")
    def measure(self) -> str:
        """What is measured of it."""
        return f"{self.of or ('power' if self.joint is None else 'torque')}_rmse"


@dataclass(frozen=True, kw_only=True)
class PlannedMotion:
    """The motion of the next experiment: `time` in s; positions `q` of each joint over it, in the joint's unit."""

    time: Numbers
    joints: tuple[str, ...]
    units: tuple[str, ...]
    q: tuple[Numbers, ...]


@dataclass(frozen=True, kw_only=True)
class FarthestApart:
    """The moment of all runs at which a simulator's flange is farthest from the robot's: `time` s of a run.

    Joint positions (n,), rad or m, of the robot, of the simulator `before` and `after` it has the robot's numbers; what
    its flange is off then, m.
    """

    run: str
    time: float
    robot: Known
    before: Known
    after: Known
    off_before: float
    off_after: float


@dataclass(frozen=True)
class FrictionNumber:
    """A parameter of a friction effect, with its 95 % interval."""

    effect: str
    name: str
    value: float
    unit: str
    lower: float
    upper: float


@dataclass(frozen=True, kw_only=True)
class MeasuredFriction:
    """Measured torque less all of a twin that is no friction, in bins of speed: mean, and quartiles `low`, `high`."""

    speed: Known
    torque: Known
    low: Known
    high: Known


@dataclass(frozen=True, kw_only=True)
class FrictionCurve:
    """A joint's friction over the speeds of some runs, in `unit` over `speed_unit`, with its 95 % band `low` to `high`.

    `role`: that of the runs. `measured` is None where no torque was measured.
    """

    joint: str
    role: str
    speed_unit: str
    unit: str
    speed: Known
    torque: Known
    low: Known
    high: Known
    numbers: tuple[FrictionNumber, ...]
    measured: MeasuredFriction | None


@part()
class Curves:
    """All that is drawn; no map where no torque was measured.

    `friction`: of each joint by the twin with its causes, and of those whose friction changed as it was before; None
    where it is not known. `apart`: of a simulator that was played.
    """

    follows: tuple[Followed, ...]
    runs: tuple[RunError, ...] = told()
    heat_map: ExcessMap | None = told(default=None)
    experiment: PlannedMotion | None
    friction: tuple[FrictionCurve, ...] | None = None
    apart: FarthestApart | None = None

    def to_json(self) -> dict[str, Any]:
        """Return the curves as JSON."""
        written: dict[str, Any] = form.to_json(self)
        return written

    @classmethod
    def from_json(cls, given: object) -> Curves:
        """Return the curves that JSON says. Raises InputError, with the place, where it has another form."""
        return form.from_json(cls, given, "curves")
