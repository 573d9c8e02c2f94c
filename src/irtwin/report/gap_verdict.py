"""What the gap report says first: the diagnosis in one sentence."""

from __future__ import annotations

from collections.abc import Sequence

from irtwin.report import wording
from irtwin.report.questions import Answers, Row


def sentence(answers: Answers) -> str:
    """Return the verdict in plain words."""
    diagnosis = answers["diagnosis"].rows[0]
    verdict = wording.local_name(diagnosis["verdict"])
    if verdict == "no_gap":
        return "The twin explains the data down to their noise floor: there is no gap to close."
    if verdict == "unexplained":
        return f"There is a gap{_where(answers)}, and no effect of the catalogue closes it."
    if verdict == "ambiguous":
        return f"There is a gap{_where(answers)}, and these data do not tell its causes apart: {_classes(answers)}."
    causes = [_cause(row, answers) for row in answers["causes"].rows]
    lacking = [name for name, scope in causes if scope == "missing"]
    changed = [name for name, scope in causes if scope != "missing"]
    said = [f"the twin lacks {wording.listed(lacking)}"] if lacking else []
    said += [_changed(wording.listed(changed), diagnosis)] if changed else []
    text = "; ".join(said)
    return f"{text[:1].upper()}{text[1:]}{_closes(answers)}."


def _changed(named: str, diagnosis: Row) -> str:
    """Say what tells the observed runs from the others: simulated ones never had it, reference ones had not yet."""
    if not diagnosis["against_simulator"]:
        return f"{named} changed since the reference runs"
    if diagnosis["referenced"]:
        return f"{named} changed since the reference runs, and the simulator lacks it"
    return f"the simulator lacks {named}"


def effect_name(row: Row) -> str:
    """Return an effect as the ontology calls it, or by its id."""
    return str(row["label"] or wording.local_name(row["effect"]).replace("_", " "))


def joints_of(rank: int, answers: Answers) -> list[str]:
    """Return the joints of a cause, none for the whole robot."""
    return [row["joint"] for row in answers["cause_joints"].rows if row["rank"] == rank]


def rivals_of(rank: int, answers: Answers) -> list[str]:
    """Return the effects that explain the data as well as a cause."""
    return [
        str(row["label"] or wording.local_name(row["rival"]).replace("_", " "))
        for row in answers["rivals"].rows
        if row["rank"] == rank
    ]


def _cause(row: Row, answers: Answers) -> tuple[str, str]:
    joints = joints_of(row["rank"], answers)
    place = f" on {wording.listed(joints)}" if joints else ""
    return f"{effect_name(row)}{place} (confidence {wording.share(row['confidence'])})", row["scope"]


def _class_of(row: Row, answers: Answers) -> list[str]:
    joints = joints_of(row["rank"], answers)
    place = f" on {wording.listed(joints)}" if joints else ""
    return [f"{name}{place}" for name in (effect_name(row), *rivals_of(row["rank"], answers))]


def _classes(answers: Answers) -> str:
    """Say which effects stand for one another, a class for each cause; and the causes that stand alone."""
    classes: dict[frozenset[str], list[str]] = {}
    for row in answers["causes"].rows:
        names = _class_of(row, answers)
        classes.setdefault(frozenset(names), names)
    several = [_alternatives(names) for names in classes.values() if len(names) > 1]
    alone = [names[0] for names in classes.values() if len(names) == 1]
    if len(several) == 1 and not alone:
        return f"{several[0]} would explain it equally well"
    said = "; ".join(f"either {one}" for one in several)
    return f"{said}; and besides {wording.listed(alone)}" if alone else said


def _alternatives(names: Sequence[str]) -> str:
    return " or ".join(filter(None, [", ".join(names[:-1]), *names[-1:]]))


def _where(answers: Answers) -> str:
    first = answers["locations"].first
    if first is None:
        return ""
    of = f" of {first['joint']}" if first["joint"] else ""
    regime = f", foremost in the regime “{first['regime']}”" if first["regime"] else ""
    return f" in the {first['channel']}{of}{regime}"


def _closes(answers: Answers) -> str:
    row = answers["closed"].first
    if row is None:
        return ""
    ends = f" (95 % interval {wording.share(row['lower'])} to {wording.share(row['upper'])})"
    within = "" if row["lower"] is None else ends
    return f"; with that in the twin, {wording.share(row['closed'])}{within} of the gap closes on runs held out"
