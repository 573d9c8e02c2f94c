"""A data set that cannot be worked out does no harm: not to its robot's earlier result, and to no other robot."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest

from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.providers import planner
from irtwin.providers.provider import Made, load_provider
from irtwin.providers.records import ingest
from irtwin.signals.log import read_data_set
from irtwin.storage.database import Workspace
from tests.data_sets import irtwin, refused
from tests.small_robots import data_set, with_signals

pytestmark = pytest.mark.slow

POISONS: dict[str, dict[str, Any]] = {  # what of `data_set` is other than of a good robot
    "one joint": {"joints": 1},
    "no torque": {"change": with_signals(torque=0.0)},
    "no power": {"change": with_signals(power=0.0)},
    "neither": {"change": with_signals(torque=0.0, power=0.0)},
    "at rest": {"change": with_signals(q=0.0)},
    "standby alone": {"tail": '[twin]\neffects = ["standby_power"]'},
    "one joint at rest": {"joints": 1, "change": with_signals(q=0.0)},
}
# A run without power is in test_improvement, too.
AT_NIGHT = ("one joint", "neither", "no power", "standby alone", "one joint at rest")


@pytest.fixture
def folder(small_run: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(small_run, tmp_path / "copy"))


def content(workspace: Path) -> dict[str, object]:
    """Return the bytes of all files that hold data, and the graph's triples, whatever its store's files are."""
    kinds = ("*.parquet", "*.json", "*.html")
    found = [file for kind in kinds for file in workspace.rglob(kind) if file.parent.name != "graph"]
    files = {str(file.relative_to(workspace)): file.read_bytes() for file in found}
    with Workspace(workspace) as place, place.engine.connect() as connection:
        dump = "\n".join(connection.connection.driver_connection.iterdump())  # type: ignore[union-attr]
    with KnowledgeGraph(workspace / "graph") as graph:
        return {**files, "rows": dump, "graph": graph.triples()}


@pytest.mark.parametrize("robot", ["Arm", pytest.param("Bad", marks=pytest.mark.nightly)])
@pytest.mark.parametrize(
    "kind", [pytest.param(kind, marks=pytest.mark.nightly if kind in AT_NIGHT else ()) for kind in POISONS]
)
def test_what_cannot_be_worked_out_changes_nothing(folder: Path, robot: str, kind: str) -> None:
    poison = data_set(folder / "poison", robot, seed=5, **POISONS[kind])
    before = content(folder / "workspace")
    said = irtwin("run", poison, "--workspace", folder / "workspace")
    if said.status:
        assert content(folder / "workspace") == before
        assert said.status == 2
        *steps, line = said.err.splitlines()
        assert line.startswith(f"irtwin: {poison}")
        assert not [step for step in steps if step.startswith("irtwin: ")]
    else:
        assert Path(said.out.strip()).is_file()
        again = irtwin("run", folder / "data", "--workspace", folder / "workspace")
        assert again.status == 0, again.err


def test_the_line_names_the_data_set(folder: Path) -> None:
    poison = data_set(folder / "poison", "Bad", change=with_signals(q=0.0))
    line = refused("run", poison, "--workspace", folder / "workspace").splitlines()[-1]
    assert line.startswith(f"irtwin: {poison}: ")
    assert line.endswith("nothing of this data set was stored")


def test_a_bug_in_a_provider_changes_nothing(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def buggy(workspace: Workspace, key: str) -> Made:
        raise ZeroDivisionError("a bug")

    before = content(folder / "workspace")
    monkeypatch.setattr(planner, "load_provider", lambda name: buggy if name == "energy" else load_provider(name))
    with pytest.raises(ZeroDivisionError, match="a bug"):
        irtwin("run", data_set(folder / "other", "Arm", seed=5), "--workspace", folder / "workspace")
    assert content(folder / "workspace") == before


def test_a_robot_that_cannot_be_worked_out_is_set_aside(folder: Path) -> None:
    """One that an earlier version took in, though no provider accepts it."""
    poison = read_data_set(data_set(folder / "poison", "Bad", change=with_signals(q=0.0)))
    with Workspace(folder / "workspace") as place:
        ingest(place, poison)
    said = irtwin("run", data_set(folder / "third", "Third", seed=7), "--workspace", folder / "workspace")
    assert said.status == 0, said.err
    assert (folder / "workspace" / "reports" / "Third.html").is_file()
    aside = [line for line in said.err.splitlines() if "set aside" in line]
    assert len(aside) == 1
    assert "Bad is set aside: " in aside[0]
    assert "remove it with `irtwin workspace drop Bad`" in aside[0]


@pytest.mark.nightly
def test_two_names_in_other_scripts_are_two_robots(folder: Path) -> None:
    for seed, name in enumerate(("机器人", "人器机", "R 1", "R_1", "x" * 250), start=2):
        done = irtwin("run", data_set(folder / f"{seed}", name, seed=seed), "--workspace", folder / "workspace")
        assert done.status == 0, done.err
        assert Path(done.out.strip()).is_file()
    names = irtwin("query", "SELECT ?name { ?r irt:IR_Name ?name }", "--workspace", folder / "workspace").out
    assert all(name in names for name in ("机器人", "人器机", "R 1", "R_1", "Arm"))
