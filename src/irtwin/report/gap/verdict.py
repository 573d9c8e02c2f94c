"""What the gap report says first: the diagnosis in one sentence."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import groupby

from irtwin.document.document import LIKELY
from irtwin.document.odd_stretch import OddStretch
from irtwin.report import wording
from irtwin.report.gap import findings
from irtwin.report.gap.findings import ToldFinding
from irtwin.report.questions import Answers, Row, effect_name

_MOSTLY = 0.5  # share of a gap
_FAR = 2.0  # noise floors: a twin that leaves more does not explain the data down to it


def sentence(answers: Answers) -> str:
    """Return the verdict in plain words, the largest finding first."""
    judged = answers["diagnosis"].rows[0]
    place, closed = answers["locations"].first, answers["closed"].first
    ends = None if closed is None else _ends(closed)
    played = judged["tracking_error"] is not None
    likely = {cause["cause"] for cause in answers["causes"].rows if cause["told"] and cause["confidence"] >= LIKELY}
    numbers = findings.other_numbers([
        (*(number[of] for of in ("name", "joint", "simulator", "robot", "unit")), _ends(number))
        for number in answers["cause_parameters"].rows
        if number["simulator"] is not None and number["cause"] in likely
    ])  # fmt: skip
    words = findings.sentence(
        wording.local_name(judged["verdict"]),
        told(answers),
        "" if place is None else where(place["channel"], place["joint"], place["regime"], place["share"]),
        None if closed is None else closes(closed["closed"], ends, _against(judged), played=played),
        judged["reason"] and wording.local_name(judged["reason"]),
        differing([
            (disturbance["kind"], disturbance["channel"], disturbance["joint"])
            for disturbance in answers["disturbances"].rows
            if not disturbance["cause"]
        ]),
        judged["floor_from"] is not None,
        agrees(_against(judged), judged["tracking_error"], judged["torque_error"]),
        left([(size["joint"], size["excess"]) for size in answers["sizes"].rows], since=judged["against_reference"]),
    )  # fmt: skip
    return numbers + words + findings.look_at(wording.local_name(judged["verdict"]), _odd_stretches(answers))


def _ends(row: Row) -> tuple[float, float] | None:
    return None if row["lower"] is None else (row["lower"], row["upper"])


def _odd_stretches(answers: Answers) -> list[OddStretch]:
    rows = groupby(answers["odd_stretches"].rows, key=lambda row: (row["rank"], row["run"], row["start"], row["end"]))
    return [
        OddStretch(run=run, start=start, stop=end, joints=tuple(row["joint"] for row in own))
        for (_, run, start, end), own in rows
    ]


def told(answers: Answers) -> list[ToldFinding]:
    """Return the findings, the largest first."""
    return [_finding(row, answers) for row in answers["findings"].rows]


def _finding(row: Row, answers: Answers) -> ToldFinding:
    name = row["finding"]
    members: dict[str, list[tuple[str, float]]] = {}
    for member in answers["finding_members"].rows:
        if member["finding"] == name:
            members.setdefault(member["cause"], []).append((effect_name(member), member["confidence"]))
    return ToldFinding(
        family=row["family_label"] or wording.local_name(row["family"]),
        joints=tuple(joint["joint"] for joint in answers["finding_joints"].rows if joint["finding"] == name),
        against="twin" if row["scope"] == "missing" else _against(answers["diagnosis"].rows[0]),
        channel=row["channel"],
        confidence=row["confidence"],
        share=row["share"],
        interval=(row["lower"], row["upper"]),
        of=row["of"],
        matters=row["matters"],
        members=tuple(map(tuple, members.values())),
    )


def _against(diagnosis: Row) -> str:
    """Return which runs lack what changed: simulated runs never had it, reference runs did not have it yet."""
    return "simulated" if diagnosis["against_simulator"] else "reference"


def where(channel: str, joint: str | None, regime: str | None = None, share: float = 0.0) -> str:
    """Say where a gap lies: of the channel's, this regime of the joint has this share."""
    of = f" of {joint}" if joint else ""
    return f" in the {channel}{of}" + (f", mostly in the regime “{regime}”" if regime and share >= _MOSTLY else "")


def differing(unexplained: Sequence[tuple[str, str, str | None]]) -> str:
    """Say by what runs of one motion differ: kind, channel and joint of each, the largest first; may be empty."""
    if not unexplained:
        return ""
    kind, channel, joint = unexplained[0]
    more = len(unexplained) - 1
    words = f"{findings.NOT_REPEATING[kind]}{where(channel, joint)}"
    return words if not more else f"{words}, and by {more} thing{'s' if more > 1 else ''} more"


def closes(share: float, interval: Sequence[float] | None, against: str | None, *, played: bool) -> str:
    """Say how much of a gap closes, `against` the role of what runs are held against; `played`: of tracking error."""
    within = "" if interval is None else f" {findings.within(interval)}"
    if played:
        closed = f"{wording.part(share)} of the mean square of its tracking error"
        return f" The robot’s numbers in the simulator close {closed} on held-out runs{within}."
    adding, gap = ("simulator", "its gap to the robot") if against == "simulated" else ("twin", "the gap")
    return f" Adding this to the {adding} closes {wording.part(share)} of {gap} on held-out runs{within}."


def agrees(against: str | None, tracking: float | None, torque: float | None) -> str | None:
    """Say how far a simulator agrees with the robot, where that is what the robot is held against.

    `tracking`, rad: where it was told the robot's commands; `torque`, N m: else, what the twin leaves of both sides.
    """
    if tracking is not None:
        return f"to {1e3 * tracking:.3g} mrad RMS"
    if torque is None or against != "simulated":
        return None
    return f"beside the {torque:.3g} N m RMS that no effect explains"


def left(sizes: Sequence[tuple[str | None, float | None]], *, since: bool) -> str | None:
    """Say what a twin leaves that is no gap, where it is far more than noise; `sizes`: joint and excess of places.

    `since`: whether reference runs show it too; else it is dry friction near zero speed.
    """
    known = ((excess, joint or "the robot") for joint, excess in sizes if excess is not None)
    most, joint = max(known, default=(0.0, ""))
    floors = math.sqrt(max(1 + most, 0.0))
    if floors < _FAR:
        return None
    much = f"{wording.number(floors)} times the noise floor at {joint}"
    if since:
        return f"Nothing changed since the reference runs. Of these, too, the twin leaves {much}."
    turning = "how dry friction changes where a joint turns back is not known"
    return f"There is no gap away from reversals. With them the twin leaves {much}: {turning}."
