"""A robot's energy report: one HTML file that opens offline."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache

from irtwin.errors import InputError
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.packing import Fragment
from irtwin.report.energy import lead, tables
from irtwin.report.energy.figures import figures
from irtwin.report.energy.flows import flows
from irtwin.report.explorer import Columns, ReadSeries, explorer
from irtwin.report.page import report_page
from irtwin.report.questions import ask, limits, questions_of
from irtwin.resources import Resources, shipped
from irtwin.storage.files import InsidePath, write

DrawScene = Callable[[Sequence[tuple[str, Columns]], int], Fragment]  # runs with their modelled series, the first shown


def render(
    graph: KnowledgeGraph,
    robot_iri: str,
    read_series: ReadSeries,
    out: InsidePath,
    draw_scene: DrawScene | None = None,
    explain: tables.Explain | None = None,
    resources: Resources | None = None,
) -> None:
    """Write the energy report of a robot to `out`.

    Every number comes from the questions in `reports/energy`; samples come from the series that they name.
    `draw_scene` gets the name and modelled series of every run, and the place of that which the page opens on; it
    returns their 3-D scene. `explain` says how a conclusion is known. `resources` are the questions and templates to
    take, those that ship if None; questions that were added are answered in tables of their own.
    """
    resources = resources or shipped()
    questions = questions_of(resources, "energy")
    twin = ask(graph, {"twin": questions["twin"]}, {"robot": robot_iri})["twin"].first  # the latest
    bindings = {"robot": robot_iri} | ({"twin": twin["twin"]} if twin else {})
    answers = ask(graph, questions, bindings)
    if answers["robot"].first is None:
        raise InputError(f"{robot_iri}: this robot is not in the graph; ingest its data set first")
    read = cache(read_series)
    curves = explorer(answers, read)
    scene = None
    if draw_scene is not None and curves is not None:
        rows = answers["modelled_series"].rows
        runs = [(row["run_name"], Columns.of(read(row["file"], row["checksum"]))) for row in rows]
        scene = draw_scene(runs, curves["opens"])
    page = report_page(
        resources,
        "energy",
        answers,
        bindings,
        figures(answers),
        curves=curves,
        fragment=scene,
        taken=lead.taken(answers),
        could_save=lead.could_save(answers),
        saving=answers["waiting"].first,
        retimed=lead.retimed(answers),
        made=lead.made(answers),
        trust=lead.trust(answers),
        constant=lead.constant_power(answers),
        torque=lead.torque(answers),
        energy=lead.energy(answers),
        limits=limits(answers),
        parameters=tables.parameters(answers["parameters"].rows, answers["joints"].rows),
        conclusions=tables.conclusions(answers["conclusions"].rows, explain),
        flows=flows(answers["energy_per_joint_and_effect"].rows),
        scene=None if scene is None else scene.html,
    )  # fmt: skip
    write(out, page.encode())
