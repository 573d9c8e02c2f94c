"""A robot's energy report: one HTML file that opens offline."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup
from plotly.offline import get_plotlyjs

from irtwin import resources
from irtwin.errors import InputError
from irtwin.knowledge.java import HOW_TO_GET
from irtwin.report import wording
from irtwin.report.energy import tables, verdict
from irtwin.report.energy.figures import figures
from irtwin.report.explorer import Columns, ReadSeries, explorer, opening_run
from irtwin.report.questions import Answers, Graph, Question, ask, read_questions
from irtwin.storage.files import write

DrawScene = Callable[[Columns], str]  # a run's modelled series -> an HTML fragment with its scripts

_SCRIPT = re.compile(r"<script(?![^>]*application/json)[^>]*>(.*?)</script>", re.DOTALL | re.IGNORECASE)


def render(
    graph: Graph,
    robot_iri: str,
    read_series: ReadSeries,
    out: Path,
    draw_scene: DrawScene | None = None,
    explain: tables.Explain | None = None,
) -> None:
    """Write the energy report of a robot to `out`.

    Every number comes from the questions in `reports/energy`; samples come from the series that they name.
    `draw_scene` gets the series of the run that the page opens on, and returns its 3-D scene. `explain` says how a
    conclusion is known.
    """
    bindings = _bindings(graph, robot_iri)
    answers = ask(graph, _questions(), bindings)
    if answers["robot"].first is None:
        raise InputError(f"{robot_iri}: this robot is not in the graph; ingest its data set first")
    opens = opening_run(answers)
    scene = None
    if draw_scene is not None and opens is not None:
        scene = draw_scene(Columns.of(read_series(opens["file"], opens["checksum"])))
    page = _page(answers, bindings, explorer(answers, read_series), scene, explain)
    write(out, page.encode())


def _questions() -> dict[str, Question]:
    return read_questions(resources.folder("reports") / "energy")


def _bindings(graph: Graph, robot_iri: str) -> dict[str, str]:
    """Return what the questions are about: the robot, and its latest twin where it has one."""
    answer = ask(graph, {"twin": _questions()["twin"]}, {"robot": robot_iri})["twin"]
    return {"robot": robot_iri} | ({"twin": answer.first["twin"]} if answer.first else {})


def _page(
    answers: Answers,
    bindings: Mapping[str, str],
    curves: Mapping[str, Any] | None,
    scene: str | None,
    explain: tables.Explain | None,
) -> str:
    folder = resources.folder("reports")
    drawn = figures(answers)
    scripts = {
        "plotly": get_plotlyjs(),
        "figures": (folder / "layout" / "figures.js").read_text(encoding="utf-8"),
    }
    return environment(folder).get_template("energy/page.html.jinja").render(
        answers=answers,
        bindings=bindings,
        rows={name: answer.rows for name, answer in answers.items()},
        verdict=verdict.sentence(answers),
        torque=verdict.torque(answers),
        energy=verdict.energy(answers),
        seed_error=verdict.SEED_ENERGY_ERROR,
        parameters=tables.parameters(answers["parameters"].rows, answers["joints"].rows),
        run_fits=tables.run_fits(answers["torque_fit"].rows),
        fits=tables.fits(answers["torque_fit_per_joint"].rows),
        conclusions=tables.conclusions(answers["conclusions"].rows, explain),
        java=HOW_TO_GET.replace("`", ""),
        drawn=drawn,
        curves=curves,
        data=embedded_json({"figures": {name: figure for name, figure in drawn.items() if figure}, "explorer": curves}),
        scene=None if scene is None else Markup(scene),
        scene_run=curves["runs"][curves["opens"]]["name"] if curves else None,
        style=Markup((folder / "layout" / "style.css").read_text(encoding="utf-8")),
        scripts={name: Markup(text) for name, text in scripts.items()},
        policy=content_policy([*scripts.values(), *_SCRIPT.findall(scene or "")]),
    )  # fmt: skip


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


def embedded_json(data: object) -> Markup:
    """Return JSON that is safe inside a script element: no `<` that could end it."""
    text = json.dumps(data, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return Markup(text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029"))


def environment(folder: Path) -> jinja2.Environment:
    """Return the templates of a reports folder, with the filters that pages use."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(folder),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    words = (
        wording.number, wording.quantity, wording.percent, wording.share, wording.energy, wording.duration,
        wording.angle, wording.angular_speed, wording.moment, wording.local_name, wording.short_checksum,
        wording.notes, wording.decimals, wording.given, wording.unit_symbol, wording.listed,
    )  # fmt: skip
    environment.filters |= {function.__name__: function for function in words}
    return environment
