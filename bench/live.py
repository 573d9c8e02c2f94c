"""How far the graph lags behind robots that are watched, and whether a sample is lost.

python bench/live.py [ROBOTS SECONDS] [--server] [--twin]

Another process sends the states of six-axis robots at 83 Hz as JSON lines over TCP. Beside the watching a thread asks
the graph by SPARQL, again and again, of what time the states are that it shows; the lag of a state is the time from its
stamp to the first answer that shows it or a newer one. With `--server` the graph is on an `oxigraph` server. With
`--twin` each robot has the baseline twin of the shipped logs, and it is said how far energy lags behind the newest
state when the sending ends.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import shutil
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from sqlalchemy import select

from irtwin import identify
from irtwin.errors import InputError
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.live.joint_stream import StateReader, feed, listening
from irtwin.live.live_twin import LiveTwin
from irtwin.live.watch import SWITCH
from irtwin.storage.database import Workspace
from irtwin.storage.schema import LIVE_RUN, Activity, JointRow, RobotRow, RunRow, TwinRow
from irtwin.twin.files import to_json
from irtwin.twin.twin import Twin
from irtwin.workflow import unpack_demo

RATE = 83.0  # Hz
JOINTS = [f"joint_a{number}" for number in range(1, 7)]
SHOWN = "SELECT ?robot ?time { ?run irt:State_Time ?time ; irt:run_of ?robot }"


def send(port: int, robots: int, seconds: float, rate: float = RATE) -> None:
    """Send every robot's states in turn, each with the time at which it is made; print how many."""
    links = [socket.create_connection(("127.0.0.1", port)) for _ in range(robots)]
    for link in links:  # else the system holds a line back for up to 40 ms (Nagle)
        link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    count = int(seconds * rate)
    begin = time.time()
    for number in range(count):
        time.sleep(max(0.0, begin + number / rate - time.time()))
        for robot, link in enumerate(links):
            at = time.time()
            values = [math.sin(at + joint) for joint in range(6)]
            state = {"robot": f"R{robot:03d}", "time": at, "position": values, "velocity": values, "effort": values}
            link.sendall(json.dumps(state | {"temperature": values, "power": 400.0}).encode() + b"\n")
    for link in links:
        link.close()
    print(count)


def add_robot(place: Workspace, robot_id: str, twin: Twin | None) -> None:
    joints = [JointRow(robot_id=robot_id, name=name, position=n, kind="revolute") for n, name in enumerate(JOINTS, 1)]
    robot = RobotRow(
        robot_id=robot_id,
        name=robot_id,
        controlled_axes=6,
        power_measured_at="mains",
        simulated=True,
        urdf="<robot/>" if twin is None else twin.robot.urdf,
        urdf_sha256="0" * 64,
        notes="{}",
    )
    place.ingest(robot, joints, [], {})
    if twin is None:
        return
    text = to_json(twin).encode()
    path, now = f"twins/{robot_id}.json", datetime.now(UTC)
    row = TwinRow(
        twin_id=f"{robot_id}.t", robot_id=robot_id, created=now, file=path, sha256=hashlib.sha256(text).hexdigest(),
        split="none",
    )  # fmt: skip
    made = Activity(
        activity_id=f"t.{robot_id}", robot_id=robot_id, provider="identification", subject=robot_id, started=now,
        ended=now, software="bench",
    )  # fmt: skip
    place.replace_activity(made, [], [row], documents={path: text})


@contextmanager
def watched_by_queries(graph: KnowledgeGraph, seen: dict[str, list[tuple[float, float]]]) -> Iterator[None]:
    """Ask the graph in a thread; `seen` gets, by robot, the times of asking and of the state that was shown."""
    over = threading.Event()

    def ask() -> None:
        while not over.wait(0.002 + 0.0002 * len(seen)):
            rows = graph.query(SHOWN)
            now = time.time()
            for row in rows:
                seen.setdefault(row["robot"].rpartition("/")[2], []).append((now, row["time"].timestamp()))

    thread = threading.Thread(target=ask)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


