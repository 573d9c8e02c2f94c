"""What a page draws of a diagnosis: curves and maps, too long for rows. Numbers are None where there is none."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from irtwin.document import form
from irtwin.document.document import Channel

Numbers = tuple[float | None, ...]
Known = tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class ExcessMap:
    """The excess over the noise floor of each joint (a row of `excess`) in each regime (a column)."""

    joints: tuple[str, ...]
    regimes: tuple[str, ...]
    excess: tuple[Numbers, ...]


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


@dataclass(frozen=True, kw_only=True)
class RunError:
    """RMSE (N m of a joint, W of the robot) of a run that was left out of the fit, without and with the causes."""

    run: str
    joint: str | None
    before: float | None
    after: float | None
    floor: float | None


@dataclass(frozen=True, kw_only=True)
class PlannedMotion:
    """The motion of the next experiment: `time` in s; positions `q` of each joint over it, in the joint's unit."""

    time: Numbers
    joints: tuple[str, ...]
    units: tuple[str, ...]
    q: tuple[Numbers, ...]


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


@dataclass(frozen=True, kw_only=True)
class Curves:
    """All that is drawn; no map where no torque was measured.

    `friction`: of each joint by the twin with its causes, and of those whose friction changed as it was before; None
    where it is not known.
    """

    follows: tuple[Followed, ...]
    runs: tuple[RunError, ...]
    heat_map: ExcessMap | None = None
    experiment: PlannedMotion | None
    friction: tuple[FrictionCurve, ...] | None = None

    def to_json(self) -> dict[str, Any]:
        """Return the curves as JSON."""
        written: dict[str, Any] = form.to_json(self)
        return written

    @classmethod
    def from_json(cls, given: object) -> Curves:
        """Return the curves that JSON says. Raises InputError, with the place, where it has another form."""
        return form.from_json(cls, given, "curves")
