"""Streams of joint states for `irtwin live`: a plan of plain values, its lines, and the strategy that draws plans."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass

from hypothesis import strategies as st

NOON = 1772366400.0  # 2026-03-01T12:00:00Z


@dataclass(frozen=True)
class StreamPlan:
    """States from `start` on, `step` s apart; `odd` are lines put in at a place, by their names.

    `lacks`: bytes at the end that never come.
    """

    start: float = NOON
    states: int = 50
    odd: tuple[tuple[int, str], ...] = ()
    step: float = 0.01
    lacks: int = 0


def lines(plan: StreamPlan, robot_id: str, joints: int) -> bytes:
    """Return the stream as it goes to standard input."""
    odd = dict(plan.odd)
    out = []
    words = {"ROBOT": json.dumps(robot_id), "ALL": json.dumps([0.5] * joints), "START": str(plan.start)}
    words["BACK"] = str(plan.start - 1)
    for number in range(plan.states):
        if number in odd:
            line = re.sub("|".join(words), lambda found: words[found[0]], ODD[odd[number]])
            out.append(line.encode("utf-8", "surrogateescape"))
        time = plan.start + number * plan.step
        said = {"robot": robot_id, "time": time, "position": [0.01 * number] * joints, "effort": [1.0] * joints}
        out.append(json.dumps(said).encode())
    content = b"\n".join(out) + b"\n"
    return content[: len(content) - plan.lacks]


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
    "very long": '{"robot": ROBOT, "position": [' + "1," * 2_000_000,
    "no characters": '{"robot": "\udcff\udcfe", "time": 1, "position": [1]}',
    "the same again": '{"robot": ROBOT, "time": START, "position": ALL}',
    "a second back": '{"robot": ROBOT, "time": BACK, "position": ALL}',
    "another robot": '{"robot": "nobody", "time": 1772366400.255, "position": [1]}',
    "its name in pieces": '{"robot": "a\u0000\u001b[31m/../", "time": 1772366400.255, "position": [1]}',
    "no text": '{"robot": [ROBOT], "time": "1772366400", "position": {"a": 1}}',
    "twice": '{"robot": ROBOT, "robot": "x", "time": START, "time": 5, "position": ALL}',
    "a plan": '{"robot": ROBOT, "time": START, "position": ALL, "performs": "../../x"}',
    "a payload": '{"robot": ROBOT, "time": START, "position": ALL, "payload": -1e300, "payload_com": [1e300, 0]}',
    "a late payload": '{"robot": ROBOT, "time": 1772366403.0, "position": ALL, "payload": 1e6}',
    "all of it huge": '{"robot": ROBOT, "time": 1772366400.1, "position": ALL, "effort": 1e308, "power": -1e308}',
    "power and heat": '{"robot": ROBOT, "time": 1772366400.2, "position": ALL, "power": 1e5, "temperature": ALL}',
    "a gap of a year": '{"robot": ROBOT, "time": 1803902400.0, "position": ALL}',
    "a request": "POST / HTTP/1.1",
    "no end": "{}" + "\r" * 3,
}


def streams() -> st.SearchStrategy[StreamPlan]:
    """Draw a stream."""
    odd = st.lists(st.tuples(st.integers(0, 49), st.sampled_from(sorted(ODD))), max_size=4).map(tuple)
    return st.builds(
        StreamPlan,
        start=st.sampled_from((NOON, NOON, NOON + 60, 0.0, 1e9, 253402300700.0)),
        odd=odd,
        step=st.sampled_from((0.01, 0.01, 0.01, 0.0, -0.5, 1e-9, 0.3, 100.0)),
        lacks=st.sampled_from((0, 0, 0, 1, 2, 30)),
    )
