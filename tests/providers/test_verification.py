"""What a change saved: against sums by hand, and how often the interval holds the truth."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sqlalchemy import delete
from sqlalchemy.orm import Session
from tests import rows, small_fleet

from irtwin.asserting import follow
from irtwin.knowledge.asserted.statements import read
from irtwin.knowledge.questions.queries import ask
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_ASSERTED
from irtwin.providers.planner import ready, renew
from irtwin.providers.verification import TakenEnergy, verification
from irtwin.rewriting import map_rows
from irtwin.storage import schema
from irtwin.storage.database import Workspace

DAY = "2026-03-10"


def run(day: str, energy_j: float, **said: Any) -> TakenEnergy:
    return TakenEnergy(day, energy_j, **{"time_s": 3600.0, "payload_kg": 1.0, **said})


BEFORE = [run("2026-03-01", joules) for joules in (98.0, 100.0, 102.0)]
AFTER = [run("2026-03-20", joules) for joules in (89.0, 90.0, 91.0, 90.0)]


def test_a_saving_is_the_adjusted_baseline_less_what_was_measured() -> None:
    found = verification([*BEFORE, *AFTER], DAY)
    assert (found.result, found.compared_for, found.runs_before, found.runs_after) == ("verified", "hour", 3, 4)
    assert (found.adjusted_baseline_j, found.saving_j) == pytest.approx((400.0, 40.0))
    # variances of the means: 4/3 and (2/3)/4, times 4²; Welch's degrees of freedom 2.51
    assert found.saving_upper_j - found.saving_j == pytest.approx(3.5682 * 4 * (4 / 3 + 1 / 6) ** 0.5, rel=1e-3)
    assert (found.saving_lower_j + found.saving_upper_j) / 2 == pytest.approx(40.0)


def test_it_is_adjusted_to_what_was_made() -> None:
    twice = [run("2026-03-20", 2 * one.energy_j, time_s=7200.0) for one in AFTER]
    assert verification([*BEFORE, *twice], DAY).saving_j == pytest.approx(80.0)
    pieces = [replace(one, pieces=10) for one in BEFORE] + [replace(one, pieces=5) for one in AFTER]
    fewer = verification(pieces, DAY)
    assert (fewer.compared_for, fewer.result) == ("piece", "not verified")
    assert fewer.saving_j == pytest.approx(20 * 10.0 - 360.0)
    assert verification([*pieces, run("2026-03-02", 100.0)], DAY).compared_for == "hour"  # one that counts none


def test_another_product_is_no_saving() -> None:
    heavy, light = ([replace(one, product=name) for one in AFTER] for name in ("heavy", "light"))
    early = [replace(one, product="heavy") for one in BEFORE]
    assert verification([*early, *light], DAY).result == "too few runs"
    mixed = verification([*early, *heavy, *light], DAY)
    assert (mixed.runs_before, mixed.runs_after, mixed.saving_j) == (3, 4, pytest.approx(40.0))
    assert verification([*BEFORE, *[replace(one, payload_kg=5.0) for one in AFTER]], DAY).result == "too few runs"


def test_runs_of_the_day_and_beyond_the_next_change_count_on_neither_side() -> None:
    others = [run(DAY, 1e9), run("2026-02-01", 1e9), run("2026-04-01", 1e9)]
    assert verification([*BEFORE, *AFTER, *others], DAY, after="2026-02-10", until="2026-03-25").saving_j == (
        pytest.approx(40.0)
    )


@pytest.mark.parametrize(("runs", "counts"), [([], (0, 0)), (BEFORE, (3, 0)), ([*BEFORE, *AFTER[:2]], (3, 2))])
def test_too_few_runs_are_told(runs: list[TakenEnergy], counts: tuple[int, int]) -> None:
    found = verification(runs, DAY)
    assert (found.result, found.adjusted_baseline_j, (found.runs_before, found.runs_after)) == (
        "too few runs",
        None,
        counts,
    )


def test_runs_without_any_scatter_have_no_interval() -> None:
    same = [*[run("2026-03-01", 10.0)] * 3, *[run("2026-03-20", 9.0)] * 3]
    found = verification(same, DAY)
    assert (found.saving_lower_j, found.saving_upper_j, found.result) == (found.saving_j, found.saving_j, "verified")


@pytest.mark.parametrize(("saved", "counts"), [(0.0, (5, 5)), (0.1, (8, 4))])
def test_nineteen_of_twenty_intervals_hold_what_was_saved(saved: float, counts: tuple[int, int]) -> None:
    rng, held, verified, tries = np.random.default_rng(7), 0, 0, 400
    for _ in range(tries):
        pieces = [rng.integers(10, 30, count) for count in counts]
        rates = (100.0, 100.0 * (1.0 - saved))
        runs = [
            run(day, rate * made + 20.0 * np.sqrt(made) * rng.normal(), pieces=made)
            for day, rate, side in zip(("2026-03-01", "2026-03-20"), rates, pieces, strict=True)
            for made in side
        ]
        found = verification(runs, DAY)
        held += found.saving_lower_j <= 100.0 * saved * pieces[1].sum() <= found.saving_upper_j
        verified += found.result == "verified"
    assert 0.92 < held / tries < 0.99
    assert verified / tries < 0.05 if saved == 0.0 else verified / tries > 0.8


ACTION = "id:saving_action\\/Arm_B\\/switch_off_while_waiting"
DONE = f"INSERT DATA {{ {ACTION} a irt:Saving_Action ; irt:saves_at id:robot\\/Arm_B ; irt:Done_On '2026-04-05' }}"
OURS = "INSERT DATA { <urn:ours> a irt:Saving_Action ; irt:saves_at id:robot\\/Arm_B ; irt:Done_On '%s' }"


def take(place: Workspace, name: str, day: str, energy_j: float) -> None:
    """Keep a run of Arm_B of an hour with its measured energy, as `irtwin live` does."""
    run_id, start = f"Arm_B.{name}", datetime.fromisoformat(day)
    row = rows.run(
        name, run_id=run_id, robot_id="Arm_B", kind=schema.LIVE_RUN, role=None, product="bolts", start_time=start,
        started=start, ended=start + timedelta(hours=1), run_time_s=3600.0, file="", sha256=run_id,
    )  # fmt: skip
    by = rows.activity(f"live.{run_id}", "live", f"run/{run_id}", "Arm_B")
    energy = schema.RunEnergy(
        run_id=run_id, energy_consumption_j=energy_j, energy_from="measured", run_power_w=1.0, peak_power_w=1.0,
        measured_energy_j=energy_j, activity_id=by.activity_id,
    )  # fmt: skip
    used = schema.ActivityUse(activity_id=by.activity_id, entity=f"run/{run_id}", relation="wasInformedBy")
    with Session(place.engine) as session, session.begin():
        for one in (row, by, energy, used):
            session.add(one)
            session.flush()


@pytest.fixture
def opened(tmp_path: Path) -> Iterator[tuple[Workspace, KnowledgeGraph]]:
    """A workspace of four robots; Arm_B took 100 J three times in April, and 90 J twice since."""
    with Workspace(tmp_path) as place, KnowledgeGraph(tmp_path / "graph", tmp_path, None, place.base) as graph:
        small_fleet.fill(place)
        for number, joules in enumerate((99.0, 100.0, 101.0)):
            take(place, f"before_{number}", "2026-04-01", joules)
        for number, joules in enumerate((89.9, 90.1)):
            take(place, f"after_{number}", "2026-04-10", joules)
        graph.load_ontology()
        map_rows(place, graph)
        yield place, graph


def update(opened: tuple[Workspace, KnowledgeGraph], text: str, whole: bool = False) -> None:
    """Do an update without its check, which takes seconds, and without conclusions unless they are to be drawn."""
    place, graph = opened
    with place.reading() as session:
        assertion = read(graph, session, *graph.difference(text), "anna")
        session.expunge_all()
    place.keep_facts(assertion.facts, assertion.withdrawn)
    if whole:
        return follow(place, graph, assertion)
    map_rows(place, graph)
    renew(place, graph, lambda: map_rows(place, graph))


def told(graph: KnowledgeGraph) -> dict[str, Any]:
    asked = "SELECT ?result ?before ?after ?saved { ?one irt:Verification_Result ?result ; irt:Runs_Before ?before ; "
    asked += "irt:Runs_After ?after OPTIONAL { ?one irt:Verified_Saving ?saved } FILTER(CONTAINS(STR(?one), 'Arm_B')) }"
    (row,) = graph.query(asked) or [{}]
    return dict(row)


def test_what_is_done_is_verified_and_anew_with_each_run(opened: tuple[Workspace, KnowledgeGraph]) -> None:
    place, graph = opened
    update(opened, DONE)
    assert told(graph) == {"result": "too few runs", "before": 5, "after": 2, "saved": None}
    assert "verification" not in ready(graph)
    take(place, "after_2", "2026-04-11", 90.0)
    map_rows(place, graph)
    assert [iri.rpartition("Arm_B/")[2] for iri in ready(graph)["verification"]] == ["switch_off_while_waiting"]
    update(opened, "INSERT DATA { <urn:shop> rdfs:label 'shop' }", whole=True)
    assert told(graph) == {"result": "verified", "before": 3, "after": 3, "saved": pytest.approx(30.0)}
    row = next(row for row in ask(graph, "saving_actions") if row["done_on"])
    assert (row["state"], row["saved_kWh"]) == ("verified", pytest.approx(30.0 / 3.6e6))
    assert not graph.query("SELECT ?one { ?one irt:ready_for provider:verification }")
    with Session(place.engine) as session, session.begin():
        for kind in (schema.RunEnergy, schema.RunRow):
            session.execute(delete(kind).where(kind.run_id == "Arm_B.after_2"))
    map_rows(place, graph)
    renew(place, graph, lambda: map_rows(place, graph))
    assert told(graph)["result"] == "too few runs"


def test_it_is_anew_with_what_is_asserted_and_goes_with_it(opened: tuple[Workspace, KnowledgeGraph]) -> None:
    place, graph = opened
    take(place, "after_2", "2026-04-11", 90.0)
    update(opened, DONE)
    assert told(graph)["result"] == "verified"
    update(opened, OURS % "2026-04-11")  # of that day on the robot is another
    assert (told(graph)["result"], told(graph)["after"]) == ("too few runs", 2)
    update(opened, f"DELETE WHERE {{ GRAPH <{GRAPH_ASSERTED}> {{ <urn:ours> ?said ?of_it }} }}")
    assert told(graph)["result"] == "verified"
    update(opened, "DELETE { GRAPH ?g { ?run irt:Product 'bolts' } } INSERT { GRAPH ?g { ?run irt:Product 'nuts' } } "
        "WHERE { GRAPH ?g { ?run irt:Product 'bolts' FILTER(CONTAINS(STR(?run), 'after')) } }")  # fmt: skip
    assert told(graph)["result"] == "too few runs"
    update(opened, f"DELETE WHERE {{ GRAPH <{GRAPH_ASSERTED}> {{ {ACTION} ?said ?of_it }} }}")
    assert told(graph) == {}
    assert "verification" not in ready(graph)