def lags(stamps: np.ndarray, seen: list[tuple[float, float]]) -> np.ndarray:
    """Return, (N,) s, from each state's stamp, (N,), to the first answer that showed it or a newer one."""
    asked, shown = np.array(seen).T
    first = np.searchsorted(np.maximum.accumulate(shown), stamps - 1e-5)
    known = first < len(asked)
    return asked[first[known]] - stamps[known]


@contextmanager
def oxigraph_server() -> Iterator[str]:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"127.0.0.1:{free.getsockname()[1]}"
    program = shutil.which("oxigraph", path=f"{Path(sys.executable).parent}:{os.environ['PATH']}")
    with tempfile.TemporaryDirectory() as folder:
        process = subprocess.Popen([str(program), "serve", "--location", folder, "--bind", address], stderr=-3)
        while True:
            try:
                KnowledgeGraph(f"http://{address}/query")
                break
            except InputError:
                time.sleep(0.1)
        yield f"http://{address}/query"
        process.kill()
        process.wait()


def kr6() -> Twin:
    with tempfile.TemporaryDirectory() as folder:
        return identify(unpack_demo(Path(folder)))


def main(robots: int, seconds: float, on_server: bool, with_twin: bool) -> None:
    sys.setswitchinterval(SWITCH)
    seen: dict[str, list[tuple[float, float]]] = {}
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        place = stack.enter_context(Workspace(folder))
        known = kr6() if with_twin else None
        for number in range(robots):
            add_robot(place, f"R{number:03d}", known)
        graph = stack.enter_context(
            KnowledgeGraph(stack.enter_context(oxigraph_server()) if on_server else place.graph_folder)
        )
        graph.load_ontology()
        twin = LiveTwin(place, graph, print)
        reader = StateReader(twin.robots.joints, twin.robots.names)
        with listening(0, lambda lines: feed(lines, reader, twin.receive, print)) as port:
            command = [sys.executable, __file__, "send", str(port), str(robots), str(seconds)]
            with watched_by_queries(graph, seen):
                used = time.process_time()
                sent = int(subprocess.run(command, check=True, capture_output=True, text=True).stdout) * robots
                used = time.process_time() - used
                behind = [
                    run.length - run.energy.so_far.seconds for run in twin._runs.values() if run.energy is not None
                ]
                time.sleep(1.0)
        began = time.perf_counter()
        twin.stop()
        stopped = time.perf_counter() - began
        with place.reading() as session:
            runs = session.scalars(select(RunRow).where(RunRow.kind == LIVE_RUN)).all()
        found = []
        for run in runs:
            stamps = place.read_series(run.run_id)["time"].to_numpy() + run.start_time.timestamp()
            found.append(lags(stamps, seen[run.robot_id]))
    lag = 1000 * np.concatenate(found)
    stored = sum(run.sample_count for run in runs)
    load = ", ".join(f"{value:.1f}" for value in os.getloadavg()[:2])
    place_of_graph = "on a server" if on_server else "embedded"
    print(f"{robots} robots, {seconds:g} s, graph {place_of_graph}; {used / seconds:.2f} cores used, load {load}")
    print(f"samples sent {sent}, stored {stored}, lost {sent - stored}; source waited {twin.waited:.2f} s")
    print(f"lag of the graph, ms: median {np.median(lag):.0f}, p99 {np.percentile(lag, 99):.0f}, max {lag.max():.0f}")
    print(f"energy behind the newest state, s: median {np.median(behind):.2f}, max {max(behind):.2f}")
    print(f"states never shown: {twin.superseded / stored:.1%}; asked {len(seen['R000'])} times; end {stopped:.1f} s")


if __name__ == "__main__":
    if sys.argv[1:2] == ["send"]:
        send(int(sys.argv[2]), int(sys.argv[3]), *map(float, sys.argv[4:]))
    else:
        numbers = [float(argument) for argument in sys.argv[1:] if not argument.startswith("--")]
        robots, seconds = numbers or (1, 20)
        main(int(robots), seconds, "--server" in sys.argv, "--twin" in sys.argv)
