"""The word of a test's user: what a workspace's own files ask for is allowed."""

from __future__ import annotations

from pathlib import Path

from irtwin.trust import trust
from irtwin.upkeep import asked


def trust_all(workspace: Path) -> Path:
    """Do as `irtwin workspace trust WORKSPACE`; return the workspace."""
    trust(workspace, asked(workspace))
    return workspace
