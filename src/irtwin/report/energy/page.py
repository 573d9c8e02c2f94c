"""A robot's energy report: one HTML file that opens offline."""

from __future__ import annotations

import base64
import gzip
import hashlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from typing import Any

from markupsafe import Markup

from irtwin.errors import InputError
from irtwin.packing import Fragment, embedded_json, packed_scripts
from irtwin.report import colours
from irtwin.report.energy import lead, tables, verdict
from irtwin.report.energy.figures import figures
from irtwin.report.energy.flows import flows
from irtwin.report.explorer import Columns, ReadSeries, explorer
from irtwin.report.questions import Answers, Graph, added_to, ask, limits, questions_of
from irtwin.report.templates import style, written
from irtwin.report.traces import Figure
from irtwin.resources import Resources, folder, shipped
from irtwin.storage.files import InsidePath, write

DrawScene = Callable[[Sequence[tuple[str, Columns]], int], Fragment]  # runs with their modelled series, the first shown


def render(
    graph: Graph,
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
    page = _page(resources, answers, bindings, curves, scene, explain)
    write(out, page.encode())


def _page(
    resources: Resources,
    answers: Answers,
    bindings: Mapping[str, str],
    curves: Mapping[str, Any] | None,
    scene: Fragment | None,
    explain: tables.Explain | None,
) -> str:
    drawn = figures(answers)
    scripts = figure_scripts()
    return written(
        resources,
        "energy/page.html.jinja",
        answers=answers,
        added=added_to(resources, "energy"),
        bindings=bindings,
        rows={name: answer.rows for name, answer in answers.items()},
        taken=lead.taken(answers),
        could_save=lead.could_save(answers),
        saving=answers["waiting"].first,
        retimed=lead.retimed(answers),
        made=lead.made(answers),
        trust=lead.trust(answers),
        constant=lead.constant_power(answers),
        torque=verdict.torque(answers),
        energy=verdict.energy(answers),
        limits=limits(answers),
        parameters=tables.parameters(answers["parameters"].rows, answers["joints"].rows),
        conclusions=tables.conclusions(answers["conclusions"].rows, explain),
        drawn=drawn,
        flows=flows(answers["energy_per_joint_and_effect"].rows),
        curves=curves,
        data=page_data({name: figure for name, figure in drawn.items() if figure}, curves),
        scene=None if scene is None else scene.html,
        style=style(resources),
        scripts=scripts.html,
        policy=content_policy([*scripts.scripts, *(scene.scripts if scene else ())]),
    )  # fmt: skip


def figure_scripts(*more: str) -> Fragment:
    """Return the scripts that draw a page's figures, and others that it has, by their paths in `reports`."""
    own = (script(name) for name in ("layout/plotting.js", "layout/figures.js", *more))
    return packed_scripts([plotly(), *own])


def script(name: str) -> str:
    """Return a script by its path in `reports`."""
    return (folder("reports") / name).read_text(encoding="utf-8")


def page_data(drawn: Mapping[str, Figure], curves: Mapping[str, Any] | None = None) -> Markup:
    """Return what a page's figures are drawn from: themselves, packed curves of runs, and the colours of lines."""
    return embedded_json({"figures": drawn, "explorer": curves, "colours": colours.of_lines()})


@cache
def plotly() -> str:
    """Return the part of Plotly that pages draw with: bars, lines and maps."""
    packed = folder("reports") / "layout" / "plotly-cartesian.min.js.gz"
    return gzip.decompress(packed.read_bytes()).decode()


def content_policy(scripts: Iterable[str]) -> str:
    """Return a Content-Security-Policy: these scripts alone may run, and nothing is loaded from anywhere."""
    hashes = " ".join(f"'sha256-{_digest(script)}'" for script in scripts)
    return (
        f"default-src 'none'; script-src {hashes}; style-src 'unsafe-inline'; img-src data: blob:; "
        "font-src data:; connect-src data: blob:; base-uri 'none'; form-action 'none'"
    )


def _digest(script: str) -> str:
    # A browser hashes what its parser made of the text, which reads \r\n as \n.
    normal = script.replace("\r\n", "\n").replace("\r", "\n")
    return base64.b64encode(hashlib.sha256(normal.encode("utf-8")).digest()).decode("ascii")
