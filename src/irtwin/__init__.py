"""A digital twin of an industrial robot's energy, held in a knowledge graph.

As a library: `read_data_set` reads a data set, `identify` fits a `Twin` to it, `predict` says what the twin expects of
a run, `diagnose` says where twin and robot differ and why, a `Diagnosis` whose `document` is what JSON, graph and page
say; `read_urdf` gives a `Robot`, `catalogue` the effects.
With a workspace: `run`, `adopt`, `ask`, `export`; a `Location` names one whose database or graph is kept elsewhere.
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
    "diagnose",
    "export",
    "identify",
    "predict",
    "read_data_set",
    "read_urdf",
    "run",
]

if TYPE_CHECKING:
    from irtwin.asking import ask, export
    from irtwin.diagnosing import diagnose
    from irtwin.effects.catalogue import catalogue
    from irtwin.gap.diagnosis import Diagnosis
    from irtwin.location import Location
    from irtwin.modelling import identify, predict
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
    "diagnose": "diagnosing",
    "export": "asking",
    "identify": "modelling",
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
