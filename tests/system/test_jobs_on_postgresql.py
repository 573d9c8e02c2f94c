"""A robot with its rows in a real PostgreSQL: a plan is made, watched while it is carried out, the twin bettered."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from sqlalchemy import select
from tests import data_sets, test_plans
from tests.data_sets import Said
from tests.data_sets import irtwin as in_this_process
from tests.synthetic import as_run, measure, swing

from irtwin import asking, workflow
from irtwin.knowledge.shacl.validation import validate
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.live.known_robots import StoredTimes
from irtwin.location import Location
from irtwin.storage.database import Workspace
from irtwin.storage.schema import WATCHED_RUNS, ImprovementRound, RunRow

pytestmark = [pytest.mark.system, pytest.mark.slow]


@dataclass(frozen=True)
class Plant:
    """A workspace with its database, and the motion that was planned in it."""

    at: Location
    reach: Path

    def irtwin(self, *arguments: object) -> Said:
        said = in_this_process(*arguments, "--workspace", self.at.folder, "--database", self.at.database)
        assert said.status == 0, said.err
        return said

    def open(self) -> Workspace:
        return Workspace.existing(self.at)


@pytest.fixture(scope="module")
def plant(tmp_path_factory: pytest.TempPathFactory, new_postgresql_database: Callable[[], str]) -> Plant:
    """A robot with a plan that is kept, and that was watched while it carried the plan out."""
    folder, url = tmp_path_factory.mktemp("plant"), new_postgresql_database()
    made = Plant(Location(folder / "w", url), folder / "reach.parquet")
    workflow.run(test_plans.write(folder / "logs", test_plans.recorded()), made.at)
    made.irtwin("plan", "arm_2", *test_plans.GOAL, "--out", made.reach)
    done = test_plans.write(folder / "done", [test_plans.carried_out(made.reach)]) / "runs" / "done.parquet"
    made.irtwin("live", "--replay", done, "--robot", "arm_2", "--speed", 1000, "--performs", "reach")
    return made


def live_run(plant: Plant) -> RunRow:
    with plant.open() as place, place.reading() as session:
        return session.scalars(select(RunRow).where(RunRow.kind.in_(WATCHED_RUNS))).one()


@pytest.mark.nightly
def test_a_plan_is_held_against_the_run_that_was_watched(plant: Plant) -> None:
    (row,) = asking.ask("planned_against_measured", plant.at.folder)
    assert (row["plan"], row["run"]) == ("reach", live_run(plant).name)
    with plant.open() as place, KnowledgeGraph.of_workspace(place) as graph:
        assert validate(graph) == ()
        (energy,) = graph.query("SELECT ?joules { ?run a irt:Replayed_Run ; irt:Modelled_Energy ?joules }")
        (sampled,) = graph.query(
            "SELECT (series:integral(?run, 'power', 0, 1e9) AS ?joules) { ?run a irt:Replayed_Run }"
        )
    assert energy["joules"] == pytest.approx(sampled["joules"], rel=0.05)
    assert row["measured_Wh"] * 3600 == pytest.approx(sampled["joules"], rel=1e-4)


@pytest.mark.nightly
def test_a_sample_that_was_stored_is_known_by_its_time(plant: Plant) -> None:
    run = live_run(plant)
    assert (run.ended - run.started).total_seconds() == pytest.approx(run.run_time_s, abs=2e-6)
    with plant.open() as place:
        times = StoredTimes(place)
    middle = run.started.timestamp() + run.run_time_s / 2
    assert times.run_in("arm_2", middle, middle) == run.run_id
    assert times.end("arm_2") == pytest.approx(run.ended.timestamp(), abs=1e-5)
    later = run.ended.timestamp() + 1.0
    assert times.run_in("arm_2", later, later) is None


@pytest.mark.nightly
def test_a_new_log_betters_the_twin_or_leaves_it(plant: Plant) -> None:
    again = as_run(measure(test_plans.ROBOT, swing(test_plans.ROBOT, 9, seconds=8.0), noise=0.02))
    log = plant.at.folder.parent / "again.parquet"
    pq.write_table(data_sets.table(test_plans.ROBOT, again), log)
    said = plant.irtwin("improve", "arm_2", log)
    assert said.out.startswith("round 1, same effects: ")
    with plant.open() as place, place.reading() as session:
        (row,) = session.scalars(select(ImprovementRound))
    assert (row.number, row.robot_id) == (1, "arm_2")
    (shown,) = asking.ask("improvement_rounds", plant.at.folder)
    assert shown["after_percent"] == pytest.approx(row.error_after_percent)
