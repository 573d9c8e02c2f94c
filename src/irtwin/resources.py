"""Where the ontology, rules, mappings and report templates lie.

They stand at the top of the source tree, for people who read them, and inside the package once it is installed.
"""

from __future__ import annotations

from pathlib import Path

_PACKAGE = Path(__file__).parent


def folder(name: str) -> Path:
    """Return the folder `ontology`, `rules`, `mappings`, `reports` or `demo`."""
    installed = _PACKAGE / name
    return installed if installed.is_dir() else _PACKAGE.parents[1] / name
