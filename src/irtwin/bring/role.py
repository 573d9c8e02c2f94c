"""Whose logs those are that are brought: the robot's, its healthy past's, a simulator's."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from irtwin.bring.told import fits
from irtwin.errors import InputError
from irtwin.signals.log import ROLES


def roles(files: Sequence[Path], said: Iterable[str]) -> Mapping[Path, str]:
    """Return each file's role, as ROLE and FILE=ROLE say, the last that fits it; else "observed".

    FILE is a path as it is given or a name, with * for any letters. Raises InputError where one names no role or file.
    """
    found = dict.fromkeys(files, ROLES[0])
    for text in said:
        pattern, _, role = text.rpartition("=")
        if role not in ROLES:
            raise InputError(f"--role {text}: give ROLE or FILE=ROLE, where ROLE is {', '.join(ROLES)}")
        named = [file for file in files if not pattern or any(fits(pattern, one) for one in (str(file), file.name))]
        if not named:
            raise InputError(f"--role {text}: no such file is brought; there are {', '.join(map(str, files[:12]))}")
        found |= dict.fromkeys(named, role)
    return found
