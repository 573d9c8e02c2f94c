"""What the energy report says first: what the robot takes, what a plant could save, and how far to trust it."""

from __future__ import annotations

from collections.abc import Sequence

from irtwin.report import wording
from irtwin.report.questions import Answers, Row, limits

_HOUR = 3600.0  # s
# A twin is judged on data that it never saw; failing that, on what there is, and the page says so.
_TORQUE_PARTS = (("held_out", "on data it never saw"), ("fit", "on the data it was fitted to"))
_ENERGY_PARTS = (
    ("held_out", "of runs it never saw"),
    ("both", "of the part of a run that it never saw"),
    ("fit", "of the runs it was fitted to"),
)


def taken(answers: Answers) -> str:
    """Return what the robot took, and how much that is an hour and a day."""
    totals = answers["totals"].rows[0]
    if not totals["runs"]:
        return "No run of this robot is known yet."
    runs = f"{totals['runs']} run{'s' * (totals['runs'] != 1)} of {wording.duration(totals['duration_s'])}"
    if not totals["runs_with_energy"]:
        return f"What this robot took in {runs} is not known: no power was measured and no twin models it."
    if totals["runs_mechanical"] == totals["runs_with_energy"]:
        worked = wording.energy(totals["energy_j"])
        return (
            f"The joints of this robot did {worked} of mechanical work in {runs}, by its twin. "
            "What that took from the supply is not known: no electrical power was measured."
        )
    if totals["runs_mechanical"]:
        some = totals["runs_mechanical"]
        return f"This robot's energy has no sum over {runs}: of {some} only mechanical work is known, by its twin."
    by = "measured" if totals["runs_with_power"] == totals["runs_with_energy"] else "in part by its twin"
    by = by if totals["runs_with_power"] else "by its twin, as no power was measured"
    sentence = f"This robot took {wording.energy(totals['energy_j'])} in {runs}, {by}"
    if totals["runs_with_energy"] == totals["runs"] and totals["duration_s"]:
        hour = totals["energy_j"] / totals["duration_s"] * _HOUR
        sentence += f": {wording.energy(hour)} for each hour of such work"
    days = answers["energy_per_day"].rows
    logged = sum(day["duration_s"] for day in days)
    if (
        days
        and logged >= limits(answers)["logged_of_day"] * len(days)
        and all(day["day_from"] == "log" for day in days)
    ):
        mean = sum(day["energy_j"] for day in days) / len(days)
        sentence += f", {wording.energy(mean)} on a day with runs"
    return f"{sentence}."


def could_save(answers: Answers) -> str | None:
    """Return in words what switching off while waiting would save, None where that is not known with an interval."""
    row = answers["waiting"].first
    if row is None:
        return None
    saved, lower, upper = map(wording.energy, (row["energy_j"], row["lower_j"], row["upper_j"]))
    return (
        f"It stood still for {wording.share(row['waiting_share'])} of the time. Switched off while it waits, it would "
        f"save up to {saved} (95 % interval {lower} to {upper}), {wording.share(row['share'])} of the energy: its "
        f"standby power is {wording.quantity(row['standby_w'], 'W')}. What starting up again takes is not counted."
    )


def retimed(answers: Answers) -> str | None:
    """Return in words what the other timing that saves most would save; None where none is known to save."""
    rows = [row for row in answers["retimed"].rows if 0 < row["lower_j"] <= row["upper_j"]]
    if not rows:
        return None
    row = max(rows, key=lambda row: float(row["saving_j"]))
    size, unit = wording.energy_unit([row["saving_j"]])
    value, interval = wording.interval(row["saving_j"] / size, row["lower_j"] / size, row["upper_j"] / size)
    share = row["saving_j"] / row["modelled_j"] if row["modelled_j"] else None
    of_it = "" if share is None else f", {wording.part(share)} of what it takes"
    longer = row["times"] > 1 + 1e-9
    how = f"in {wording.given(row['times'])} times its time" if longer else "in the same time"
    waiting = ", where the robot waits after it anyway" if longer else ""
    return (
        f"Timed as {row['plan_name']}, {how}, {row['run_name']} would save {value} {unit} each time (95 % interval "
        f"{interval.replace(' … ', ' to ')} {unit}){of_it}{waiting}."
    )


def made(answers: Answers) -> list[str]:
    """Return in words what a piece of each product took, and a cycle; electrical and mechanical energy apart."""
    sentences = []
    for row in answers["made"].rows:
        source = {"measured": "measured", "modelled": "by the twin"}.get(
            row["energy_from"], "of mechanical work, by the twin"
        )
        product = row["product"]
        for unit, many, joules in (
            ("piece", row["pieces"], row["pieces_j"]),
            ("cycle", row["cycles"], row["cycles_j"]),
        ):
            if many:
                subject = product if product and unit == "piece" else f"{unit} of {product}" if product else unit
                sentences.append(
                    f"Each {subject} took {wording.energy(joules / many)}, {source}: the mean of "
                    f"{wording.decimals(many)} {unit}{'s' * (many != 1)}, waiting within the runs included."
                )
    return sentences


def trust(answers: Answers) -> str:
    """Return how far the twin can be trusted, beside a constant power."""
    sentence = verdict(answers)
    constant = constant_power(answers)
    if constant is None:
        return sentence
    return (
        f"{sentence} A constant power, the mean of the runs that the twin was fitted to, would miss the energy of the "
        f"same runs by {wording.percent(constant['error_percent'])}."
    )


def constant_power(answers: Answers) -> Row | None:
    """Return how a constant power does on the held-out runs that judge the twin; None where others judge it."""
    judged, constant = energy(answers), answers["baseline"].first
    if judged is None or constant is None or judged["part"] != "held_out":
        return None
    return constant if constant["runs"] == judged["runs"] else None


def torque(answers: Answers) -> Row | None:
    """Return how well the twin explains joint torque, None where no torque was measured."""
    return _best(answers["torque_verdict"].rows, _TORQUE_PARTS)


def energy(answers: Answers) -> Row | None:
    """Return how well the twin gives energy, None where no power was measured."""
    return _best(answers["energy_verdict"].rows, _ENERGY_PARTS)


def verdict(answers: Answers) -> str:
    """Return how good the twin is, in one sentence."""
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
