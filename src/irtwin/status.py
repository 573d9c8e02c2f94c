"""How a workspace stands: its robots and runs, tables and graph, what extends it, and what is wrong with it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib.metadata import version

from sqlalchemy import select

from irtwin.asking import BEHIND, contradictions, in_words, reading, standing
from irtwin.errors import InputError
from irtwin.knowledge.extensions import check_mappings
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_INFERRED
from irtwin.location import Location
from irtwin.report.extensions import check
from irtwin.storage.database import Workspace
from irtwin.storage.engine import shown
from irtwin.storage.journal import left_behind
from irtwin.storage.migration import newest
from irtwin.storage.package_tables import package_tables
from irtwin.storage.schema import LIVE, SIMULATED, Base, RobotRow, RunRow, TwinRow
from irtwin.trust import how, trusted
from irtwin.upkeep import asked, lost_files

_KINDS = {"Measured_Run": "measured", "Planned_Run": "planned", "Live_Run": "live", "Replayed_Run": "replayed"}


@dataclass(frozen=True)
class Status:
    """Lines by heading; `faults` is what is wrong, and empty where nothing is."""

    parts: dict[str, list[str]] = field(default_factory=dict)
    faults: list[str] = field(default_factory=list)

    def lines(self) -> Iterator[str]:
        """Yield all of it, the heading before its first line."""
        width = max(map(len, (*self.parts, "damage"))) + 2
        for heading, parts in {**self.parts, "damage": self.faults or ["none"]}.items():
            for place, line in enumerate(parts):
                yield f"{heading if place == 0 else '':{width}}{line}"

    @contextmanager
    def noting(self) -> Iterator[None]:
        """Note what a user can mend, and go on."""
        try:
            yield
        except InputError as error:
            self.faults.append(str(error))


def status(location: Location) -> Status:
    """Look a workspace through. Raises InputError where there is none, or its database cannot be read."""
    status_now = Status()
    with Workspace.existing(location) as place:
        status_now.parts["workspace"] = [f"{place.folder}, database {shown(place.engine.url)}"]
        status_now.parts["tables"] = _tables()
        status_now.parts["robots"] = _robots(place) or ["none"]
        with status_now.noting():
            _look_at_graph(status_now, place)
        extensions = place.resources.extensions
        told = [f"{file}{', in place of what ships' if file.replaces else ''}" for file in extensions]
        status_now.parts["extensions"] = told or ["none"]
        with status_now.noting():
            may = trusted(place.folder)
            aside = [name for name in asked(place.folder) if name not in may]
            if aside:
                status_now.parts["left aside"] = [*aside, f"not trusted yet; {how(place.folder)}"]
        with status_now.noting():
            check(place.resources)
            check_mappings(place.resources, place.engine)
        status_now.faults.extend(
            f"{journal.stem} is in the graph as it was when `irtwin live` was killed; the next `irtwin live` takes in "
            "its samples, which are on the disk"
            for journal in left_behind(place.folder / LIVE)
        )
        with status_now.noting():
            status_now.faults.extend(lost_files(place))
    return status_now


def _tables() -> list[str]:
    of_packages = {table.name for table in package_tables()}
    own = len(Base.metadata.tables) - len(of_packages)
    return [f"{own} of irtwin {version('irtwin')}, revision {newest()}"] + [
        f"{name}, of a package" for name in sorted(of_packages)
    ]


def _robots(place: Workspace) -> list[str]:
    with place.reading() as session:
        robots = session.scalars(select(RobotRow).order_by(RobotRow.name)).all()
        told = session.execute(select(RunRow.robot_id, RunRow.kind, RunRow.role))
        runs = Counter((robot_id, SIMULATED if role == SIMULATED else _KINDS[kind]) for robot_id, kind, role in told)
        twins = set(session.scalars(select(TwinRow.robot_id)))
    lines = []
    for robot in robots:
        words = [word for word in (*_KINDS.values(), SIMULATED) if runs[robot.robot_id, word]]
        counts = [f"{runs[robot.robot_id, word]} {word}" for word in words]
        report = place.report_path(robot.robot_id)
        lines.append(
            f"{robot.name}: runs: {', '.join(counts) or 'none'}; {'a twin' if robot.robot_id in twins else 'no twin'}; "
            + (f"report {report}" if report.is_file() else "no report")
        )
    return lines


def _look_at_graph(status_now: Status, place: Workspace) -> None:
    if place.location.graph_url is None:
        place.check_graph()
        if not (place.graph_folder / "CURRENT").is_file():
            status_now.parts["graph"] = ["none yet"]
            return
    with reading(place.location) as current:
        graph = current(False)
        status_now.parts["graph"] = [_size(graph)]
        stands = standing(graph, place.folder)
        if stands is not None:
            (status_now.faults if stands == BEHIND else status_now.parts["graph"]).append(
                in_words(stands, place.folder)
            )
        status_now.faults.extend(contradictions(graph) if place.knows_robots() else ())


def _size(graph: KnowledgeGraph) -> str:
    concluded = len(graph.triples(GRAPH_INFERRED))
    count = graph.query("SELECT (COUNT(*) AS ?count) { ?s ?p ?o }").rows[0]["count"]
    return f"{count:,} triples in {len(graph.graphs())} named graphs; rules and reasoning conclude {concluded:,}"
