"""The headline of the energy report: how good the twin is, in one sentence."""

from __future__ import annotations

from collections.abc import Sequence

from irtwin.report import wording
from irtwin.report.questions import Answers, Row, limits

# A twin is judged on data that it never saw; failing that, on what there is, and the page says so.
_TORQUE_PARTS = (("held_out", "on data it never saw"), ("fit", "on the data it was fitted to"))
_ENERGY_PARTS = (
    ("held_out", "of runs it never saw"),
    ("both", "of the part of a run that it never saw"),
    ("fit", "of the runs it was fitted to"),
)


def torque(answers: Answers) -> Row | None:
    """Return how well the twin explains joint torque, None where no torque was measured."""
    return _best(answers["torque_verdict"].rows, _TORQUE_PARTS)


def energy(answers: Answers) -> Row | None:
    """Return how well the twin gives energy, None where no power was measured."""
    return _best(answers["energy_verdict"].rows, _ENERGY_PARTS)


def sentence(answers: Answers) -> str:
    """Return the verdict in plain words."""
    if answers["twin"].first is None:
        return "No twin of this robot has been identified yet. This page shows what was recorded."
    explained, missed = torque(answers), energy(answers)
    if explained and missed:
        return f"The twin {_explains(explained, answers)} and {_misses(missed, answers)}."
    if explained:
        explains = _explains(explained, answers).rstrip(",")
        return f"The twin {explains}. No electrical power was measured, so its energy is not checked."
    if missed:
        return f"The twin {_misses(missed, answers)}. No joint torque was measured, so its torque is not checked."
    return "The twin was identified, but no measurement can check it."


def _explains(judged: Row, answers: Answers) -> str:
    least = limits(answers)["torque_explained"]
    weak = [
        row["joint"]
        for row in answers["torque_fit_per_joint"].rows
        if row["part"] == judged["part"] and row["r_squared"] < least
    ]
    but = f", though little of {wording.listed(weak)}," if weak else ""
    return f"explains {wording.share(judged['r_squared'])} of joint-torque variance {judged['on']}{but}"


def _misses(judged: Row, answers: Answers) -> str:
    error = wording.percent(judged["error_percent"])
    seed = wording.percent(limits(answers)["seed_energy_error"], 3)
    return f"misses the energy {judged['on']} by {error}; the seed paper (Yan et al., 2018) reached {seed}"


def _best(rows: Sequence[Row], parts: Sequence[tuple[str, str]]) -> Row | None:
    """Return the row of the first part that there is, with the data it was judged on in words, `on`."""
    by_part = {row["part"]: row for row in rows}
    return next(({**by_part[part], "on": on} for part, on in parts if part in by_part), None)
