"""What a change saved: measured energy after its day beside that of a baseline model of the runs before it.

Measurement and verification as ISO 50015 and IPMVP (options B and C) ask: the model is the energy for each piece,
cycle or hour before the change, adjusted to the pieces, cycles or hours after it, product by product and payload by
payload.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import scipy

from irtwin.report.questions import Row

FEWEST = 3  # runs of a product and payload on each side: with two, nothing tells scatter from change
_SURE = 0.975  # of a distribution below the upper end of a 95 % interval
_BASES = (("pieces", "piece"), ("cycles", "cycle"), ("time_s", "hour"))  # the first that all runs say counts
_HOUR = 3600.0  # s


@dataclass(frozen=True)
class Verification:
    """What was saved, J, with its 95 % interval: `adjusted_j` is what the runs after would have taken as before.

    unit: what energies were compared for; before, after: how many runs were. Without enough of these nothing else is
    said.
    """

    before: int
    after: int
    unit: str = ""
    adjusted_j: float | None = None
    saved_j: float = 0.0
    half_width_j: float = 0.0

    @property
    def lower_j(self) -> float:
        """Lower end of the interval, J."""
        return self.saved_j - self.half_width_j

    @property
    def upper_j(self) -> float:
        """Upper end of the interval, J."""
        return self.saved_j + self.half_width_j

    @property
    def words(self) -> str:
        """What is to be said of it."""
        if self.adjusted_j is None:
            return "too few runs"
        return "verified" if self.lower_j > 0.0 else "not verified"


def verification(runs: Iterable[Row], day: str, after: str = "", until: str = "~") -> Verification:
    """Hold the runs before a day against those after it; of the day itself neither, for nobody knows its hour.

    A run says `day` (ISO 8601), `energy_j`, `time_s`, `pieces`, `cycles`, `product` and `payload_kg`. Only runs after
    the day `after` and before `until` count, between which nothing else was changed. Products and payloads that either
    side has fewer than FEWEST runs of are left out.
    """
    counted = [run for run in runs if after < run["day"] < until and run["day"] != day]
    alike: dict[object, tuple[list[Row], list[Row]]] = defaultdict(lambda: ([], []))
    for run in counted:
        alike[run["product"], run["payload_kg"]][run["day"] > day].append(run)
    pairs = [sides for sides in alike.values() if min(map(len, sides)) >= FEWEST]
    if not pairs:
        late = sum(run["day"] > day for run in counted)
        return Verification(len(counted) - late, late)
    unit, amount = _basis([run for sides in pairs for side in sides for run in side])
    return _compared(pairs, unit, amount)


def _basis(runs: Sequence[Row]) -> tuple[str, Callable[[Row], float]]:
    """Return what energy is compared for, and how much of it a run has."""
    name, unit = next(basis for basis in _BASES if all((run[basis[0]] or 0.0) > 0.0 for run in runs))
    return unit, lambda run: float(run[name]) / (_HOUR if name == "time_s" else 1.0)


def _compared(pairs: Sequence[tuple[list[Row], list[Row]]], unit: str, amount: Callable[[Row], float]) -> Verification:
    """Add up what each product and payload saved; the interval is Student's, with Welch's degrees of freedom."""
    adjusted = saved = variance = spread = 0.0
    for before, after in pairs:
        made = sum(map(amount, after))
        rate, unsure, freedom = _rate(before, amount)
        new_rate, new_unsure, new_freedom = _rate(after, amount)
        adjusted += made * rate
        saved += made * (rate - new_rate)
        for part, of in ((made**2 * unsure, freedom), (made**2 * new_unsure, new_freedom)):
            variance += part
            spread += part**2 / of
    half = float(scipy.special.stdtrit(variance**2 / spread, _SURE)) * math.sqrt(variance) if spread else 0.0
    early, late = (sum(len(sides[side]) for sides in pairs) for side in (0, 1))
    return Verification(early, late, unit, adjusted, saved, half)


def _rate(runs: Sequence[Row], amount: Callable[[Row], float]) -> tuple[float, float, int]:
    """Return the energy of a unit of what runs made, its variance, and the degrees of freedom of that.

    A run's scatter grows with the root of what it made, as a sum's does.
    """
    total = sum(map(amount, runs))
    rate = sum(run["energy_j"] for run in runs) / total
    squares = sum((run["energy_j"] - rate * amount(run)) ** 2 / amount(run) for run in runs)
    freedom = len(runs) - 1
    return rate, squares / freedom / total, freedom
