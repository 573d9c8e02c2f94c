"""The templates of pages: those that ship and those that extend them, with the filters that pages use."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import jinja2
from jinja2.sandbox import SandboxedEnvironment
from markupsafe import Markup

from irtwin.input_file import read_text
from irtwin.report import wording
from irtwin.report.apart import written_apart
from irtwin.report.energy import tables
from irtwin.report.questions import effect_name
from irtwin.resources import MOST_BYTES, Resources


def written(resources: Resources, template: str, **values: Any) -> str:
    """Return the page that a template makes of values. InputError where an extension is why it cannot be made."""
    if any(file.is_extension for file in resources.of("reports", ".html.jinja")):
        return written_apart(resources, template, values)
    return environment(resources).get_template(template).render(**values)


@lru_cache(maxsize=8)
def environment(resources: Resources) -> jinja2.Environment:
    """Return the templates of reports, each compiled once, with the filters that pages use; who adds any overlays it.

    They run in a sandbox, as a workspace from elsewhere may bring some.
    """

    def source(name: str) -> tuple[str, str, Callable[[], bool]] | None:
        known = {file.name: file.path for file in resources.of("reports", ".html.jinja")}
        return (read_text(known[name], MOST_BYTES), str(known[name]), lambda: True) if name in known else None

    environment = SandboxedEnvironment(
        loader=jinja2.FunctionLoader(source),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    words = (
        wording.number, wording.quantity, wording.percent, wording.share, wording.energy, wording.duration,
        wording.angle, wording.position, wording.angular_speed, wording.moment, wording.local_name,
        wording.short_checksum, wording.decimals, wording.given, wording.unit_symbol, wording.listed,
        wording.shown, tables.is_unsure, tables.scaled_interval, wording.heading, effect_name,
    )  # fmt: skip
    environment.filters |= {function.__name__: function for function in words}
    return environment


def style(resources: Resources, *names: str) -> Markup:
    """Return style sheets of the reports as one, by their paths there."""
    return Markup("\n").join(Markup(read_text(resources.path("reports", name), MOST_BYTES)) for name in names)
