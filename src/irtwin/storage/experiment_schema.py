"""The tables of the experiment that a diagnosis proposes; numbers count from 1 in the order of its document."""

from __future__ import annotations

from sqlalchemy.orm import Mapped, mapped_column

from irtwin.storage.gap_schema import OfDiagnosis


class GapExperiment(OfDiagnosis):
    """What to measure next, so that rivals come apart; what is said of a programme is none where none is proposed.

    Separations are in standard deviations of the residual.
    """

    __tablename__ = "gap_experiment"

    purpose: Mapped[str]  # effects by their ids
    note: Mapped[str | None]
    separation_now: Mapped[float | None]
    expected_separation: Mapped[float | None]
    enough: Mapped[float]  # separation that decides a question
    kind: Mapped[str | None]  # of the programme
    motion_s: Mapped[float | None]
    set_up_s: Mapped[float | None]
    hold_s: Mapped[float | None]  # of each pose, where poses are held
    command: Mapped[str | None]  # that computes the motion


class GapExperimentEffect(OfDiagnosis):
    """An effect that the experiment is about."""

    __tablename__ = "gap_experiment_effect"

    effect: Mapped[str] = mapped_column(primary_key=True)


class GapExperimentJoint(OfDiagnosis):
    """A joint that the programme moves."""

    __tablename__ = "gap_experiment_joint"

    joint: Mapped[str] = mapped_column(primary_key=True)
    robot_id: Mapped[str]


class GapExperimentInstruction(OfDiagnosis):
    """A motion or a test by hand, in words."""

    __tablename__ = "gap_experiment_instruction"

    number: Mapped[int] = mapped_column(primary_key=True)
    text: Mapped[str]


class GapExperimentRun(OfDiagnosis):
    """A run that the programme asks for."""

    __tablename__ = "gap_experiment_run"

    number: Mapped[int] = mapped_column(primary_key=True)
    payload_mass_kg: Mapped[float]
    temperature_degc: Mapped[float | None]  # of the joints, where it matters


class GapExperimentSetting(OfDiagnosis):
    """A number to enter at the controller for a joint."""

    __tablename__ = "gap_experiment_setting"

    kind: Mapped[str] = mapped_column(primary_key=True)  # "pose", "speed", "amplitude", "acceleration", "held_pose"
    joint: Mapped[str] = mapped_column(primary_key=True)
    number: Mapped[int] = mapped_column(primary_key=True)  # of the step
    robot_id: Mapped[str]
    value: Mapped[float]
    unit: Mapped[str]


class GapExperimentQuestion(OfDiagnosis):
    """Which of two effects it is, or whether one is there (rival none); how far the experiment answers that."""

    __tablename__ = "gap_experiment_question"

    number: Mapped[int] = mapped_column(primary_key=True)
    effect: Mapped[str]
    rival: Mapped[str | None]
    separation_now: Mapped[float]
    expected_separation: Mapped[float]
    not_imitated_now: Mapped[float | None]  # of rivals: share of one that the other cannot imitate
    expected_not_imitated: Mapped[float | None]
    visibility_now: Mapped[float | None]  # of one effect: its mean square in units of the noise's
    expected_visibility: Mapped[float | None]


class GapExperimentConsidered(OfDiagnosis):
    """A programme that was weighed."""

    __tablename__ = "gap_experiment_considered"

    number: Mapped[int] = mapped_column(primary_key=True)
    kind: Mapped[str]
    chosen: Mapped[bool]
    whole_s: Mapped[float]  # with the set-up
    expected_separation: Mapped[float]  # the smallest over its questions
