"""The page of the case study: what the seed paper shows in its figures 7 to 13, and the same here."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from itertools import cycle, groupby

import numpy as np

from irtwin.errors import InputError
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.report.colours import HELD_OUT, MEASURED, MODELLED, PALETTE, RESIDUAL
from irtwin.report.energy.page import DrawScene
from irtwin.report.explorer import Columns, ReadSeries
from irtwin.report.page import report_page
from irtwin.report.questions import Row, ask, questions_of
from irtwin.report.traces import TIME, Figure, axis, plain, trace
from irtwin.resources import shipped
from irtwin.signals.channels import CHANNELS
from irtwin.storage.files import InsidePath, write

# Yan 2018, equations (13) to (15)
SEED_MODELLED, SEED_MEASURED, SEED_ERROR = 559.59, 598.78, 6.54  # J, J, %
_VALIDATED = slice(1, 4)  # joints 2 to 4


def render(
    graph: KnowledgeGraph, robot_iri: str, read_series: ReadSeries, out: InsidePath, draw_scene: DrawScene
) -> None:
    """Write the page of a robot's plan and the run that carried it out to `out`.

    Every number of ours comes from the questions in `reports/case_study`; samples come from the series that they name.
    Raises InputError where the graph knows of no plan that was carried out.
    """
    questions = questions_of(shipped(), "case_study")
    case = ask(graph, {"case": questions["case"]}, {"robot": robot_iri})["case"].first
    if case is None:
        raise InputError(f"{robot_iri}: the graph has no plan that was carried out; run `irtwin demo --case-study`")
    bindings = {"robot": robot_iri} | {name: case[name] for name in ("plan", "run", "twin", "validation")}
    answers = ask(graph, questions, bindings)
    read = cache(read_series)
    series = {
        row["of"]: (row["name"], Columns.of(read(row["file"], row["checksum"]))) for row in answers["series"].rows
    }
    scene = draw_scene([series["plan"], series["run"]], 0)
    columns = {name: columns for name, (_, columns) in series.items()}
    page = report_page(
        shipped(),
        "case_study",
        answers,
        bindings,
        figures(columns, answers["configurations"].rows),
        fragment=scene,
        beside=("case_study/style.css", "case_study/configurations.js"),
        individuals=individuals(answers["individual"].rows, graph.base),
        seed_modelled=SEED_MODELLED,
        seed_measured=SEED_MEASURED,
        seed_error=SEED_ERROR,
        scene=scene.html,
    )
    write(out, page.encode())


def individuals(rows: Sequence[Row], base: str) -> list[tuple[str, str, list[Row]]]:
    """Return each individual, by its name below the base, with its class and the rows of its properties."""
    grouped = groupby(rows, key=lambda row: (row["individual"].removeprefix(base), row["class"]))
    return [(individual, kind, list(its)) for (individual, kind), its in grouped]


def figures(series: Mapping[str, Columns], joints: Sequence[Row]) -> dict[str, Figure]:
    """Return the figures by name, of the series "plan", "run" and "validation": motions, power and energy over them."""
    plan, run, validation = (series[name] for name in ("plan", "run", "validation"))
    return {
        "validation_motion": _motion(validation, joints[_VALIDATED]),
        "validation_power": _compared(validation, "power", "power", "W"),
        "planned_motion": _motion(plan, joints),
        "measured_motion": _motion(run, joints),
        "power": _compared(run, "power", "power", "W", plan),
        "energy": _compared(run, "energy", "energy used so far", "J", plan),
    }


def _motion(series: Columns, joints: Sequence[Row]) -> Figure:
    """Draw joint positions over time, rotations in degrees."""
    data = []
    for colour, row in zip(cycle(PALETTE), joints, strict=False):
        slides = row["kind"] == "prismatic"
        values = series[CHANNELS["q"].column(row["joint"])]
        drawn = values if slides else np.degrees(values)
        data.append(_line(plain(row["joint"]), series, drawn, "m" if slides else "°", colour))
    return {"data": data, "layout": {"xaxis": TIME, "yaxis": {"title": {"text": "joint position, °"}}}}


def _compared(run: Columns, name: str, title: str, unit: str, plan: Columns | None = None) -> Figure:
    """Draw what was measured, what the twin makes of the measured motion, and what it made of the plan, if any."""
    data = [
        _line("measured", run, run[name], unit, MEASURED),
        _line("modelled, along the measured motion", run, run[f"{name}_model"], unit, MODELLED),
        _line("measured less modelled", run, run[name] - run[f"{name}_model"], unit, RESIDUAL),
    ]
    if plan is not None:
        data.append(_line("planned, before it moved", plan, plan[f"{name}_model"], unit, HELD_OUT, dash="dot"))
    return {"data": data, "layout": {"xaxis": TIME, "yaxis": axis(title, unit)}}


def _line(name: str, series: Columns, values: np.ndarray, unit: str, colour: str, dash: str = "solid") -> Figure:
    time = series["time"] - series["time"][0]
    known = np.isfinite(values)
    x = [round(float(at), 4) for at in time[known]]
    y = [float(f"{value:.5g}") for value in values[known]]
    return trace(name, x, y, unit, line={"color": colour, "width": 2, "dash": dash})
