"""Streams of joint states for `irtwin live`: a plan of plain values, its lines, and the strategy that draws plans."""

from __future__ import annotations

import json
from dataclasses import dataclass

from hypothesis import strategies as st

NOON = 1772366400.0  # 2026-03-01T12:00:00Z


@dataclass(frozen=True)
class StreamPlan:
    """States at 100 Hz from `start` on; `odd` are lines put in at a place, by their names."""

    start: float = NOON
    states: int = 50
    odd: tuple[tuple[int, str], ...] = ()


def lines(plan: StreamPlan, robot_id: str, joints: int) -> bytes:
    """Return the stream as it goes to standard input."""
    odd = dict(plan.odd)
    out = []
    for number in range(plan.states):
        if number in odd:
            out.append(ODD[odd[number]].replace("ROBOT", json.dumps(robot_id)).encode())
        time = plan.start + number / 100
        said = {"robot": robot_id, "time": time, "position": [0.01 * number] * joints, "effort": [1.0] * joints}
        out.append(json.dumps(said).encode())
    return b"\n".join(out) + b"\n"


ODD = {
    "empty": "",
    "cut off": "{",
    "no object": "[]",
    "deep": "[" * 5000,
    "no time": '{"robot": ROBOT}',
    "year 9999": '{"robot": ROBOT, "time": 253402300799.0, "position": [0]}',
    "an hour off": '{"robot": ROBOT, "time": 1772369000.0, "position": [0]}',
    "1970": '{"robot": ROBOT, "time": 0, "position": [0]}',
    "beyond a float": '{"robot": ROBOT, "time": 1e999, "position": [0]}',
    "no number": '{"robot": ROBOT, "time": NaN, "position": [NaN]}',
    "huge": '{"robot": ROBOT, "time": 1772366400.255, "position": [1e300], "effort": [1e300], "velocity": [-1e300]}',
    "many digits": '{"robot": ROBOT, "time": 1772366400.255, "position": [' + "9" * 5000 + "]}",
    "odd names": '{"robot": ROBOT, "time": 1772366400.255, "position": [1], "name": [{}]}',
    "half a character": '{"robot": "\\ud800", "time": 1, "position": [1]}',
    "long": "x" * 70000,
}


def streams() -> st.SearchStrategy[StreamPlan]:
    """Draw a stream."""
    odd = st.lists(st.tuples(st.integers(0, 49), st.sampled_from(sorted(ODD))), max_size=4).map(tuple)
    return st.builds(StreamPlan, start=st.sampled_from((NOON, NOON, 0.0, 1e9, 253402300700.0)), odd=odd)
