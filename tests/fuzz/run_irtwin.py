"""The command line in this process, with everything imported and what ships read."""

from __future__ import annotations

import gc
import importlib
import pkgutil
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import irtwin
import irtwin.cli
from irtwin.knowledge.parts import Ontology
from irtwin.knowledge.reasoning import reason
from irtwin.knowledge.shacl.validation import validate
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.report.templates import environment
from irtwin.resources import shipped
from irtwin.rewriting import map_rows
from irtwin.storage.database import Workspace

_SELDOM = ("pyarrow.dataset", "rosbags.highlevel", "sympy", "toppra")  # packages that few commands import


def _read_what_ships() -> None:
    """Do here, once, what each child would do anew: ontology, rules, shapes and templates are worked out for seconds.

    No store is opened on disk: a fork would lack its threads. What was read moves out of the collector's sight, else
    each child's first collection copies all of it.
    """
    for module in pkgutil.walk_packages(irtwin.__path__, "irtwin."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)
    for name in _SELDOM:
        importlib.import_module(name)
    graph = KnowledgeGraph()
    graph.load_ontology()
    _ = Ontology.of(graph).schema
    reason(graph)
    validate(graph)
    with tempfile.TemporaryDirectory() as folder, Workspace(Path(folder)) as place:
        map_rows(place, graph)
    templates = environment(shipped())
    for file in shipped().of("reports", ".html.jinja"):
        if file.name.startswith(("energy/", "gap/", "layout/")):  # others have filters of their own
            templates.get_template(file.name)
    gc.collect()
    gc.freeze()


_read_what_ships()


def run_irtwin(arguments: Sequence[str]) -> None:
    """Do as `irtwin ARGUMENTS...` does."""
    sys.argv = ["irtwin", *arguments]
    irtwin.cli.main()
