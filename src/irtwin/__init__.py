"""A digital twin of an industrial robot's energy, held in a knowledge graph.

As a library: `read_data_set` reads a data set, `identify` fits a `Twin` to it, `predict` says what the twin expects of
a run, `diagnose` says where twin and robot differ and why, a `Diagnosis` whose `document` is what JSON, graph and page
say; `read_urdf` gives a `Robot`, `catalogue` the effects.
`import_logs` makes a data set of logs in other formats, and `check_log` says what is wrong with one.
With a workspace: `run`, `adopt`, `ask`, `explain`, `export`, `optimise`; a `Location` names one whose
database or graph is kept elsewhere.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.2.0"
__all__ = [
    "DataSet",
    "Diagnosis",
    "Location",
    "Robot",
    "Twin",
    "adopt",
    "ask",
    "catalogue",
    "check_log",
    "diagnose",
    "explain",
    "export",
    "identify",
    "import_logs",
    "optimise",
    "predict",
    "read_data_set",
    "read_urdf",
    "run",
]

if TYPE_CHECKING:
    from irtwin.asking import ask, explain, export
    from irtwin.bring.bring import import_logs
    from irtwin.diagnosing import diagnose
    from irtwin.effects.catalogue import catalogue
    from irtwin.gap.diagnosis import Diagnosis
    from irtwin.location import Location
    from irtwin.modelling import check_log, identify, predict
    from irtwin.plans import optimise
    from irtwin.robot.description import Robot
    from irtwin.robot.urdf import read_urdf
    from irtwin.signals.log import DataSet, read_data_set
    from irtwin.twin.twin import Twin
    from irtwin.workflow import adopt, run

_MODULES = {
    "DataSet": "signals.log",
    "Diagnosis": "gap.diagnosis",
    "Location": "location",
    "Robot": "robot.description",
    "Twin": "twin.twin",
    "adopt": "workflow",
    "ask": "asking",
    "catalogue": "effects.catalogue",
    "check_log": "modelling",
    "diagnose": "diagnosing",
    "explain": "asking",
    "export": "asking",
    "identify": "modelling",
    "import_logs": "bring.bring",
    "optimise": "plans",
    "predict": "modelling",
    "read_data_set": "signals.log",
    "read_urdf": "robot.urdf",
    "run": "workflow",
}


def __getattr__(name: str) -> Any:
    """Import what is asked for when it is first used: `irtwin --help` need not wait for it."""
    if name in _MODULES:
        return getattr(import_module(f"irtwin.{_MODULES[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    """Offer the names to completion, also those not imported yet."""
    return [*globals(), *__all__]
