"""Robots that are watched: every sample into storage, and each robot's run current in the graph.

A state goes two ways. All are written to the robot's journal, a batch every 0.1 s. The newest of each robot is mapped
by the R2RML documents, and what changed goes into the graph in one transaction; where states come faster than the graph
takes them, the newest wins and the others are counted. Where storage cannot keep up, the source waits, and that too is
counted. Beside that, energy and gap are worked out from all samples, some four times a second, and shown once a second.
A run ends when the watching does, after a minute without a state, or after an hour, and is then a run like any other.
"""

from __future__ import annotations

import threading
import time
from collections import defaultdict, deque
from collections.abc import Callable
from typing import Self

import numpy as np
from pyoxigraph import Quad

from irtwin.announce import Announce
from irtwin.errors import InputError
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.live import live_run
from irtwin.live.broadcast import Broadcast
from irtwin.live.joint_stream import State
from irtwin.live.kept_run import energy_tables, keep, left_by_a_crash
from irtwin.live.known_robots import KnownRobots
from irtwin.live.shown import ShownRuns
from irtwin.live.stream_clock import HOLE, StreamClock, Tick, WrongTime, jump
from irtwin.live.watched_run import WatchedRun
from irtwin.providers.planner import renew
from irtwin.storage.database import Workspace
from irtwin.storage.files import InsidePath, remove
from irtwin.storage.journal import Header, read_journal
from irtwin.storage.rows import Values
from irtwin.storage.schema import LIVE, LIVE_RUN

BATCH = 0.1  # s between two writes to the journals: what a crash loses at most
RUN_SECONDS = 3600.0  # after which a run ends and the next begins
AHEAD = 7200.0  # s by which a state's time may be ahead of the clock: summer time is one hour, and clocks differ
SHOWN_EVERY = 1.0  # s between two energies of a run in the graph
PAUSE = 0.04  # s between two states of a run in the graph at least: readers see two a second
FLUSH = 2.0  # s between two flushes of the graph: readers replay its log, of 60 kB a state
MOST_WAITING = 200_000  # samples held for storage; beyond, the source waits


