"""The gap report of a diagnosis that no workspace keeps."""

from __future__ import annotations

import re
import tempfile
from dataclasses import replace
from pathlib import Path

import pytest
from tests import gap_cases
from tests.gap_pages import graph_of
from tests.synthetic import arm, as_run, measure, swing

from irtwin.providers.gap import record
from irtwin.providers.names import identifier, robot_iri
from irtwin.providers.records import ingest
from irtwin.report.gap.page import render_alone, render_gap
from irtwin.robot.urdf import parse_urdf
from irtwin.signals.log import DataSet
from irtwin.storage.database import Workspace

_OF_THIS_TIME = re.compile(r"diagnosis\.arm_6\.\w+|[-\d]+ [:\d]+ UTC")


@pytest.fixture(scope="module")
def data_set() -> DataSet:
    """The robot and the runs of `gap_cases`."""
    robot = parse_urdf(arm(6).urdf.replace("joint_", "joint_a"))
    run = as_run(measure(robot, swing(robot, 0, seconds=2)))
    runs = [replace(run, name=name, role="reference" if "ref" in name else "observed") for name in gap_cases.RUNS]
    return DataSet(Path("arm"), robot, tuple(runs), None, 20.0, "dc_bus", simulated=False, notes={})


@pytest.mark.slow
@pytest.mark.parametrize(
    "verdict",
    [
        pytest.param(verdict, marks=() if verdict in ("attributed", "ambiguous") else pytest.mark.nightly)
        for verdict in gap_cases.VERDICTS
    ],
)
def test_it_is_the_page_of_a_workspace_and_no_other_file(
    verdict: str, data_set: DataSet, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    said, drawn, kept, alone = gap_cases.document(verdict), gap_cases.curves(verdict), "kept.html", tmp_path / "alone"
    with Workspace(tmp_path / "w") as workspace:
        robot_id = identifier(data_set.robot.name)
        ingest(workspace, data_set)
        record(workspace, robot_id, said, drawn)
        graph = graph_of(workspace)
        render_gap(graph, graph.iri(robot_iri(robot_id)), workspace.read_document, tmp_path / kept)
    alone.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "no such folder"))
    render_alone(data_set, said, drawn, alone / "p.html")
    assert list(alone.iterdir()) == [alone / "p.html"]
    pages = [_OF_THIS_TIME.sub("", page.read_text(encoding="utf-8")) for page in (alone / "p.html", tmp_path / kept)]
    assert pages[0] == pages[1]
