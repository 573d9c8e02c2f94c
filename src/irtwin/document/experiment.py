"""What a diagnosis says should be measured next."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Question:
    """What the experiment tells: one of two rival effects from the other, or whether one effect is there.

    Separations are in standard deviations of the residual: of the data there are, and with the experiment.
    `not_imitated_now`, `expected_not_imitated`: of rivals, the share (0 to 1) of one that the other cannot imitate, in
    the data and in the experiment. `visibility_now`, `expected_visibility`: of one effect, its mean square in units of
    the noise's, in the data and with the experiment.
    """

    effects: tuple[str, ...]
    separation_now: float
    expected_separation: float
    not_imitated_now: float | None = None
    expected_not_imitated: float | None = None
    visibility_now: float | None = None
    expected_visibility: float | None = None


@dataclass(frozen=True, kw_only=True)
class Course:
    """How a programme runs.

    `joints` that move; `seconds` of motion; `set_up_seconds` beside it; `payload_mass` of each of its motions, kg;
    `taken_off`: the effects that are taken off the robot first.
    """

    kind: str
    joints: tuple[str, ...]
    seconds: float
    set_up_seconds: float
    payload_mass: tuple[float, ...]
    taken_off: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class Settings:
    """What to enter at the controller, each where the programme needs it; joints by their names.

    `pose` of every joint, rad (m); `speeds` rad/s (m/s), `amplitudes` rad (m) and `accelerations` rad/s² (m/s²) of each
    joint that moves, step by step; `poses`: positions to hold, rad (m), `hold_seconds` each; `command`: what computes
    the motion; `payload_com`: the load's centre of mass from the flange, m; `temperatures` of the joints in each of
    the motions, degC.
    """

    pose: Mapping[str, float] | None = None
    speeds: Mapping[str, tuple[float, ...]] | None = None
    amplitudes: Mapping[str, tuple[float, ...]] | None = None
    accelerations: Mapping[str, tuple[float, ...]] | None = None
    poses: Mapping[str, tuple[float, ...]] | None = None
    hold_seconds: float | None = None
    command: str | None = None
    payload_com: tuple[float, float, float] | None = None
    temperatures: tuple[float, ...] | None = None


@dataclass(frozen=True, kw_only=True)
class Programme(Settings, Course):  # in JSON the course comes first
    """The programme that is proposed: how it runs, and what to enter."""


@dataclass(frozen=True, kw_only=True)
class Considered:
    """A programme that was weighed: how long it takes, and the smallest separation that it would give."""

    kind: str
    minutes: float
    expected_separation: float


@dataclass(frozen=True, kw_only=True)
class Experiment:
    """What to measure next.

    `effects` and `joints` that it is about; `motions` in words; separations in standard deviations, the smallest over
    its questions; `programme`: None where none helps, or the test is done by hand; `note`: what no programme tells.
    """

    purpose: str
    effects: tuple[str, ...]
    joints: tuple[str, ...]
    motions: tuple[str, ...]
    expected_separation: float | None
    separation_now: float | None
    separation_that_is_enough: float
    questions: tuple[Question, ...]
    programme: Programme | None
    considered: tuple[Considered, ...]
    note: str | None
