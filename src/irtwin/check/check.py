"""All checks of a data set, in order, and what can be mended without doubt."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from threadpoolctl import threadpool_limits

from irtwin.check.arrangement import arrangement_findings
from irtwin.check.channels import channel_findings
from irtwin.check.commands import command_findings
from irtwin.check.estimates import estimate_findings
from irtwin.check.gravity import gravity_findings
from irtwin.check.moving import Moving, moving
from irtwin.check.plausibility import plausibility_findings
from irtwin.check.speeds import speed_findings
from irtwin.check.torque import torque_findings, unsigned_findings
from irtwin.errors import InputError
from irtwin.robot.description import Robot
from irtwin.signals.channels import CHANNELS, Signals, columns_of, from_columns
from irtwin.signals.finding import LogFinding
from irtwin.signals.log import DataSet


@dataclass(frozen=True)
class Checked:
    """A data set, mended where that leaves no doubt, and what was found in the one that was given."""

    data_set: DataSet
    findings: tuple[LogFinding, ...]

    @property
    def sound(self) -> bool:
        """Whether nothing has to be cured first."""
        return not any(finding.stops for finding in self.findings)


def check(data_set: DataSet) -> Checked:
    """Look for faults of a log that would be taken for physics."""
    with threadpool_limits(limits=1, user_api="blas"):  # its matrices are small
        findings = _findings(data_set)
    return Checked(_mended(data_set, findings), tuple(findings))


def _findings(data_set: DataSet) -> list[LogFinding]:
    """Return all findings; what would follow from one that stops is not looked for."""
    findings = _by_column(data_set)
    if not data_set.robot.joints:  # a meter's log
        return findings
    findings += command_findings(data_set)
    seen = moving(data_set)
    if seen.runs:
        findings += plausibility_findings(data_set, seen) + unsigned_findings(data_set.robot, seen)
        if not any(finding.stops for finding in findings):
            findings += channel_findings(data_set.robot, seen) + speed_findings(data_set.robot, seen)
        if not any(finding.stops for finding in findings):
            findings += _by_bodies(data_set.robot, seen)
    return findings


def _by_bodies(robot: Robot, seen: Moving) -> list[LogFinding]:
    """Return what bodies and friction say of the torques and positions."""
    arranged = arrangement_findings(robot, seen)
    if any(finding.stops for finding in arranged):
        return arranged
    findings = torque_findings(robot, seen)
    reversed_torques = [finding.channel for finding in findings if finding.fault == "sign" and finding.mended]
    if reversed_torques:  # beside several, the one that is right looks reversed
        arranged = [
            finding for finding in arrangement_findings(robot, seen, reversed_torques)
            if finding.mended and finding.channel not in reversed_torques
        ]  # fmt: skip
    named = {finding.channel for finding in arranged}
    findings = arranged + [finding for finding in findings if finding.channel not in named]
    if any(finding.certain for finding in findings):
        return findings
    return findings + (gravity_findings(robot, seen) or estimate_findings(robot, seen))


def checked(data_set: DataSet) -> Checked:
    """Return what `check` does. Raises InputError by the first finding that has to be cured."""
    result = check(data_set)
    for finding in result.findings:
        if finding.stops:
            file = "" if str(data_set.folder) in finding.say else f"{data_set.folder}: "
            raise InputError(f"{file}{finding.say}")
    return result


def _by_column(data_set: DataSet) -> list[LogFinding]:
    """Return what reading found: one finding a column, of all runs that have it."""
    by_column: dict[tuple[str, str], LogFinding] = {}
    for finding in data_set.findings:
        of_all = finding.channel == CHANNELS["q"].prefix
        for name in CHANNELS["q"].columns(data_set.robot.joint_names) if of_all else (finding.channel,):
            known = by_column.get((finding.fault, name))
            runs = (*known.runs, *finding.runs) if known else finding.runs
            by_column[finding.fault, name] = replace(known or finding, channel=name, runs=runs)
    return list(by_column.values())


def _mended(data_set: DataSet, findings: Sequence[LogFinding]) -> DataSet:
    reversed_torques = {finding.channel for finding in findings if finding.fault == "sign" and finding.mended}
    at_reading = {(finding.fault, finding.channel) for finding in _by_column(data_set)}  # and mended there
    held = {
        finding.channel: round(finding.evidence["samples"])
        for finding in findings
        if finding.fault == "held_samples" and (finding.fault, finding.channel) not in at_reading
    }
    speeds = {channel for finding in findings if finding.mended for channel in finding.channel.split(" <-> ")}
    speeds &= set(CHANNELS["dq"].columns(data_set.robot.joint_names))
    torques = reversed_torques & set(CHANNELS["torque"].columns(data_set.robot.joint_names))
    if not (torques or speeds or held):
        return data_set
    joints = data_set.robot.joint_names

    def mend(signals: Signals) -> Signals:
        columns = columns_of(replace(signals, dq=None if speeds else signals.dq), joints)
        for name in columns.keys() & torques:
            columns[name] = -columns[name]
        for name in columns.keys() & held.keys():
            columns[name] = _joined(signals.time, columns[name], held[name])
        return from_columns(columns, joints)

    return replace(data_set, runs=tuple(replace(run, signals=mend(run.signals)) for run in data_set.runs))


def _joined(time: np.ndarray, values: np.ndarray, pace: int) -> np.ndarray:
    """Return a column held for `pace` samples with straight lines between its updates; what stands longer stays."""
    changes = np.concatenate([[0], np.flatnonzero(np.diff(values)) + 1, [len(values)]])
    updates = np.concatenate([np.arange(start, stop, pace) for start, stop in pairwise(changes.tolist())])
    return np.asarray(np.interp(time, time[updates], values[updates]))
