"""The command line in this process, with everything imported."""

from __future__ import annotations

import importlib
import pkgutil
import sys
from collections.abc import Sequence

import irtwin
import irtwin.cli

for _module in pkgutil.walk_packages(irtwin.__path__, "irtwin."):  # here, once, not in each child
    if not _module.name.endswith("__main__"):
        importlib.import_module(_module.name)


def run_irtwin(arguments: Sequence[str]) -> None:
    """Do as `irtwin ARGUMENTS...` does."""
    sys.argv = ["irtwin", *arguments]
    irtwin.cli.main()
