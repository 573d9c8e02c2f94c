"""Robots watched from the command line: from a stream to storage and graph."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from pathlib import Path

from irtwin.announce import Announce
from irtwin.errors import InputError
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.live.broadcast import Broadcast
from irtwin.live.joint_stream import State, StateReader, feed, lines_of, listening
from irtwin.live.live_twin import AHEAD, LiveTwin
from irtwin.live.replay import Replay
from irtwin.live.stream_clock import WrongTime
from irtwin.location import Location
from irtwin.providers.names import find_robot, find_run
from irtwin.providers.records import load_robot
from irtwin.storage.database import Workspace
from irtwin.storage.files import told_when_full
from irtwin.storage.schema import LIVE, LIVE_RUN, PLANNED_RUN, REPLAYED_RUN
from irtwin.storage.turns import rewriting_alone

SWITCH = 0.0005  # s that a thread may keep others from running: the graph's waits after each transaction
_MOST_REASONS = 100  # of refused lines that are told: some for each robot of a cell; further ones are counted alone


class RefusedLines:
    """Lines that were refused: all are counted, and each reason is told once; threads may refuse at once."""

    def __init__(self, announce: Announce) -> None:
        self.count = 0
        self._announce = announce
        self._told: set[str] = set()
        self._lock = threading.Lock()

    def refuse(self, error: InputError) -> None:
        """Refuse a line by its error; one of a wrong time is told with the seconds of the first."""
        reason = error.reason if isinstance(error, WrongTime) else str(error)
        with self._lock:
            self.count += 1
            is_news = reason not in self._told and len(self._told) < _MOST_REASONS
            if is_news:
                self._told.add(reason)
        if is_news:
            self._announce(f"line refused: {error}")


def watch(
    location: Location,
    *,
    port: int | None = None,
    replay: Path | None = None,
    opcua: str | None = None,
    nodes: Path | None = None,
    robot: str | None = None,
    speed: float = 1.0,
    performs: str | None = None,
    announce: Announce = lambda line: None,
) -> None:
    """Watch a workspace's robots until the stream on standard input ends, or SIGINT or SIGTERM comes.

    With `port`: the streams of clients on that port of this machine, 0 for a free one, until a signal comes.
    With `replay`: a log of the robot of this name, `speed` times as fast as it was, until it ends.
    With `opcua`: what the OPC UA server there says of the robot of this name, by a file of `nodes` where one is given,
    until a signal comes.
    With `performs`: the first run of that robot carries out the plan of this name.
    """
    sys.setswitchinterval(SWITCH)
    refusals = RefusedLines(announce)
    done = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: done.set())

    with (
        told_when_full(location.folder),
        Workspace.existing(location) as place,
        _alone(place),
        KnowledgeGraph.of_workspace(place) as graph,
        Broadcast(place.folder / LIVE) as broadcast,
        LiveTwin(place, graph, announce, broadcast, LIVE_RUN if replay is None else REPLAYED_RUN) as twin,
    ):
        if robot is None:
            reader = StateReader(twin.robots.joints, twin.robots.names)
            _read(lambda stream: feed(reader.states(stream), twin.receive, refusals.refuse), port, twin, done, announce)
        else:
            robot_id = find_robot(place, robot)
            described = load_robot(place, robot_id)
            take: Callable[[State], None] = twin.receive
            if performs is not None:
                find_run(place, robot_id, performs, PLANNED_RUN)
                take = _performing(take, performs)
            states: Iterable[State | InputError]
            if replay is not None:
                log = Replay(replay, described, robot_id, speed)
                start = log.start(after=twin.robots.times.end(robot_id), ahead=AHEAD)
                announce(f"Playing {replay}: {log.seconds:.1f} s at {speed:g} times its speed")
                states = log.play(done, start)
            else:
                from irtwin.live.opcua import OpcUa  # an extra

                source = OpcUa(str(opcua), described, robot_id, nodes)
                announce(f"Following {source.address}: {source.what}")
                states = source.states(done, announce)

            def refuse(error: InputError) -> None:
                refusals.refuse(error)
                twin.check()  # whether it was refused as nothing can be stored any more

            feed(states, take, refuse)
    announce(f"{twin.stored} samples stored, {refusals.count} lines refused")
    announce(f"the graph skipped {twin.superseded} states for newer ones; the source waited for {twin.waited:.1f} s")


def _alone(place: Workspace) -> AbstractContextManager[None]:
    """Keep others from a server's graph, as the lock of a folder's store does by itself."""
    return nullcontext() if place.location.graph_url is None else rewriting_alone(place.engine, place.folder)


def _read(
    take: Callable[[Iterable[bytes]], None], port: int | None, twin: LiveTwin, done: threading.Event, announce: Announce
) -> None:
    """Take lines of clients on a port, or of standard input where it is None, until it is `done`."""

    def take_standard_input() -> None:
        take(lines_of(sys.stdin.buffer))
        done.set()

    if port is None:
        threading.Thread(target=take_standard_input, daemon=True).start()
    with nullcontext() if port is None else listening(port, take) as actual:
        announce("Reading standard input" if actual is None else f"Listening on 127.0.0.1:{actual}")
        while not done.wait(0.2):
            twin.check()


def _performing(take: Callable[[State], None], plan: str) -> Callable[[State], None]:
    """Return what takes states, the first of which says the plan that its run carries out."""
    told = False

    def take_with_plan(state: State) -> None:
        nonlocal told
        take(state if told else replace(state, performs=plan))
        told = True

    return take_with_plan
