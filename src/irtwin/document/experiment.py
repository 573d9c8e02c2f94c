"""What a diagnosis says should be measured next."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from irtwin.document.told import part, tells, told
from irtwin.document.words import Effect, Joint


@part("Experiment_Question", table="gap_experiment_question", of="part_of_Experiment", ranked=True)
class Question:
    """What the experiment tells: one of two rival effects from the other, or whether one effect is there.

    Separations are by how much the other is less likely, in standard deviations of a normal with these odds: now, and
    with the experiment.
    """

    effects: tuple[Effect, ...] = told("asks_about_Effect", "tells_from_Effect", column="effect rival")
    separation_now: float = told("Separation_Now")
    expected_separation: float = told("Separation_Expected")


@part("Experiment_Instruction", table="gap_experiment_instruction", of="part_of_Experiment", ranked=True)
class Instruction:
    """A motion or a test by hand, in words."""

    text: str = told("Instruction")


@part("Experiment_Run", table="gap_experiment_run", of="part_of_Experiment", ranked=True)
class PlannedRun:
    """A run that a programme asks for: its payload, kg, and the joints' temperature, degC, where it matters."""

    payload_mass: float = told("Planned_Payload", column="payload_mass_kg")
    temperature_degc: float | None = told("Planned_Temperature")


@part("Experiment_Setting", table="gap_experiment_setting", of="part_of_Experiment", unit_of="kind")
class Setting:
    """A number to enter at the controller for a joint; `number`: of the step, from 1."""

    kind: str = told("Setting_Kind", key=True)
    joint: Joint = told("setting_of_Joint", key=True)
    number: int = told("Rank", key=True)
    value: float = told("Setting_Value")


@part()
class Course:
    """How a programme runs.

    `joints` that move; `seconds` of motion; `set_up_seconds` beside it; `payload_mass` of each of its motions, kg;
    `taken_off`: the effects that are taken off the robot first.
    """

    kind: str = told("Experiment_Kind")
    joints: tuple[Joint, ...] = told("moves_Joint")
    seconds: float = told("Motion_Time", column="motion_s")
    set_up_seconds: float = told("Set_Up_Time", column="set_up_s")
    payload_mass: tuple[float, ...]
    taken_off: tuple[Effect, ...]


@part()
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
    hold_seconds: float | None = told("Hold_Time", column="hold_s", default=None)
    command: str | None = told("Motion_Command", default=None)
    payload_com: tuple[float, float, float] | None = None
    temperatures: tuple[float, ...] | None = None


@part()
class Programme(Settings, Course):  # in JSON the course comes first
    """The programme that is proposed: how it runs, and what to enter."""

    @property
    @tells()
    def runs(self) -> tuple[PlannedRun, ...]:
        """The runs, one for each payload."""
        temperatures = self.temperatures or (None,) * len(self.payload_mass)
        both = zip(self.payload_mass, temperatures, strict=True)
        return tuple(PlannedRun(payload_mass=mass, temperature_degc=temperature) for mass, temperature in both)

    @property
    @tells()
    def settings(self) -> tuple[Setting, ...]:
        """All that is entered for a joint."""
        return tuple(self._settings())

    def _settings(self) -> Iterator[Setting]:
        pose = {joint: (value,) for joint, value in (self.pose or {}).items()}
        for kind, given in (
            ("pose", pose),
            ("speed", self.speeds),
            ("amplitude", self.amplitudes),
            ("acceleration", self.accelerations),
            ("held_pose", self.poses),
        ):
            for joint, values in (given or {}).items():
                for number, value in enumerate(values, start=1):
                    yield Setting(kind=kind, joint=joint, number=number, value=value)


@dataclass(frozen=True, kw_only=True)
class Considered:
    """A programme that was weighed: how long it takes, and the smallest separation that it would give."""

    kind: str
    minutes: float
    expected_separation: float


@part("Considered_Experiment", table="gap_experiment_considered", of="part_of_Experiment", ranked=True)
class Weighed:
    """What was considered: how long it takes, s, and whether it was chosen."""

    kind: str = told("Experiment_Kind")
    chosen: bool = told("Chosen")
    whole_s: float = told("Whole_Time")
    expected_separation: float = told("Separation_Expected")


@part("Next_Experiment", table="gap_experiment", of="experiment_for")
class Experiment:
    """What to measure next.

    `effects` and `joints` that it is about; `motions` in words; separations as of a question, the smallest over
    its questions; `programme`: None where none helps, or the test is done by hand; `note`: what no programme tells.
    """

    purpose: str = told("Experiment_Purpose")
    effects: tuple[Effect, ...] = told("asks_about_Effect")
    joints: tuple[str, ...]
    motions: tuple[str, ...]
    expected_separation: float | None = told("Separation_Expected")
    separation_now: float | None = told("Separation_Now")
    separation_that_is_enough: float = told("Separation_Enough", column="enough")
    questions: tuple[Question, ...] = told()
    programme: Programme | None = told()
    considered: tuple[Considered, ...]
    note: str | None = told("Experiment_Note")

    @property
    @tells()
    def instructions(self) -> tuple[Instruction, ...]:
        """The motions."""
        return tuple(Instruction(text=text) for text in self.motions)

    @property
    @tells()
    def weighed(self) -> tuple[Weighed, ...]:
        """What was considered."""
        chosen = self.programme and self.programme.kind
        return tuple(
            Weighed(
                kind=programme.kind,
                chosen=programme.kind == chosen,
                whole_s=60.0 * programme.minutes,
                expected_separation=programme.expected_separation,
            )
            for programme in self.considered
        )
