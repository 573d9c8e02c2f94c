"""A stretch of a run that stands out: a contact, a load or a dropout may be there."""

from __future__ import annotations

from collections.abc import Sequence

from irtwin.document.told import part, tells, told
from irtwin.document.words import Joint, Run

_NAMED = 3  # in words


@part("Odd_Stretch", table="gap_odd_stretch", of="odd_stretch_of", ranked=True)
class OddStretch:
    """A stretch of a run, s, of which the twin leaves far more of some joints' torque than of the rest of the runs."""

    run: Run = told("odd_in_Run")
    start: float = told("Stretch_Start")
    stop: float = told("Stretch_End")
    joints: tuple[Joint, ...] = told("odd_at_Joint")

    @property
    @tells(key=True)
    def stretch_id(self) -> str:
        """Its name: a run has one stretch that begins then."""
        return f"{self.run}:{self.start:g}"

    @property
    def place(self) -> str:
        """Where it is, in words."""
        return f"{self.run} from {self.start:.1f} to {self.stop:.1f} s ({', '.join(self.joints)})"


def odd(stretches: Sequence[OddStretch]) -> str:
    """Return the places of stretches in words; of many, how many more there are; nothing where there are none."""
    more = len(stretches) - _NAMED
    places = [stretch.place for stretch in stretches[:_NAMED]] + ([f"and {more} more"] if more > 0 else [])
    return "; ".join(places)
