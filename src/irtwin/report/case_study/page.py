"""The page of the case study: what the seed paper shows in its figures 7 to 13, and the same here."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from itertools import groupby

from irtwin.errors import InputError
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.report.case_study.figures import figures
from irtwin.report.energy.page import DrawScene
from irtwin.report.explorer import Columns, ReadSeries
from irtwin.report.page import report_page
from irtwin.report.questions import Row, ask, questions_of
from irtwin.resources import shipped
from irtwin.storage.files import InsidePath, write

# Yan 2018, equations (13) to (15)
SEED_MODELLED, SEED_MEASURED, SEED_ERROR = 559.59, 598.78, 6.54  # J, J, %


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
