"""What the gap report says first: the diagnosis in one sentence."""

from __future__ import annotations

from collections.abc import Sequence

from irtwin.report import wording
from irtwin.report.questions import Answers, Row


def sentence(answers: Answers) -> str:
    """Return the verdict in plain words, the largest cause first."""
    diagnosis = answers["diagnosis"].rows[0]
    verdict = wording.local_name(diagnosis["verdict"])
    if verdict == "no_gap":
        return "There is no gap: the twin explains the data down to the noise floor."
    if verdict == "unexplained":
        return f"There is a gap{_where(answers)}, and no effect in the catalogue closes it."
    if verdict == "ambiguous":
        return f"There is a gap{_where(answers)}, and these data cannot tell its causes apart: {_classes(answers)}."
    named: dict[bool, list[str]] = {}  # by whether the twin lacks them, in the order of the largest cause
    for row in answers["causes"].rows:
        named.setdefault(row["scope"] == "missing", []).append(_cause(row, answers))
    text = "; ".join(
        f"the twin lacks {wording.listed(names)}" if missing else _changed(wording.listed(names), diagnosis)
        for missing, names in named.items()
    )
    return f"{text[:1].upper()}{text[1:]}.{_closes(answers)}"


def _changed(named: str, diagnosis: Row) -> str:
    """Say which runs lack the causes: simulated runs never had them, reference runs did not have them yet."""
    if not diagnosis["against_simulator"]:
        return f"{named} changed since the reference runs"
    if diagnosis["referenced"]:
        return f"{named} changed since the reference runs, and the simulator lacks it"
    return f"the simulator lacks {named}"


def effect_name(row: Row, variable: str = "effect") -> str:
    """Return what the ontology calls a row's effect, `label`, or its id; of another variable, `variable_label`."""
    label = row["label" if variable == "effect" else f"{variable}_label"]
    return str(label or wording.local_name(row[variable]).replace("_", " "))


def joints_of(cause: str, answers: Answers) -> list[str]:
    """Return the joints of a cause (its IRI), none for the whole robot."""
    return [row["joint"] for row in answers["cause_joints"].rows if row["cause"] == cause]


def rivals_of(cause: str, answers: Answers) -> list[str]:
    """Return the effects that explain the data as well as a cause (its IRI) does."""
    return [effect_name(row, "rival") for row in answers["rivals"].rows if row["cause"] == cause]


def _cause(row: Row, answers: Answers) -> str:
    joints = joints_of(row["cause"], answers)
    place = f" on {wording.listed(joints)}" if joints else ""
    return f"{effect_name(row)}{place} (confidence {wording.share(row['confidence'])})"


def _class_of(row: Row, answers: Answers) -> list[str]:
    joints = joints_of(row["cause"], answers)
    place = f" on {wording.listed(joints)}" if joints else ""
    return [f"{name}{place}" for name in (effect_name(row), *rivals_of(row["cause"], answers))]


def _classes(answers: Answers) -> str:
    """Return the causes, the largest first, each with the effects that explain the data as well."""
    classes: dict[frozenset[str], list[str]] = {}
    for row in answers["causes"].rows:
        names = _class_of(row, answers)
        classes.setdefault(frozenset(names), names)
    said = [_alternatives(names) for names in classes.values()]
    if len(said) == 1:
        return f"{said[0]} would explain it equally well"
    return "; ".join(
        f"either {one}" if len(names) > 1 else one for one, names in zip(said, classes.values(), strict=True)
    )


def _alternatives(names: Sequence[str]) -> str:
    return " or ".join(filter(None, [", ".join(names[:-1]), *names[-1:]]))


def _where(answers: Answers) -> str:
    first = answers["locations"].first
    if first is None:
        return ""
    of = f" of {first['joint']}" if first["joint"] else ""
    regime = f", mostly in the regime “{first['regime']}”" if first["regime"] else ""
    return f" in the {first['channel']}{of}{regime}"


def _closes(answers: Answers) -> str:
    row = answers["closed"].first
    if row is None:
        return ""
    ends = f" (95 % interval {wording.share(row['lower'])} to {wording.share(row['upper'])})"
    within = "" if row["lower"] is None else ends
    return f" Adding this to the twin closes {wording.share(row['closed'])} of the gap on held-out runs{within}."
