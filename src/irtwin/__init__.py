"""A digital twin of an industrial robot's energy, held in a knowledge graph.

As a library: `read_data_set` reads a data set, `identify` fits a `Twin` to it, `predict` says what the twin expects of
a run, `diagnose` says where twin and robot differ and why, a `Diagnosis` whose `document` is what JSON, graph and page
say, `play` how far a simulator's model is from its robot; `read_urdf` gives a `Robot`, `catalogue` the effects.
`import_logs` makes a data set of logs in other formats, and `check_log` says what is wrong with one.
With a workspace: `run`, `adopt`, `ask`, `explain`, `export`, `optimise`; a `Location` names one whose
database or graph is kept elsewhere.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.2.0"
if TYPE_CHECKING:
    from irtwin.asking import ask as ask
    from irtwin.asking import explain as explain
    from irtwin.asking import export as export
    from irtwin.bring.bring import import_logs as import_logs
    from irtwin.diagnosing import diagnose as diagnose
    from irtwin.diagnosing import play as play
    from irtwin.effects.catalogue import catalogue as catalogue
    from irtwin.gap.diagnosis import Diagnosis as Diagnosis
    from irtwin.location import Location as Location
    from irtwin.modelling import check_log as check_log
    from irtwin.modelling import identify as identify
    from irtwin.modelling import predict as predict
    from irtwin.plans import optimise as optimise
    from irtwin.robot.description import Robot as Robot
    from irtwin.robot.urdf import read_urdf as read_urdf
    from irtwin.signals.log import DataSet as DataSet
    from irtwin.signals.log import read_data_set as read_data_set
    from irtwin.twin.twin import Twin as Twin
    from irtwin.workflow import adopt as adopt
    from irtwin.workflow import run as run

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
    "play": "diagnosing",
    "predict": "modelling",
    "read_data_set": "signals.log",
    "read_urdf": "robot.urdf",
    "run": "workflow",
}
__all__ = list(_MODULES)


def __getattr__(name: str) -> Any:
    """Import what is asked for when it is first used: `irtwin --help` need not wait for it."""
    if name in _MODULES:
        return getattr(import_module(f"irtwin.{_MODULES[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    """Offer the names to completion, also those not imported yet."""
    return [*globals(), *__all__]
