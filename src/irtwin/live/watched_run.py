"""A run while it is watched: its newest state, and what still has to go into storage and into the graph."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Self

from pyoxigraph import Quad

from irtwin.errors import InputError
from irtwin.live import live_run
from irtwin.live.frozen_values import FrozenValues
from irtwin.live.joint_stream import State
from irtwin.live.shown import AlarmNews, ShownRuns
from irtwin.live.stream_health import StreamHealth
from irtwin.providers.live_energy import KnownTwin, LiveEnergy
from irtwin.storage.journal import Header, Journal
from irtwin.storage.rows import Tables, Values
from irtwin.storage.schema import LIVE, moment_of
from irtwin.twin.so_far import WatchedStretch

LEAST = 0.2  # s of samples that are worked out at once


@dataclass
class WatchedRun:
    """A run that lasts. `waiting` is for storage; `shown` is what the graph says of it, None where that is unknown."""

    header: Header
    joints: Sequence[str]
    journal: Journal
    fastest: list[float]
    began: float = math.nan
    newest: State | None = None
    speed: Sequence[float] = ()
    acceleration: Sequence[float] = ()
    count: int = 0
    superseded: int = 0
    due: bool = False  # the graph lacks the newest state
    shown_at: float = -math.inf  # by the monotonic clock
    over: bool = False
    waiting: list[State] = field(default_factory=list)
    unworked: list[State] = field(default_factory=list)
    energy: LiveEnergy | None = None
    energy_tables: Tables = field(default_factory=dict)
    worked_at: float = -math.inf  # by the monotonic clock: when the energy was shown last
    health: StreamHealth = field(default_factory=StreamHealth)
    values: FrozenValues = field(default_factory=FrozenValues)
    alarms: AlarmNews = field(default_factory=AlarmNews)
    shown: set[Quad] | None = field(default_factory=set)
    standing_since: float | None = None  # s since 1970; None while a joint moves
    _mapped: dict[str, tuple[list[Values], set[Quad]]] = field(default_factory=dict)
    _stood: float | None = None  # s, of which the alarms are those of `_idle`: once a second is enough
    _idle: set[Quad] = field(default_factory=set)
    _kinds: set[Quad] = field(default_factory=set)  # which it is of stays the same

    @classmethod
    def begun(cls, folder: Path, state: State, joints: Sequence[str], plan: str | None, kind: str) -> Self:
        """Begin a run and its journal in a folder with a state that is still to be taken; `plan`: its run_id.

        kind: what kind of run it is, as `storage.schema` has it.

        Raises InputError where another run of the robot began at the same moment.
        """
        began = datetime.fromtimestamp(state.time, UTC)
        run_id = f"{state.robot_id}.{LIVE}_{began:%Y%m%dT%H%M%S%f}"
        com = state.payload_com or (0.0, 0.0, 0.0)
        header = Header(run_id, state.robot_id, state.payload or 0.0, live_run.columns(joints), com, plan, kind)
        try:
            journal = Journal(folder, header)
        except FileExistsError:
            raise InputError(f"{state.robot_id}: another stream of this robot began at the same moment") from None
        return cls(header, joints, journal, [0.0] * len(joints))

    @property
    def length(self) -> float:
        """Seconds from the first state to the newest."""
        return 0.0 if self.newest is None else self.newest.time - self.began

    def take(self, state: State) -> None:
        """Take the next state, of a later time than the one before."""
        before, speed_before, frozen = self.newest, self.speed, None
        if before is None:
            self.began, self.speed, self.acceleration = state.time, state.of("dq"), (math.nan,) * len(self.joints)
        else:
            step = state.time - before.time
            self.speed = live_run.speed_of(state, before)
            self.acceleration = [(now - was) / step for now, was in zip(self.speed, speed_before, strict=True)]
        self.fastest = [max(top, abs(now)) for top, now in zip(self.fastest, self.speed, strict=True)]
        moves = live_run.moving(self.speed, self.fastest)
        if moves or self.standing_since is None:
            self.standing_since = None if moves else state.time
        if before is not None:
            frozen = self.values.take(state, before, not moves)
        self.newest = state
        self.count += 1
        self.waiting.append(state)
        self.unworked.append(state)
        self.health.good(frozen)

    def tables(self, waited: float) -> Tables:
        """Return the rows of the run as it is now."""
        now = self.newest
        assert now is not None
        newest = now.of("q"), self.speed, self.acceleration, now.of("torque"), now.of("temperature")
        current, counts = "moving" if live_run.moving(self.speed, self.fastest) else "standstill", self.counts(waited)
        tables = live_run.rows(self.header, self.joints, self.began, now.time, self.count, newest, current, counts)
        return live_run.together(tables, self.energy_tables)

    def mapped(self, tables: Tables, shown: ShownRuns) -> set[Quad]:
        """Return the quads of the rows and their alarms; those of tables that are as before are not made again."""
        for table, rows in tables.items():
            if table not in self._mapped or self._mapped[table][0] != rows:
                quads = set(shown.mapper.quads(table, rows))
                if table == "gap_excursion":
                    quads |= shown.alarms(quads) if rows else set()
                if table == "live_state" and (stood := rows[0].get("standing_s")) != self._stood:
                    self._stood, self._idle = stood, set() if stood is None else shown.alarms(quads)
                if table == "run" and not self._kinds:
                    self._kinds = shown.kinds(self.header.run_id, quads)
                self._mapped[table] = rows, quads
        return self._idle.union(self._kinds, *(quads for _, quads in self._mapped.values()))

    def work_out(self, states: Sequence[State], known: KnownTwin | None) -> list[WatchedStretch]:
        """Work out energy and gap from the next states, as far as they go."""
        if self.energy is None:
            of = (self.header.run_id, self.header.robot_id, tuple(self.joints), known)
            self.energy = LiveEnergy(*of, self.header.payload_kg, self.header.payload_com, self.header.kind)
        rows = live_run.journal_rows(states)
        return self.energy.feed(dict(zip(self.header.columns, rows.T, strict=True)), least=LEAST)

    def counts(self, waited: float) -> Values:
        """Return what the graph says of how well it kept up, and how long the robot has been at rest."""
        counts = {"superseded_states": self.superseded, "waited_s": waited, **self.health.said()}
        if self.newest is None or self.standing_since is None:
            return counts
        stood = float(int(self.newest.time - self.standing_since))
        return {**counts, "standing_since": moment_of(self.standing_since), "standing_s": stood}
