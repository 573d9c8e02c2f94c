"""What the IRIs of a workspace's individuals begin with: a plant's own, said once, or the ontology's."""

from __future__ import annotations

import re
from pathlib import Path
from urllib.parse import urlsplit

from irtwin.errors import InputError
from irtwin.toml_file import read_toml

DEFAULT = "https://w3id.org/irtwin/id/"
KEY = "base_iri"  # of plant.toml
# What `irtwin serve` has for the first part of its own paths, where no individual can lie.
SERVED = (
    "assets",
    "compare",
    "irtwin",
    "live",
    "query",
    "questions",
    "questions.json",
    "reports",
    "robot",
    "run",
    "saving",
    "say",
    "sparql",
    "tables",
)
_IRI = re.compile(r"[^\x00-\x20<>\"{}|\\^`?#%]+")


def said(file: Path) -> str | None:
    """Return what a workspace's `plant.toml` says of the base, None where it says nothing. InputError where it is none.

    What else stands there is for who needs it to check.
    """
    if not file.exists():
        return None
    base = read_toml(file).get(KEY)
    return None if base is None else checked(base, str(file))


def checked(base: object, where: str) -> str:
    """Return a base that individuals can lie below. Raises InputError, which begins with `where`."""
    if not isinstance(base, str) or not _IRI.fullmatch(base):
        raise InputError(f"{where}: {KEY} is an IRI, as https://plant.example/energy/, not {base!r}")
    try:
        address = urlsplit(base)
        parts = address.path.split("/")
    except ValueError:
        raise InputError(
            f"{where}: {KEY} cannot be read: {base!r}; write it as https://plant.example/energy/"
        ) from None
    if address.scheme not in ("http", "https") or not address.netloc or parts[-1] or len(parts) < 3:
        raise InputError(
            f"{where}: {KEY} begins with http:// or https://, names a host and a path, and ends with /, as "
            f"https://plant.example/energy/; {base!r} does not"
        )
    if "" in parts[1:-1] or {".", ".."} & set(parts):
        raise InputError(f"{where}: {KEY} has an empty part or dots for a part of its path: {base!r}")
    if not base.startswith(DEFAULT) and parts[1] in SERVED:
        raise InputError(
            f"{where}: `irtwin serve` has pages of its own at /{parts[1]}; take another path for {KEY} than {base!r}"
        )
    return base
