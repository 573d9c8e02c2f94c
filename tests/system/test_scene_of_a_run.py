"""A page in headless Chromium: the scene performs each run, and ends with the energy that the graph gives."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest
from tests.playing import play
from tests.screens import complaints_of

from irtwin.asking import ask

pytestmark = pytest.mark.system
ENERGY = """PREFIX irt: <https://w3id.org/irtwin#>
SELECT ?name ?energy { ?run irt:Run_Name ?name ; irt:Modelled_Energy ?energy } ORDER BY ?name"""
SEEK = "time => document.dispatchEvent(new CustomEvent('irtwin:time', {detail: {time}}))"
JOULES = {"Wh": 3.6e3, "kWh": 3.6e6}


@pytest.mark.nightly
def test_each_run_ends_with_the_energy_of_the_graph(browser: Any, small_run: Path, tmp_path: Path) -> None:
    workspace = Path(shutil.copytree(small_run / "workspace", tmp_path / "w"))
    report = workspace / "reports" / "Arm.html"
    known = {row["name"]: row["energy"] for row in ask(ENERGY, workspace).rows}
    assert len(known) == 3
    assert report.stat().st_size < 6_000_000
    page = browser.new_page()
    complaints = complaints_of(page)
    page.goto(report.as_uri())
    page.wait_for_selector("#figure-torque .scatterlayer .trace")
    for name, energy in known.items():
        page.select_option(".is-run", label=name)
        assert page.locator("#run-choice option:checked").inner_text() == name
        page.evaluate(SEEK, 1e9)
        unit = JOULES[page.inner_text(".is-energy-unit")]
        assert float(page.inner_text(".is-energy")) * unit == pytest.approx(energy, rel=1e-3)
        page.evaluate(SEEK, 2.0)
        assert page.locator("#figure-torque .cursor:visible").count() == 2
    play(page)
    assert complaints == []
