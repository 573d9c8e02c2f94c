"""Alarms of a workspace, listed once, or told until a signal comes."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from irtwin.alarms.alarm import Alarm, active, alarms, sparql_of_rules
from irtwin.alarms.follow import follow, told_in
from irtwin.alarms.settings import NAME, asks, read_settings
from irtwin.announce import Announce
from irtwin.asking import checked, open_graph
from irtwin.knowledge.questions.queries import ask
from irtwin.knowledge.store.table import AnswerTable
from irtwin.location import Location
from irtwin.storage.files import inside
from irtwin.trust import how, trusted

if TYPE_CHECKING:
    from irtwin.alarms.mqtt import AlarmTopic, Broker
    from irtwin.alarms.sparkplug import EdgeNode


def listed(location: Location, robot: str | None = None) -> AnswerTable:
    """Return the alarms that are active. Raises InputError where there is no graph, or no robot of the name."""
    return active(_alarms(location, robot))


def tell(
    location: Location,
    *,
    robot: str | None = None,
    config: Path | None = None,
    announce: Announce = lambda line: None,
) -> None:
    """Tell each alarm when it begins and when it is over, on standard output and to whom `config` names.

    Brokers that ask for Sparkplug B are told of the robots instead, as often as the graph is looked at.
    `config` is `alarms.toml` of the workspace by default, if that is there, and as far as the user trusts it.
    `announce` is told what is amiss. Ends with SIGINT or SIGTERM, and gives messages on their way some seconds.
    """
    workspace, done = location.folder, threading.Event()
    alarms = _alarms(location, robot)  # before anything is made: there may be no workspace
    sparql = sparql_of_rules(checked(workspace))
    of_alarms, of_robots = read_settings(config) if config is not None else _of_workspace(workspace, announce)
    with told_in(workspace) as told:
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: done.set())
        names = ["standard output", *(broker.name for broker in (*of_alarms, *of_robots))]
        announce(f"Telling alarms to {', '.join(names)}; {sum(alarm.state == 'active' for alarm in alarms)} active now")
        topics, nodes = _connected(of_alarms, of_robots, announce)
        try:
            follow(partial(_alarms, location, robot, nodes), told, partial(_write, topics), done, announce, sparql)
        finally:
            for node in nodes:
                node.close()
            for topic in topics:
                topic.close()


def _connected(
    of_alarms: Sequence[Broker], of_robots: Sequence[Broker], announce: Announce
) -> tuple[list[AlarmTopic], list[EdgeNode]]:
    if not (of_alarms or of_robots):
        return [], []
    from irtwin.alarms.mqtt import AlarmTopic  # an extra
    from irtwin.alarms.sparkplug import EdgeNode

    return [AlarmTopic(broker, announce) for broker in of_alarms], [EdgeNode(broker, announce) for broker in of_robots]


def _of_workspace(workspace: Path, announce: Announce) -> tuple[list[Broker], list[Broker]]:
    """Return whom the workspace's own file may tell; say whom it would tell, too."""
    file = inside(workspace, NAME)
    if not file.exists():
        return [], []
    may = trusted(workspace)
    for asked in asks(file):
        if asked not in may:
            announce(f"{workspace}: not told: {asked.removeprefix(f'{NAME}: ')}; {how(workspace)}")
    return read_settings(file, may=may)


def _alarms(location: Location, robot: str | None, nodes: Sequence[EdgeNode] = ()) -> list[Alarm]:
    with open_graph(location) as graph:
        for node in nodes:
            node.tell(ask(graph, "plant_now", robot))
        return alarms(graph, robot)


def _write(topics: Sequence[AlarmTopic], line: bytes) -> None:
    for topic in topics:
        topic.put(line)
    sys.stdout.buffer.write(line + b"\n")
    sys.stdout.buffer.flush()
