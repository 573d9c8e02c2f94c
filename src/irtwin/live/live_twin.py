"""Robots that are watched: every sample into storage, and each robot's run current in the graph.

A state goes two ways. All are written to the robot's journal, a batch every 0.1 s. The newest of each robot is mapped
by the R2RML documents, and what changed goes into the graph in one transaction; where states come faster than the graph
takes them, the newest wins and the others are counted. Where storage cannot keep up, the source waits, and that too is
counted. A run ends when the watching does, after a minute without a state,
or after an hour, and is then a run like any other.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Self, cast

from pyoxigraph import NamedNode, Quad, QuerySolutions
from sqlalchemy import select

from irtwin import resources
from irtwin.errors import InputError
from irtwin.knowledge.mapping import RowMapper, refresh
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_ACTIVITY, GRAPH_SOURCE
from irtwin.live import live_run
from irtwin.live.joint_stream import State
from irtwin.live.stored_times import StoredTimes
from irtwin.live.watched_run import HOLE, WatchedRun
from irtwin.providers.records import run_iri
from irtwin.storage.database import Workspace
from irtwin.storage.journal import DamagedJournal, Header, Journal, left_behind, read_journal
from irtwin.storage.schema import LIVE, Joint, Robot, Run

BATCH = 0.1  # s between two writes to the journals: what a crash loses at most
RUN_SECONDS = 3600.0  # after which a run ends and the next begins
AHEAD = 3600.0  # s by which a state's time may be ahead of the clock: clocks differ, years do not
MOST_WAITING = 200_000  # samples held for storage; beyond, the source waits


class LiveTwin:
    """Watches the robots of a workspace; to be used as a context, whose end stores what is left.

    `stored`, `superseded` and `waited` (s) count what became of the states; `announce` is told what one should know.
    `joints`: names of a robot's joints, base to flange, and `names` of the robots, by robot_id.
    """

    def __init__(
        self, place: Workspace, graph: KnowledgeGraph, announce: Callable[[str], None] = lambda line: None
    ) -> None:
        """Begin to watch, after the runs that a crash left were put in order."""
        self._place, self._graph, self._announce = place, graph, announce
        self._folder = place.folder / LIVE
        self._documents = sorted(resources.folder("mappings").glob("*.r2rml.ttl"))
        self._mapper = RowMapper(place.engine, self._documents)
        self.joints, self.names = _joints(place), _names(place)
        self.stored = self.superseded = 0
        self.waited = 0.0
        self._waiting = 0
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
        self._times = StoredTimes(place)
        self._recover()
        self._refresh()
        work = (self._show_states, self._store_samples, self._close_runs)
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
        a new run began; where that goes on from the run, InputError is raised for the one held.
        A state of a time that a stored run of the robot covers is refused, too: a log that comes again is stored once.
        Raises also what ended the work in the background: a full disk, say.
        """
        if state.time > time.time() + AHEAD:
            raise InputError(f"{state.robot_id}: a state more than {AHEAD:g} s ahead of the clock here; not stored")
        with self._lock:
            if self._waiting >= MOST_WAITING:
                self._wait_for_room()
            self.check()
            if self._stop.is_set():
                raise InputError("watching has ended; not stored")
            if (stored := self._times.run_at(state.robot_id, state.time)) is not None:
                raise InputError(f"{state.robot_id}: the stored run {stored} covers this time; not stored again")
            run = self._runs.get(state.robot_id) or self._begin(state)
            is_next = run.is_next(state)
            doubted, run.doubted = run.doubted, None
            if is_next:
                self._take(run, state)
            elif doubted is not None and state.time > doubted.time:
                run.doubted = doubted
                run = self._begin_again(run)
                if run.is_next(state):
                    self._take(run, state)
                else:
                    run.doubted = state
                return
            else:
                run.doubted = state
            if doubted is not None:
                raise InputError(f"{state.robot_id}: a state more than {HOLE:g} s away from its neighbours; not stored")

    def _take(self, run: WatchedRun, state: State) -> None:
        run.take(state)
        self._waiting += 1
        if run.due:
            run.superseded += 1
            self.superseded += 1
        else:
            run.due = True
            self._due.append(run)
            self._news.notify()

    def _begin_again(self, run: WatchedRun) -> WatchedRun:
        """End a run whose next state leaps; return the one that begins with that state."""
        state = run.doubted
        assert state is not None
        run.doubted = None
        following = self._begin(state)
        self._left.append(run)
        self._take(following, state)
        return following

    def stop(self) -> None:
        """Store what is left, end all runs, bring the graph up to date. Raises what ended the background work."""
        with self._lock:
            for run in [run for run in self._runs.values() if run.doubted is not None]:
                try:
                    self._begin_again(run)
                except InputError as error:
                    self._announce(str(error))
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
        robot_id, joints = state.robot_id, self.joints[state.robot_id]
        began = datetime.fromtimestamp(state.time, UTC)
        run_id = f"{robot_id}.{LIVE}_{began:%Y%m%dT%H%M%S%f}"
        header = Header(run_id, robot_id, state.payload or 0.0, live_run.columns(joints))
        try:
            journal = Journal(self._folder, header)
        except FileExistsError:
            raise InputError(f"{robot_id}: another stream of this robot began at the same moment") from None
        self._runs[robot_id] = WatchedRun(header, joints, journal, [0.0] * len(joints))
        return self._runs[robot_id]

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
                run.due = False
                tables = run.tables(self.waited)
            with self._showing:
                if not run.over:
                    quads = run.mapped(tables, self._mapper)
                    self._show(run.header.run_id, run.shown, quads)
                    run.shown = quads

    def _show(self, run_id: str, shown: set[Quad] | None, quads: set[Quad]) -> None:
        """Bring the graph from what it shows of a run, None where that is unknown, to the quads."""
        if shown is None:
            shown = self._quads_of(run_id)
        self._graph.change(shown - quads, quads - shown)

    def _quads_of(self, run_id: str) -> set[Quad]:
        """Return what the graph says of a live run."""
        run, activity = NamedNode(run_iri(run_id)), NamedNode(f"{GRAPH_ACTIVITY}{LIVE}.{run_id}")
        found = self._graph.answer(
            f"""SELECT ?g ?s ?p ?o {{
              {{ BIND({activity} AS ?g) GRAPH {activity} {{ ?s ?p ?o }} }} UNION
              {{ GRAPH ?g {{ {run} ?p ?o }} BIND({run} AS ?s)
                 FILTER(STRSTARTS(STR(?g), "{GRAPH_SOURCE}") && ?p != irt:has_Series) }} }}"""
        )
        return {Quad(row["s"], row["p"], row["o"], row["g"]) for row in cast(QuerySolutions, found)}

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
        for robot_id, run in list(self._runs.items()):
            if run.doubted is None and (all_of_them or run.length >= RUN_SECONDS):
                self._left.append(self._runs.pop(robot_id))
        ended = [run for run in self._left if not run.waiting]
        if ended:
            self._left = [run for run in self._left if run.waiting]
            self._ended += ended
            self._over.notify_all()

    def _close_runs(self) -> None:
        while True:
            with self._over:
                while not self._ended:
                    if self._failure is not None or (self._stop.is_set() and not (self._runs or self._left)):
                        return
                    self._over.wait(1.0)
                ended = list(self._ended)
                self._ended.clear()
            for run in ended:
                with self._showing:
                    run.over = True
                run.journal.close()
                self._close(run.journal.path, run.counts(self.waited), run.shown)
            self._refresh()

    def _close(self, path: Path, counts: live_run.Values, shown: set[Quad] | None) -> None:
        """Make a run of a journal, in the database and in the graph, and drop the journal."""
        header, samples = read_journal(path)
        if len(samples):
            tables, series = live_run.closed_rows(header, samples, counts)
            with self._place.reading() as session:
                kept = session.get(Run, header.run_id) is not None
            if not kept:  # else the crash came right here
                run, activity, made = live_run.records(tables)
                self._place.keep_live_run(run, series, activity, made)
                with self._lock:
                    self._times.add(header.robot_id, header.run_id, samples[0, 0], samples[-1, 0])
            self._show(header.run_id, shown, {quad for it in tables.items() for quad in self._mapper.quads(*it)})
        path.unlink()

    def _recover(self) -> None:
        for path in left_behind(self._folder):
            try:
                header, samples = read_journal(path)
            except DamagedJournal as error:
                aside = path.with_suffix(".damaged")
                path.rename(aside)
                self._announce(f"{error}; its samples are not in the graph; the file is kept as {aside}")
                continue
            except ValueError:
                self._announce(f"{path}: a crash ended this journal before its first sample; it is deleted")
                path.unlink()
                continue
            self._announce(f"{header.run_id}: a crash ended this run; its {len(samples)} samples on disk are kept")
            self._close(path, {}, None)

    def _refresh(self) -> None:
        """Bring the graph up to date with the database; runs that last look again what it shows of them."""
        refresh(self._graph, self._place.engine, self._documents, self._place.mapped_rows)
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


def _joints(place: Workspace) -> dict[str, list[str]]:
    joints: dict[str, list[str]] = {}
    with place.reading() as session:
        for robot_id, name in session.execute(select(Joint.robot_id, Joint.name).order_by(Joint.position)):
            joints.setdefault(robot_id, []).append(name)
    return joints


def _names(place: Workspace) -> dict[str, str]:
    with place.reading() as session:
        return {robot_id: name for robot_id, name in session.execute(select(Robot.robot_id, Robot.name))}
