"""The guide: it builds, with every page in its place, and what its tutorials say is what happens."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
TUTORIALS = ("first-log", "simulator", "energy", "ask", "cheaper-motion")

pytestmark = [pytest.mark.slow, pytest.mark.system]


def test_it_has_a_reference_of_commands_and_python(guide: Path) -> None:
    commands = (guide / "reference" / "commands.html").read_text(encoding="utf-8")
    assert 'id="diagnose"' in commands and "--save-simulator" in commands
    assert "Bring a log" in (guide / "USING.html").read_text(encoding="utf-8")
    assert 'id="irtwin.modelling.identify"' in (guide / "reference" / "python.html").read_text(encoding="utf-8")
    for name in TUTORIALS:
        assert (guide / "tutorials" / f"{name}.html").is_file()


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
    assert tag is not None
    return float(tag[1])
