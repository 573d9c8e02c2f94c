"""What extends a workspace, its reports too, is looked through before it is used."""

from __future__ import annotations

from functools import lru_cache

import jinja2

from irtwin.errors import InputError
from irtwin.input_file import read_text
from irtwin.knowledge import extensions
from irtwin.knowledge.questions.queries import columns_of
from irtwin.report.questions import read_questions
from irtwin.report.templates import environment
from irtwin.resources import MOST_BYTES, Files, Resource, Resources, shipped

_REPORTS = {"energy": {"robot", "twin"}, "gap": {"robot", "diagnosis"}, "layout": set[str]()}  # what is bound in each


def check(resources: Resources) -> None:
    """Raise InputError for the first fault of a file that does not ship; mappings are held to tables elsewhere."""
    extensions.check(resources)
    _check(resources.of("reports"))


@lru_cache(maxsize=16)
def _check(files: Files) -> None:
    for file in files:
        if file.is_extension:
            report = file.name.partition("/")[0]
            if report not in _REPORTS:
                raise InputError(f"{file.path}: there is no report {report}; there are {', '.join(_REPORTS)}")
            if file.name.endswith(".rq"):
                _check_question(file, _REPORTS[report])
            elif file.name.endswith(".html.jinja"):
                _check_template(file, Resources(files))
            else:
                read_text(file.path, MOST_BYTES)


def _check_question(file: Resource, bound: set[str]) -> None:
    try:
        (question,) = read_questions([file.path]).values()
    except KeyError:
        raise InputError(f"{file.path}, line 1: a question begins with `# title: ...`; add that line") from None
    header = read_text(file.path, MOST_BYTES).count("\n") - question.text.count("\n") - 1
    fault = extensions.sparql_fault(question.text)
    if fault is not None:
        raise InputError(f"{file.path}, line {header + fault[0]}, {fault[1]}")
    if not set(question.bind) <= bound:
        raise InputError(f"{file.path}: `# bind:` names what its report has not; take of {', '.join(sorted(bound))}")
    if file.replaces:
        ((replaced,),) = (
            read_questions([resource.path]).values()
            for resource in shipped().of("reports")
            if resource.name == file.name
        )
        lost = set(columns_of(replaced.text)) - set(columns_of(question.text))
        if lost:
            raise InputError(f"{file.path}: does not select ?{min(lost)}, which the page takes from what it replaces")


def _check_template(file: Resource, resources: Resources) -> None:
    try:
        environment(resources).parse(read_text(file.path, MOST_BYTES))
    except jinja2.TemplateSyntaxError as error:
        raise InputError(f"{file.path}, line {error.lineno}: {error.message}") from error
    except RecursionError:
        raise InputError(f"{file.path}: is nested too deep; write it flatter") from None
