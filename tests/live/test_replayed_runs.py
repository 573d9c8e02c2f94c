"""A replay is watched like a robot, and no total of consumption counts it, nor what a simulator wrote."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest
from tests.data_sets import done

from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.storage.database import Workspace

pytestmark = pytest.mark.slow

CONSUMPTION = ("fleet_totals", "energy_per_robot", "energy_per_day", "energy_per_month", "energy_per_effect",
               "energy_per_joint", "busiest_days", "fleet_ranking", "standstill_waste")  # fmt: skip


def totals(workspace: Path) -> dict[str, str]:
    return {name: done("query", name, "--workspace", workspace, "--format", "csv") for name in CONSUMPTION}


@pytest.mark.nightly
def test_a_replay_changes_no_total_and_is_said_to_be_one(small_run: Path, tmp_path: Path) -> None:
    workspace = Path(shutil.copytree(small_run / "workspace", tmp_path / "workspace"))
    before = totals(workspace)
    assert all(len(answer.splitlines()) > 1 for answer in before.values())
    log = next((small_run / "data" / "runs").iterdir())
    done("live", "--replay", log, "--robot", "Arm", "--speed", "100", "--workspace", workspace)
    assert totals(workspace) == before
    done("workspace", "reason", "--workspace", workspace)
    assert totals(workspace) == before
    with Workspace.existing(workspace) as place, KnowledgeGraph.of_workspace(place) as graph:
        (run,) = graph.query(
            "SELECT ?energy ?modelled ?took { ?run a irt:Replayed_Run ; irt:Energy_From ?from "
            "OPTIONAL { ?run irt:Modelled_Energy ?modelled } OPTIONAL { ?run irt:Energy_Consumption ?took } }"
        )
        assert run["took"] is None and run["modelled"] is not None
    assert "1 replayed" in done("workspace", "status", "--workspace", workspace)
    done("run", small_run / "data", "--workspace", workspace)  # which keeps it
    assert "1 replayed" in done("workspace", "status", "--workspace", workspace)


@pytest.mark.nightly
def test_what_a_simulator_wrote_is_no_consumption(small_run: Path, tmp_path: Path) -> None:
    data = Path(shutil.copytree(small_run / "data", tmp_path / "data"))
    text = (data / "dataset.toml").read_text(encoding="utf-8")
    head, *runs = text.split("[[run]]")
    simulated = [re.sub('role = "[a-z]+"', 'role = "simulated"', run) for run in runs]
    (data / "dataset.toml").write_text("[[run]]".join([head, *simulated]), encoding="utf-8")
    done("run", data, "--workspace", tmp_path / "workspace")
    with Workspace.existing(tmp_path / "workspace") as place, KnowledgeGraph.of_workspace(place) as graph:
        (count,) = graph.query("SELECT (COUNT(?run) AS ?runs) (COUNT(?took) AS ?energies) { ?run a irt:Simulated_Run "
                               "OPTIONAL { ?run irt:Energy_Consumption ?took } }")  # fmt: skip
        assert count["runs"] == len(runs) and count["energies"] == 0
        (total,) = graph.query("SELECT ?runs ?energy { ?t a irt:Robot_Total ; irt:Run_Count ?runs "
                               "OPTIONAL { ?t irt:Total_Energy ?energy } }")  # fmt: skip
        assert (total["runs"], total["energy"]) == (0, None)
