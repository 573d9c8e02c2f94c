"""Reports that open offline: what each of them carries, and what a browser may do with it."""

from __future__ import annotations

import base64
import gzip
import hashlib
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from typing import Any

from irtwin.packing import Fragment, embedded_json, packed_scripts
from irtwin.report.colours import OF_LINES
from irtwin.report.questions import Answers, added_to
from irtwin.report.templates import style, written
from irtwin.report.traces import Figure
from irtwin.resources import Resources, folder


def report_page(
    resources: Resources,
    report: str,
    answers: Answers,
    bindings: Mapping[str, str],
    drawn: Mapping[str, Figure | None],
    *,
    curves: Mapping[str, Any] | None = None,
    fragment: Fragment | None = None,
    beside: Sequence[str] = (),
    **values: Any,
) -> str:
    """Return the page of a report, by the template of its folder in `reports`.

    drawn: its figures by name; curves: packed, of runs; fragment: a part of the page that has scripts of its own;
    beside: the style sheets and scripts that it alone has, by their paths in `reports`; values: what its template takes
    besides. Raises InputError where an extension is why it cannot be made.
    """
    styles = ["layout/style.css", *(name for name in beside if name.endswith(".css"))]
    own = ["layout/plotting.js", "layout/figures.js", *(name for name in beside if name.endswith(".js"))]
    scripts = packed_scripts([plotly(), *map(script, own)])
    figures = {name: figure for name, figure in drawn.items() if figure}
    return written(
        resources,
        f"{report}/page.html.jinja",
        answers=answers,
        added=added_to(resources, report),
        bindings=bindings,
        rows={name: answer.rows for name, answer in answers.items()},
        drawn=drawn,
        curves=curves,
        data=embedded_json({"figures": figures, "explorer": curves, "colours": OF_LINES}),
        style=style(resources, *styles),
        scripts=scripts.html,
        policy=content_policy([*scripts.scripts, *(fragment.scripts if fragment else ())]),
        **values,
    )


def script(name: str) -> str:
    """Return a script by its path in `reports`."""
    return (folder("reports") / name).read_text(encoding="utf-8")


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
