"""Which curves a page draws of runs: a panel for each quantity, a line for each joint and each run.

The page's script asks for their samples by `series:curve`, as any client may.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from irtwin.report import wording
from irtwin.report.questions import Answers, Row
from irtwin.signals.channels import CHANNELS, Channel

Line = dict[str, Any]
MEASURED, MODELLED = "measured", "modelled"
_MODEL = "_model"
_FIRST = ("power", "torque", "q", "command", "dq")  # what people look at first; other channels follow
_SPANS = ("standing", "held_out")  # columns of yes and no, drawn as shades


@dataclass(frozen=True)
class Drawn:
    """A run as it is drawn: `series` its rows of `series.rq`, `marks` what happened in it, (s since it began, what)."""

    iri: str
    name: str
    series: Sequence[Row]
    marks: Sequence[tuple[float, str]] = ()


def of_run(answers: Answers) -> dict[str, Any] | None:
    """Return what the page of a run draws, None where it has no samples."""
    run = answers["run"].first
    assert run is not None
    marks = [
        ((row["since"] - run["began"]).total_seconds(), row["reason"]) for row in answers["alarms"].rows if run["began"]
    ]
    return curves([Drawn(run["run"], run["name"], answers["series"].rows, marks)], answers["joints"].rows)


def curves(runs: Sequence[Drawn], joints: Iterable[Row]) -> dict[str, Any] | None:
    """Return what a page's script draws of runs of one robot, None where they have no samples.

    A panel is of one quantity: samples of its lines times `scale` are in `unit`. A line is a `channel` of the series
    `kind` of a run, told by its place; `joint` is empty of the whole robot. Of several runs it is what was measured
    alone: they are drawn over each other.
    """
    kinds = {row["joint_name"]: row["kind"] or "" for row in joints}
    panels: dict[tuple[str, str], dict[str, Any]] = {}
    for number, run in enumerate(runs):
        for line, field_, channel in _lines(number, run, tuple(kinds), alone=len(runs) == 1):
            unit, scale = _unit(channel, kinds.get(line["joint"], ""))
            title = CHANNELS["q"].label if field_ == "command" else channel.label
            panel = {"title": title, "unit": unit, "scale": scale, "lines": []}
            panels.setdefault((title, unit), panel)["lines"].append(line)
    if not panels:
        return None
    there = {name for row in runs[0].series if row["kind"] == MODELLED for name in _columns(row)}
    spans = [{"run": 0, "channel": name} for name in _SPANS if len(runs) == 1 and name in there]
    return {
        "runs": [{"iri": run.iri, "name": run.name, "marks": run.marks} for run in runs],
        "joints": list(kinds),
        "panels": list(panels.values()),
        "spans": spans,
    }


def _lines(number: int, run: Drawn, joints: Sequence[str], alone: bool) -> Iterable[tuple[Line, str, Channel]]:
    """Yield the lines of a run in the order of their panels: measured, then what only the twin's series has."""
    has = {kind: set[str]() for kind in (MEASURED, MODELLED)}
    for row in run.series:
        has.setdefault(row["kind"], set()).update(_columns(row))
    fields = sorted(CHANNELS, key=lambda name: _FIRST.index(name) if name in _FIRST else len(_FIRST))
    for name in fields:
        channel = CHANNELS[name]
        if name == "time":
            continue
        for joint in joints if channel.per_joint else ("",):
            column = channel.column(joint)
            label = joint or run.name if not alone else joint or MEASURED
            kind = next((kind for kind in (MEASURED, *has) if column in has[kind]), None)
            if kind is not None:
                yield _line(number, kind, column, joint, label, name == "command"), name, channel
            if alone and f"{column}{_MODEL}" in has[MODELLED]:
                label = f"{joint}, by the twin" if joint else "by the twin"
                yield _line(number, MODELLED, f"{column}{_MODEL}", joint, label, True), name, channel


def _line(run: int, kind: str, channel: str, joint: str, name: str, modelled: bool) -> Line:
    return {"run": run, "kind": kind, "channel": channel, "joint": joint, "name": name, "modelled": modelled}


def _columns(row: Row) -> list[str]:
    return (row["columns"] or "").split(",")


def _unit(channel: Channel, kind: str) -> tuple[str, float]:
    """Return the unit that people read a channel in, and what SI is multiplied by for it."""
    unit = channel.unit_of(kind)
    if unit.startswith("rad"):
        return unit.replace("rad", "°").replace("^2", "²"), 180.0 / math.pi
    if unit.startswith("m") and channel.sliding == unit:
        return f"m{unit}".replace("^2", "²"), 1000.0
    return wording.unit_symbol(unit), 1.0
