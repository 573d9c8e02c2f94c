"""The pages of a plant as HTML: templates and questions of `reports/plant`, without a script."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache, partial
from typing import Any, TypeVar

import jinja2

from irtwin import resources
from irtwin.knowledge.vocabulary import ID
from irtwin.providers.verification import FEWEST
from irtwin.report.plant import choice, links
from irtwin.report.plant.energies import kwh
from irtwin.report.plant.overview import SCREEN
from irtwin.report.questions import Answers, PageQuestion, read_questions
from irtwin.report.templates import environment

FOLDER = resources.folder("reports") / "plant"
PAGE = 50  # lines of a table on a page; tables as files stay whole
T = TypeVar("T")


@cache
def questions(page: str = "") -> Mapping[str, PageQuestion]:
    """Return the questions of a page, of the plant's own without a name."""
    return read_questions((FOLDER / page).glob("*.rq"))


def render(name: str, answers: Answers, bindings: Mapping[str, str], **values: Any) -> str:
    """Return a page; `answers` and `bindings` are shown as the questions behind it, links are those of `base`."""
    template = _templates(values.get("base", ID)).get_template(f"plant/{name}")
    rows = {question: answer.rows for question, answer in answers.items()}
    return template.render(
        answers=answers,
        rows=rows,
        bindings=bindings,
        **{
            "number": 1,
            "tariff": next(iter(rows.get("tariff", ())), None),
            "graph_stands": None,
            "curves": None,
            "actions": (),
            "writable": False,
            "refused": "",
            "said": None,
            "fewest": FEWEST,
            "asked": choice.ALL,
            "groups": choice.GROUPS,
            "sorts": choice.SORTS,
            "screen": SCREEN,
            **values,
        },
    )


def compile_templates(base: str) -> None:
    """Compile the templates of all pages, so that who asks for the first does not wait for it."""
    templates = _templates(base)
    for name in templates.list_templates(extensions=["jinja"]):
        if name.startswith(("plant/", "layout/")):
            templates.get_template(name)


@cache
def _templates(base: str) -> jinja2.Environment:
    loader = jinja2.FileSystemLoader(FOLDER.parent)  # pages of the plant have rooms of their own
    templates = environment(resources.shipped()).overlay(loader=loader)
    of_base = {
        function.__name__: partial(function, base=base) for function in (links.page_of, links.individual, links.tail)
    }
    own = {"kwh": kwh, "spaced": _spaced, "pages": pages, "on_page": on_page}
    templates.filters = templates.filters | of_base | own
    return templates


def pages(lines: Sequence[object], size: int = PAGE) -> int:
    """Return how many pages of a size so many lines take, one at least."""
    return max(1, -(-len(lines) // size))


def on_page(lines: Sequence[T], number: int, size: int = PAGE) -> Sequence[T]:
    """Return the lines of a page, the first of which is 1; beyond the last, those of the last."""
    start = (min(number, pages(lines, size)) - 1) * size
    return lines[start : start + size]


def page_number(text: str | None) -> int:
    """Return the page that an address asks for; the first where it says none, or nonsense."""
    return max(1, int(text)) if text and text.isascii() and text.isdigit() and len(text) < 10 else 1


def _spaced(text: str | None) -> str:
    """Write a key as words: "dc_bus" -> "dc bus"."""
    return (text or "").replace("_", " ")
