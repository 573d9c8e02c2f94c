"""A digital twin of an industrial robot's energy, held in a knowledge graph."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"
__all__ = ["adopt", "ask", "diagnose", "export", "predict", "run"]

if TYPE_CHECKING:
    from irtwin.asking import ask, export
    from irtwin.workflow import adopt, diagnose, predict, run


def __getattr__(name: str) -> Any:
    """Import what is asked for when it is first used: `irtwin --help` need not wait for it."""
    if name in ("ask", "export"):
        from irtwin import asking

        return getattr(asking, name)
    if name in __all__:
        from irtwin import workflow

        return getattr(workflow, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
