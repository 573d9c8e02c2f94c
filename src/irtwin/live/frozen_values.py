"""Values that stand still while their times go on, told only where a robot at rest cannot be the reason."""

from __future__ import annotations

from irtwin.live.joint_stream import State
from irtwin.signals.motion import STILL_SPEED

FROZEN = 3.0  # s that every value must have been the same
_LEAST = 20  # states in that time: of a slower source a value may well come three times
_AT_REST = 100  # steps at rest from which it is known whether torque wavers there
_WAVERS = 0.9  # of them, in which it changed


class FrozenValues:
    """Told of each state of a run; says whether its stream is frozen: it sends the same values over and over.

    A robot that stands still may well send the same values: its brakes hold it, its meter is coarse, or it is
    simulated. So frozen is only what says a speed without a change of position, or torque that always wavered before
    when the robot stood, and now is the same to the last bit, and not zero.
    """

    def __init__(self) -> None:
        self._since: float | None = None  # time of the first of equal states
        self._equal = 0  # steps since then
        self._at_rest = self._wavered = 0  # steps before

    def take(self, state: State, before: State, at_rest: bool) -> str | None:
        """Take a state and the one before it; return why its stream is frozen, in words, None where it is not."""
        if not _same(state.values, before.values):
            self._at_rest += at_rest * (1 + self._equal)
            self._wavered += at_rest and not _same((state.of("torque"),), (before.of("torque"),))
            self._since, self._equal = None, 0
            return None
        self._since = before.time if self._since is None else self._since
        self._equal += 1
        if state.time - self._since < FROZEN or self._equal < _LEAST:
            return None
        lasted = f"every value has been the same for {FROZEN:g} s"
        if any(abs(speed) >= STILL_SPEED for speed in state.of("dq")):
            return f"{lasted}, though the speed that is said is not zero"
        wavers = self._at_rest >= _AT_REST and self._wavered >= _WAVERS * self._at_rest
        if wavers and any(torque and torque == torque for torque in state.of("torque")):
            return f"{lasted}, though torque wavered at rest before"
        return None


def _same(first: tuple[tuple[float, ...], ...], second: tuple[tuple[float, ...], ...]) -> bool:
    """Whether all values are the same; what was not said, NaN, is the same as itself."""
    return all(
        a == b or (a != a and b != b)
        for ours, theirs in zip(first, second, strict=True)
        for a, b in zip(ours, theirs, strict=True)
    )