class LiveTwin:
    """Watches the robots of a workspace; to be used as a context, whose end stores what is left.

    `stored`, `superseded` and `waited` (s) count what became of the states; `announce` is told what one should know.
    `robots`: what the workspace knows of them.
    """

    def __init__(
        self,
        place: Workspace,
        graph: KnowledgeGraph,
        announce: Announce = lambda line: None,
        broadcast: Broadcast | None = None,
        kind: str = LIVE_RUN,
    ) -> None:
        """Begin to watch, after the runs that a crash left were put in order; `broadcast` is told of each state.

        kind: of the runs that begin: REPLAYED_RUN where a log is played, which no total counts.
        """
        self._place, self._announce, self._broadcast = place, announce, broadcast
        self._kind = kind
        self._folder = place.folder / LIVE
        self._graph, self._shown = graph, ShownRuns(place, graph)
        self.robots = KnownRobots(place, announce)
        self.stored = self.superseded = 0
        self.waited = 0.0
        self._waiting = 0
        self._clocks: defaultdict[str, StreamClock] = defaultdict(StreamClock)
        self._runs: dict[str, WatchedRun] = {}
        self._left: list[WatchedRun] = []  # over, but for what waits for storage
        self._due: deque[WatchedRun] = deque()
        self._ended: deque[WatchedRun] = deque()
        self._failure: BaseException | None = None
        self._stop = threading.Event()
        self._lock = threading.RLock()  # of all that the threads share
        self._news = threading.Condition(self._lock)
        self._room = threading.Condition(self._lock)
        self._over = threading.Condition(self._lock)
        self._showing = threading.Lock()  # of the graph's view of runs
        for path, header, samples in left_by_a_crash(self._folder, announce):
            if len(samples):
                self.robots.times.add(header.robot_id, header.run_id, samples[0, 0], samples[-1, 0])
            self._close(path, header, samples, {}, None)
        self._refresh()
        self._shown.prepare()
        work = (self._show_states, self._store_samples, self._work_out, self._close_runs)
        self._threads = [threading.Thread(target=self._guarded, args=(task,), daemon=True) for task in work]
        for thread in self._threads:
            thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def receive(self, state: State) -> None:
        """Take a state. Waits where storage is far behind. Raises InputError for one that comes late, or too early.

        A state more than a minute before or after the newest is held until the next one: where that goes on from it,
        the clock was set, and a new run begins; where that goes on from the run, InputError is raised for the one held.
        A state of a time that another run of the robot covers is refused, too: a log that comes again is stored once,
        and no time is counted twice. So is one that says a plan that its robot has not.
        Raises also what ended the work in the background: a full disk, say.
        """
        if state.time > time.time() + AHEAD:
            self._refuse_ahead(state, state.time - time.time())
        self.robots.plan(state)
        with self._lock:
            if self._waiting >= MOST_WAITING:
                self._wait_for_room()
            self.check()
            if self._stop.is_set():
                raise InputError("watching has ended; not stored")
            clock = self._clocks[state.robot_id]
            tick, set_by = clock.tell(state.time)
            held, run = clock.held, self._runs.get(state.robot_id)
            if tick is Tick.LATE:
                self._refuse_late(state, run, clock)
            clock.held = None
            if set_by is not None:
                self._end_before_jump(state.robot_id, run, clock, set_by)
                if held is not None and abs(set_by) >= HOLE:  # else the clock went back by less, state for state
                    self._go_on(held)
                    held = None
            if tick is Tick.LEAP:
                self._hold(state, clock)
            else:
                self._go_on(state)
            if held is not None:
                reason = f"{state.robot_id}: a state more than {HOLE:g} s away from its neighbours"
                raise WrongTime(reason, held.time - state.time)

    def _refuse_ahead(self, state: State, by: float) -> None:
        with self._lock:
            if (run := self._runs.get(state.robot_id)) is not None:
                run.health.leaps(by)
        raise WrongTime(f"{state.robot_id}: a state more than {AHEAD:g} s ahead of the clock here", by)

    def _refuse_late(self, state: State, run: WatchedRun | None, clock: StreamClock) -> None:
        assert clock.now is not None
        if run is not None:
            run.health.late(state.time, clock.now)
        if state.time == clock.now:
            raise InputError(f"{state.robot_id}: a state of the same time as the one before; not stored")
        raise WrongTime(f"{state.robot_id}: a state that comes late, out of order", clock.now - state.time)

    def _end_before_jump(self, robot_id: str, run: WatchedRun | None, clock: StreamClock, by: float) -> None:
        """End the run whose stream's clock was set, and tell it; a pause of the stream ends it without a word."""
        jumped = None if clock.paused(by) else jump(by)
        if run is not None:
            if jumped is not None:
                run.health.end(jumped)
            self._leave(run)
        if jumped is not None:
            self._announce(f"{self.robots.names[robot_id]}: {jumped}; its run ends, and no time is stored twice")

    def _hold(self, state: State, clock: StreamClock) -> None:
        """Keep a state whose time leaps until the next one comes; one that cannot be stored anyway is refused."""
        assert clock.now is not None
        run = self._runs.get(state.robot_id)
        if run is not None:
            run.health.leaps(state.time - clock.now)
        self._refuse_covered(state)
        clock.held = state

    def _refuse_covered(self, state: State) -> None:
        covering = self.robots.times.run_in(state.robot_id, state.time, state.time)
        run = self._runs.get(state.robot_id)
        if covering is None and run is not None and run.newest is not None:
            covering = run.header.run_id if run.began <= state.time <= run.newest.time else None
        if covering is not None:
            raise InputError(f"{state.robot_id}: the stored run {covering} covers this time; not stored again")

    def _go_on(self, state: State) -> None:
        """Store a state in the run that lasts, or in a new one where another run lies between, or none lasts."""
        run = self._runs.get(state.robot_id)
        since = state.time if run is None or run.newest is None else run.newest.time
        if run is not None and self.robots.times.run_in(state.robot_id, since, state.time) is not None:
            self._leave(run)
            run = None
        self._refuse_covered(state)
        self._take(run or self._begin(state), state)

    def _leave(self, run: WatchedRun) -> None:
        """End a run, but for what waits for storage; its times are taken from now on."""
        assert run.newest is not None
        del self._runs[run.header.robot_id]
        self._left.append(run)
        self.robots.times.add(run.header.robot_id, run.header.run_id, run.began, run.newest.time)

    def _take(self, run: WatchedRun, state: State) -> None:
        was_stale = run.health.stale_since is not None
        run.take(state)
        if was_stale and run.health.stale_since is None:
            self._announce(f"{self.robots.names[state.robot_id]}: the stream flows again")
        if self._broadcast is not None:
            self._broadcast.state(state)
        self._waiting += 1
        if run.due:
            run.superseded += 1
            self.superseded += 1
        self._make_due(run)

    def _make_due(self, run: WatchedRun) -> None:
        if not run.due:
            run.due = True
            self._due.append(run)
            self._news.notify()

    def stop(self) -> None:
        """Store what is left, end all runs, bring the graph up to date. Raises what ended the background work."""
        with self._lock:
            for robot_id, clock in self._clocks.items():
                if clock.held is not None:  # what came last is kept
                    if (run := self._runs.get(robot_id)) is not None:
                        self._leave(run)
                    try:
                        self._go_on(clock.held)
                    except InputError as error:
                        self._announce(str(error))
                    clock.held = None
            self._stop.set()
        self._wake_all()
        for thread in self._threads:
            thread.join()
        self.check()

    def check(self) -> None:
        """Raise what ended the background work, if something did."""
        if self._failure is not None:
            raise self._failure

    def _begin(self, state: State) -> WatchedRun:
        joints = self.robots.joints[state.robot_id]
        run = WatchedRun.begun(self._folder, state, joints, self.robots.plan(state), self._kind)
        self._runs[state.robot_id] = run
        return run

    def _wait_for_room(self) -> None:
        began = time.monotonic()
        if not self.waited:
            self._announce("storage cannot keep up: the source waits (back-pressure); no sample is lost")
        while self._waiting >= MOST_WAITING and not self._stop.is_set():
            self._room.wait(1.0)
        self.waited += time.monotonic() - began

    # To the graph

    def _show_states(self) -> None:
        while True:
            with self._news:
                while not self._due:
                    if self._stop.is_set():
                        return
                    self._news.wait()
                run = self._due.popleft()
            self._stop.wait(max(0.0, run.shown_at + PAUSE - time.monotonic()))
            with self._lock:
                run.due, run.shown_at = False, time.monotonic()
                tables = run.tables(self.waited)
            with self._showing:
                if not run.over:
                    quads = run.mapped(tables, self._shown)
                    self._shown.show(run.header.run_id, run.shown, quads)
                    run.shown = quads
                    for line in run.alarms.news(quads):
                        self._announce(f"{self.robots.names[run.header.robot_id]}: {line}")

    # Energy and gap

    def _work_out(self) -> None:
        pause = BATCH
        while not self._stop.wait(pause):
            began = time.monotonic()
            with self._lock:
                runs = list(self._runs.values())
            for run in runs:
                self._look_at(run)
            pause = max(BATCH, time.monotonic() - began)  # at most half of a core: samples wait, and go faster together

    def _look_at(self, run: WatchedRun) -> None:
        robot_id = run.header.robot_id
        with self._lock:
            states, run.unworked = run.unworked, []
            if run.health.look():
                kept = "its states are stored" if run.health.frozen else "the last good state is kept"
                self._announce(f"{self.robots.names[robot_id]}: stale: {run.health.reason}; {kept}")
                self._make_due(run)
        if states:
            stretches = run.work_out(states, self.robots.twin(robot_id))
            if self._broadcast is not None:
                self._broadcast.stretches(robot_id, stretches)
        now = time.monotonic()
        if run.energy is not None and now - run.worked_at > SHOWN_EVERY:
            tables = energy_tables(run.energy, run.header, run.began)
            with self._lock:
                run.worked_at, run.energy_tables = now, tables
                self._make_due(run)

    # To storage

    def _store_samples(self) -> None:
        stopping = False
        while not stopping or self._runs or self._left:
            stopping = self._stop.wait(BATCH)
            with self._lock:
                batches = [(run, run.waiting) for run in [*self._left, *self._runs.values()] if run.waiting]
                for run, _ in batches:
                    run.waiting = []
            for run, states in batches:
                run.journal.append(live_run.journal_rows(states))
            with self._lock:
                count = sum(len(states) for _, states in batches)
                self.stored += count
                self._waiting -= count
                self._room.notify_all()
                self._end_runs(stopping)
        with self._lock:
            self._over.notify_all()

    def _end_runs(self, all_of_them: bool) -> None:
        for run in list(self._runs.values()):
            if all_of_them or run.length >= RUN_SECONDS:
                self._leave(run)
        ended = [run for run in self._left if not run.waiting]
        if ended:
            self._left = [run for run in self._left if run.waiting]
            self._ended += ended
            self._over.notify_all()

    def _close_runs(self) -> None:
        while True:
            with self._over:
                if not self._ended:
                    if self._failure is not None or (self._stop.is_set() and not (self._runs or self._left)):
                        return
                    self._over.wait(FLUSH)
                ended = list(self._ended)
                self._ended.clear()
            if not ended:
                self._shown.flush()
                continue
            for run in ended:
                with self._showing:
                    run.over = True
                counts = {"superseded_states": run.superseded, "waited_s": self.waited, **run.health.of_end()}
                self._close(run.journal.path, *read_journal(run.journal.path), counts, run.shown)
                run.journal.close()  # last: till then it is nobody's who crashed
            self._refresh()

    def _close(
        self, path: InsidePath, header: Header, samples: np.ndarray, counts: Values, shown: set[Quad] | None
    ) -> None:
        """Make a run of a journal, in the database and in the graph, and drop the journal."""
        if len(samples):
            tables = keep(self._place, header, samples, {**counts, "stream_state": "ended"}, self._announce)
            self._shown.show(header.run_id, shown, self._shown.mapped(header.run_id, tables))
        remove(path)

    def _refresh(self) -> None:
        """Bring the graph up to date with the database; runs that last look again what it shows of them."""
        self._shown.refresh()
        renew(self._place, self._graph, self._shown.refresh)
        with self._showing, self._lock:
            for run in [*self._left, *self._runs.values()]:
                run.shown = None

    def _guarded(self, task: Callable[[], None]) -> None:
        try:
            task()
        except BaseException as error:
            self._failure = self._failure or error
            self._wake_all()

    def _wake_all(self) -> None:
        self._stop.set()
        with self._lock:
            for condition in (self._news, self._room, self._over):
                condition.notify_all()
