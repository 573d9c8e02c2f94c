"""What a data provider is, and how providers are found."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.metadata import entry_points

import pyarrow as pa

from irtwin.errors import InputError
from irtwin.storage.database import Workspace
from irtwin.storage.schema import Base

GROUP = "irtwin.providers"


@dataclass(frozen=True)
class Made:
    """What a provider made of one individual: rows, modelled series by run_id, documents by path, IRIs it read."""

    robot_id: str
    used: Sequence[str]
    rows: Sequence[Base]
    series: Mapping[str, pa.Table] = field(default_factory=dict)
    documents: Mapping[str, bytes] = field(default_factory=dict)


# A provider works on one individual, named by its key in the database: a robot_id or a run_id.
Provider = Callable[[Workspace, str], Made]


def load_provider(name: str) -> Provider:
    """Return the provider that an installed package registers under `name` in the group `irtwin.providers`.

    Raises InputError where none does: the ontology then declares a provider that nobody offers.
    """
    found = [point for point in entry_points(group=GROUP) if point.name == name]
    if not found:
        raise InputError(
            f'provider "{name}" is declared in the ontology, but no installed package registers it as an entry '
            f"point of {GROUP}; install that package, or remove the declaration"
        )
    provider: Provider = found[0].load()
    return provider
