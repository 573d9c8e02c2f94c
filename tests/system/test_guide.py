"""The guide: it builds, with every page in its place, and what its tutorials say is what happens."""

from __future__ import annotations

import html
import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
TUTORIALS = ("first-log", "simulator", "energy", "ask", "cheaper-motion")
TRUE = {  # of docs/notebooks/crane.py
    ("rigid_body", "lift"): 12,
    ("coulomb_friction", "turn"): 6,
    ("coulomb_friction", "lift"): 20,
    ("viscous_friction", "turn"): 9,
    ("viscous_friction", "lift"): 80,
    ("standby_power", "robot"): 90,
}

pytestmark = [pytest.mark.slow, pytest.mark.system]


def test_it_has_a_reference_of_commands_and_python(guide: Path) -> None:
    commands = (guide / "reference" / "commands.html").read_text(encoding="utf-8")
    assert 'id="diagnose"' in commands and "--save-simulator" in commands
    assert "Bring a log" in (guide / "USING.html").read_text(encoding="utf-8")
    assert 'id="irtwin.modelling.identify"' in (guide / "reference" / "python.html").read_text(encoding="utf-8")
    for name in TUTORIALS:
        assert (guide / "tutorials" / f"{name}.html").is_file()


def test_its_notebooks_show_what_is_true_of_their_robot(guide: Path) -> None:
    shown = {page.stem: text_of(page) for page in sorted((guide / "notebooks").glob("*.html"))}
    assert list(shown) == ["1_first_log", "2_simulator", "3_energy", "4_ask", "5_cheaper_motion"]
    numbers = re.findall(r"^(\w+) +(\w+) +([\d.]+) .* to [\d.]+$", shown["1_first_log"], re.M)
    assert {(effect, joint): float(number) for effect, joint, number in numbers} == pytest.approx(TRUE, rel=0.01)
    assert "viscous_friction turn" in shown["2_simulator"] and "Fv: -9.0" in shown["2_simulator"]
    assert "<td>standby power</td>" in shown["3_energy"] and "sha256" in shown["4_ask"]
    saved = re.search(r"(\d+)[\d.]* \+- [\d.]+ J less", shown["5_cheaper_motion"])
    assert int(saved[1]) > 100
    assert all((guide / "notebooks" / f"{name}.ipynb").is_file() for name in shown)


def test_it_shows_pages_and_curves_that_were_made_when_it_was_built(guide: Path) -> None:
    framed = {}
    for page in guide.rglob("*.html"):
        for source in re.findall(r'<iframe src="([^"]+)"', page.read_text(encoding="utf-8")):
            framed[page.stem] = (page.parent / source.partition("#")[0]).resolve()
    assert {"first-log", "simulator", "energy", "2_simulator", "3_energy"} <= set(framed)
    assert all("<h1>Crane</h1>" in page.read_text(encoding="utf-8") for page in framed.values())
    for name in ("1_first_log", "5_cheaper_motion"):
        assert "<polyline" in (guide / "notebooks" / f"{name}.html").read_text(encoding="utf-8")


def test_it_is_searched_from_a_folder_without_a_network(guide: Path, browser: Any) -> None:
    page = browser.new_page(viewport={"width": 1440, "height": 900})
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    page.goto((guide / "tutorials" / "energy.html").as_uri())
    page.fill(".md-search__input", "backlash")
    page.wait_for_selector(".md-search-result__item")
    assert [url for url in asked if not url.startswith(("file:", "data:", "blob:"))] == []


def text_of(page: Path) -> str:
    """What stands on a page, tables aside without its tags."""
    return html.unescape(re.sub(r"</?(?!td)[a-z][^>]*>", "", page.read_text(encoding="utf-8")))


def test_notebooks_keep_no_results() -> None:
    for notebook in (ROOT / "docs" / "notebooks").glob("*.ipynb"):
        for cell in json.loads(notebook.read_text(encoding="utf-8"))["cells"]:
            assert not cell.get("outputs") and not cell.get("execution_count"), notebook.name


@pytest.mark.nightly
@pytest.mark.timeout(3600)
def test_each_step_of_the_tutorials_can_be_done(tmp_path: Path) -> None:
    environment = os.environ | {"PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
    for name in TUTORIALS:
        text = (ROOT / "docs" / "tutorials" / f"{name}.md").read_text(encoding="utf-8")
        for language, block in re.findall(r"^```(sh|python)\n(.*?)^```", text, re.S | re.M):
            command = ["bash", "-ec", block] if language == "sh" else [sys.executable, "-c", block]
            done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
            assert done.returncode == 0, f"{name}: {block}\n{done.stderr}"
    assert "<html" in (tmp_path / "gap.html").read_text(encoding="utf-8")
    told, planted, mended = (damping(tmp_path / f"{name}.xml", "joint_a2") for name in ("kr6", "faulty", "better"))
    assert planted == 2 * told and mended == pytest.approx(told, rel=0.2)


def damping(model: Path, joint: str) -> float:
    tag = re.search(rf'<joint name="{joint}"[^>]* damping="([^"]+)"', model.read_text(encoding="utf-8"))
    return float(tag[1])
