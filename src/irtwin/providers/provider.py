"""What a data provider is, and how providers are found."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import EntryPoint, entry_points, version

import pyarrow as pa

from irtwin.errors import InputError
from irtwin.providers.names import robot_iri
from irtwin.storage.database import Workspace
from irtwin.storage.schema import METER, Activity, Base

GROUP = "irtwin.providers"


@dataclass(frozen=True)
class Made:
    """What a provider made of one individual: rows, modelled series by run_id, documents by path, IRIs it read.

    `metered` are the IRIs that the energy taken was read from where a meter says it; nothing else was asked for that.
    """

    robot_id: str
    used: Sequence[str]
    rows: Sequence[Base]
    series: Mapping[str, pa.Table] = field(default_factory=dict)
    documents: Mapping[str, bytes] = field(default_factory=dict)
    metered: Sequence[str] = ()


# A provider works on one individual, named by its key in the database: a robot_id, a run_id, or of any other kind its
# IRI below the workspace's base.
Provider = Callable[[Workspace, str], Made]


def load_provider(name: str) -> Provider:
    """Return the provider that an installed package registers under `name` in the group `irtwin.providers`.

    Raises InputError where none does: the ontology then declares a provider that nobody offers.
    """
    provider: Provider = _entry_point(name).load()
    return provider


def software_of(name: str) -> str:
    """Return name and version of the package that registers a provider, such as "irtwin 0.1.0"."""
    package = _entry_point(name).dist
    return software() if package is None else f"{package.name} {package.version}"


def software() -> str:
    """Return irtwin's own name and version."""
    return f"irtwin {version('irtwin')}"


def activity(provider: str, robot_id: str, subject: str, started: datetime, by: str | None = None) -> Activity:
    """Return the activity of a provider, which ends now, on a subject, by its IRI below the base.

    by: name and version of the package that did it, irtwin's if None.
    """
    return Activity(
        activity_id=f"{provider}.{subject.rpartition('/')[2]}.{started:%Y%m%dT%H%M%S%f}",
        robot_id=robot_id,
        provider=provider,
        subject=subject,
        started=started,
        ended=datetime.now(UTC),
        software=by or software(),
    )


def keep(
    workspace: Workspace,
    provider: str,
    made: Made,
    started: datetime,
    subject: str | None = None,
    by: str | None = None,
    instead_of: str | None = None,
) -> None:
    """Keep what a provider made, in place of what it, or the provider `instead_of`, made of the same subject.

    subject: its IRI below the base, the robot's if None; by: as of `activity`.
    """
    of = made.robot_id, subject or robot_iri(made.robot_id), started, by
    metered = (activity(METER, *of), made.metered) if made.metered else None
    result = made.used, made.rows, made.series, made.documents
    workspace.replace_activity(activity(provider, *of), *result, instead_of=instead_of, metered=metered)


@cache  # all installed packages are looked through: as long as a small run takes in a provider
def registered() -> dict[str, EntryPoint]:
    """Return what installed packages register as providers, by name."""
    return {point.name: point for point in entry_points(group=GROUP)}


def _entry_point(name: str) -> EntryPoint:
    if name not in registered():
        raise InputError(
            f'provider "{name}" is declared in the ontology, but no installed package registers it as an entry '
            f"point of {GROUP}; install that package, or remove the declaration"
        )
    return registered()[name]
