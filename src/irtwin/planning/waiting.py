"""What a robot may do while it waits: wait where that costs less, park, close its brakes at once, be switched off."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from irtwin.planning.programme import Section, SectionedMotion
from irtwin.robot.collision import CollisionModel
from irtwin.signals.motion import Motion, trapezoid
from irtwin.twin.price import Figure, balance, saving
from irtwin.twin.twin import Twin

_WORTH = 1.0  # s: of a shorter pause nothing is said
_KEPT = 0.05  # s of a pause that is moved
_POSES, _TRIED = 300, 6  # drawn, and of these, the cheapest to stand at, tried
_BEYOND = 0.5  # rad or m beside where joints go in the programme
_MOVED = 1e-3  # rad or m: of a joint that goes less nobody knows how fast it may
_FASTEST, _HARDEST = 1.875, 5.774  # of a way from rest to rest: speed and acceleration, over their means


@dataclass(frozen=True)
class PauseProposal:
    """What to do in a pause of a cycle, from `begin` on, `seconds` long, and what that saves a cycle, J.

    `takes`: s of the cycle; None: no log shows how long it takes to come back.
    """

    begin: float
    seconds: float
    what: str
    saved: Figure
    takes: float | None


def proposals(twin: Twin, programme: SectionedMotion, off: float | None) -> Iterator[PauseProposal]:
    """Yield what would take less than what the robot does in the pauses of a programme, by more than is unsure.

    Only states that logs have shown: brakes that the twin has, and off with the power that was logged there, `off` W;
    None: none was.
    """
    motion, collisions = programme.motion, CollisionModel(twin.robot)
    for number in np.flatnonzero(programme.are("pause")):
        section = programme.sections[number]
        begin, seconds = float(motion.time[section.first] - motion.time[0]), float(programme.seconds[number])
        if seconds < _WORTH:
            continue
        weights = np.zeros(len(motion.time))
        weights[section.first : section.last + 1] = trapezoid(motion.time[section.first : section.last + 1])
        savings: list[tuple[str, Figure, float | None]] = [
            _elsewhere(twin, programme, int(number)),
            _parked(twin, motion, section, collisions),
        ]
        if twin.stack.drives_on(motion) is not None:
            held = _held(motion, section.first, seconds)
            closed = balance(twin, (motion, weights), (held, -trapezoid(held.time)))
            savings.append(("close the brakes at once", closed, None))
        if off is not None:
            taken = balance(twin, (motion, weights))
            savings.append(("switch off", Figure(taken.value - off * seconds, taken.half_width), None))
        for action, saved, takes in savings:
            if saved.value > (saved.half_width or 0.0):
                yield PauseProposal(begin, seconds, action, saved, takes)


def _elsewhere(twin: Twin, programme: SectionedMotion, number: int) -> tuple[str, Figure, float]:
    """Return what it saves to wait at the pose of the pause of the programme where that costs least."""
    motion, pauses = programme.motion, np.flatnonzero(programme.are("pause"))
    spare = float(programme.seconds[number]) - _KEPT

    def moved(other: int) -> Motion:
        factors = np.ones(len(programme.sections))
        factors[number] = _KEPT / programme.seconds[number]
        factors[other] += spare / programme.seconds[other]
        return programme.retimed(factors)

    if len(pauses) == 1:
        return "", Figure(0.0, None), 0.0
    best = min((int(other) for other in pauses if other != number), key=lambda other: twin.energy(moved(other)))
    at = motion.time[programme.sections[best].first] - motion.time[0]
    return f"wait where it stands at {at:.2f} s", saving(twin, moved(best), motion), 0.0


def _parked(twin: Twin, motion: Motion, section: Section, collisions: CollisionModel) -> tuple[str, Figure, float]:
    """Return what it saves to go, in a pause, to a pose where the programme does not stand, and back in time.

    Joints go as fast as they do in the programme, and by no more torque than that or their limits.
    """
    own = slice(section.first, section.last + 1)
    joints, best, saved = twin.robot.joints, "", Figure(0.0, None)
    most = np.maximum([joint.effort for joint in joints], np.abs(twin.joint_torque(motion)).max(axis=0))
    for away, lasts in _cheap_poses(twin, motion, own):
        tried = _by_way_of(motion, own, away, lasts)
        meeting, _ = collisions.first_meeting(tried.time[own], tried.q[own])
        if meeting is not None or (np.abs(twin.joint_torque(tried)) > most).any():
            continue
        better = saving(twin, tried, motion)
        if better.value > saved.value:
            angles = zip(joints, motion.q[section.first] + away, strict=True)
            best = "park at " + ", ".join(f"{joint.name} {angle:.2f} {joint.unit}" for joint, angle in angles)
            saved = better
    return best, saved, 0.0


def _cheap_poses(twin: Twin, motion: Motion, own: slice) -> Iterator[tuple[np.ndarray, float]]:
    """Yield, cheapest first, drawn poses where standing takes less than in the pause: how far away, (n,), and s."""
    time, today = motion.time[own], motion.q[own][0]
    limits = np.array([(joint.lower, joint.upper) for joint in twin.robot.joints]).T
    lower, upper = np.clip([motion.q.min(axis=0) - _BEYOND, motion.q.max(axis=0) + _BEYOND], *limits)
    drawn = np.random.default_rng(0).uniform(lower, upper, (_POSES, len(today)))
    moved = np.ptp(motion.q, axis=0) > _MOVED
    if not moved.any():
        return
    away = np.where(moved, drawn - today, 0.0)
    way = np.abs(away[:, moved])
    speed, acceleration = (np.abs(values).max(axis=0)[moved] for values in (motion.dq, motion.ddq))
    lasts = np.maximum(_FASTEST * way / speed, np.sqrt(_HARDEST * way / acceleration)).max(axis=1)
    still = motion.moved(np.arange(_POSES) / motion.rate, today + away, 0 * away, 0 * away)
    gained = (twin.power(motion)[own].mean() - twin.power(still)) * (time[-1] - time[0] - _KEPT - 2 * lasts)
    for pose in np.argsort(-gained)[:_TRIED]:
        if gained[pose] > 0 and 2 * lasts[pose] < time[-1] - time[0] - _KEPT:
            yield away[pose], float(lasts[pose])


def _by_way_of(motion: Motion, own: slice, away: np.ndarray, lasts: float) -> Motion:
    """Return a motion that in samples of its own goes so far away, (n,), and back, each in some s, resting between."""
    time = motion.time[own]
    there, back = (np.clip(since / lasts, 0, 1) for since in (time - time[0], time[-1] - time))
    way = np.polynomial.Polynomial([0, 0, 0, 10, -15, 6])
    pace, change = way.deriv(), way.deriv(2)
    q, dq, ddq = (values.copy() for values in (motion.q, motion.dq, motion.ddq))
    q[own] += np.outer(way(there) + way(back) - 1, away)
    dq[own] += np.outer(pace(there) - pace(back), away) / lasts
    ddq[own] += np.outer(change(there) + change(back), away) / lasts**2
    return motion.moved(motion.time, q, dq, ddq)


def _held(motion: Motion, sample: int, seconds: float) -> Motion:
    """Return standing at the pose of a sample for so many seconds, with brakes closed if there are any."""
    count = max(2, round(seconds * motion.rate) + 1)
    q = np.repeat(motion.q[sample : sample + 1], count, axis=0)
    still = np.zeros_like(q)
    return motion.moved(np.linspace(0.0, seconds, count), q, still, still)
