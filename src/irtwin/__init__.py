"""A digital twin of an industrial robot's energy, held in a knowledge graph."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"
__all__ = ["adopt", "ask", "diagnose", "export", "predict", "run"]

if TYPE_CHECKING:
    from irtwin.workflow import adopt, ask, diagnose, export, predict, run


def __getattr__(name: str) -> Any:
    """Import the workflow when it is first used: `irtwin --help` need not wait for it."""
    if name in __all__:
        from irtwin import workflow

        return getattr(workflow, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
