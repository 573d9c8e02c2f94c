"""Where a workspace is: its folder, and what of it is kept elsewhere."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Self

WORKSPACE = Path("irtwin-workspace")


@dataclass(frozen=True)
class Location:
    """A workspace's folder; the URLs of its database (SQLAlchemy) and of the SPARQL server that keeps its graph.

    Without them both lie in the folder. They may hold passwords: they are shown nowhere.
    """

    folder: Path = WORKSPACE
    database: str | None = field(default=None, repr=False)
    graph_url: str | None = field(default=None, repr=False)

    @classmethod
    def of(cls, workspace: Location | Path | str) -> Location:
        """Return the location that a workspace's folder is, or the location itself."""
        return workspace if isinstance(workspace, Location) else cls(Path(workspace))

    @classmethod
    def told(cls, document: dict[str, Any]) -> Self:
        """Return the location that `telling` told of."""
        return cls(Path(document["folder"]), document["database"], document["graph_url"])

    def telling(self) -> dict[str, str | None]:
        """Return it as a JSON object, for another process."""
        return {**asdict(self), "folder": str(self.folder)}

    @property
    def graph_folder(self) -> Path:
        """Where the graph lies if no server keeps it."""
        return self.folder / "graph"
