"""The rows of the experiment that a diagnosis proposes, from its document."""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping, Sequence

from irtwin.document.experiment import Experiment, Programme
from irtwin.storage import experiment_schema as schema
from irtwin.storage.gap_schema import OfDiagnosis


def rows_of_experiment(said: Experiment, linear: Container[str]) -> Iterator[OfDiagnosis]:
    """Yield the rows of an experiment that a diagnosis proposes; positions of the joints `linear` are in m, not rad."""
    programme = said.programme
    yield schema.GapExperiment(
        purpose=said.purpose,
        note=said.note,
        separation_now=said.separation_now,
        expected_separation=said.expected_separation,
        enough=said.separation_that_is_enough,
        kind=programme and programme.kind,
        motion_s=programme and programme.seconds,
        set_up_s=programme and programme.set_up_seconds,
        hold_s=programme and programme.hold_seconds,
        command=programme and programme.command,
    )
    for effect in dict.fromkeys(said.effects):
        yield schema.GapExperimentEffect(effect=effect)
    for number, text in enumerate(said.motions, start=1):
        yield schema.GapExperimentInstruction(number=number, text=text)
    for number, asked in enumerate(said.questions, start=1):
        effect, *rivals = asked.effects
        yield schema.GapExperimentQuestion(
            number=number,
            effect=effect,
            rival=next(iter(rivals), None),
            separation_now=asked.separation_now,
            expected_separation=asked.expected_separation,
            not_imitated_now=asked.not_imitated_now,
            expected_not_imitated=asked.expected_not_imitated,
            visibility_now=asked.visibility_now,
            expected_visibility=asked.expected_visibility,
        )
    for number, one in enumerate(said.considered, start=1):
        yield schema.GapExperimentConsidered(
            number=number,
            kind=one.kind,
            chosen=programme is not None and one.kind == programme.kind,
            whole_s=60.0 * one.minutes,
            expected_separation=one.expected_separation,
        )
    if programme is not None:
        yield from _programme(programme, linear)


def _programme(said: Programme, linear: Container[str]) -> Iterator[OfDiagnosis]:
    for joint in dict.fromkeys(said.joints):
        yield schema.GapExperimentJoint(joint=joint)
    temperatures = said.temperatures or (None,) * len(said.payload_mass)
    for number, (mass, temperature) in enumerate(zip(said.payload_mass, temperatures, strict=True), start=1):
        yield schema.GapExperimentRun(number=number, payload_mass_kg=mass, temperature_degc=temperature)
    yield from _settings("pose", {joint: (value,) for joint, value in (said.pose or {}).items()}, "", linear)
    yield from _settings("speed", said.speeds, "/s", linear)
    yield from _settings("amplitude", said.amplitudes, "", linear)
    yield from _settings("acceleration", said.accelerations, "/s^2", linear)
    yield from _settings("held_pose", said.poses, "", linear)


def _settings(
    kind: str, given: Mapping[str, Sequence[float]] | None, per: str, linear: Container[str]
) -> Iterator[OfDiagnosis]:
    for joint, values in (given or {}).items():
        for number, value in enumerate(values, start=1):
            yield schema.GapExperimentSetting(
                kind=kind,
                joint=joint,
                number=number,
                value=value,
                unit=f"{'m' if joint in linear else 'rad'}{per}",
            )
