"""Units: rows say symbols, the graph says IRIs, of QUDT where it has the unit."""

from __future__ import annotations

from pathlib import Path

import pytest
from pyoxigraph import RdfFormat, Store
from sqlalchemy.orm import Session
from tests import rows
from tests.effects.test_effect import units as of_parameters
from tests.mapped import map_into, ontology_graph
from tests.synthetic import arm, with_constants

from irtwin.effects.catalogue import catalogue
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.resources import folder
from irtwin.signals.channels import CHANNELS
from irtwin.storage import structure_schema as structure
from irtwin.storage.database import Workspace
from irtwin.storage.schema import ParameterRow

TWIN = f"{rows.ROBOT}.abc"
QUDT = "http://qudt.org/vocab/unit/"


@pytest.fixture(scope="module")
def known() -> dict[str, str]:
    """Return the ontology's units by their symbols."""
    store = Store()
    store.load(path=str(folder("ontology") / "units.ttl"), format=RdfFormat.TURTLE)
    asked = "PREFIX qudt: <http://qudt.org/schema/qudt/> SELECT ?symbol ?unit { ?unit qudt:symbol ?symbol }"
    found = [(row["symbol"].value, row["unit"].value) for row in store.query(asked)]
    assert len(dict(found)) == len(found), "a symbol is of one unit"
    return dict(found)


def mapped(folder_: Path, symbols: list[str]) -> KnowledgeGraph:
    """Return the graph of a robot with a channel and a parameter of each unit."""
    with Workspace(folder_) as workspace:
        workspace.ingest(*rows.data_set())
        with Session(workspace.engine) as session, session.begin():
            session.add_all(channel(number, unit) for number, unit in enumerate(symbols))
        rows.identify(workspace, TWIN, parts=[parameter(number, unit) for number, unit in enumerate(symbols)])
        documents = [folder("mappings") / f"{name}.r2rml.ttl" for name in ("units", "twin", "robot_structure")]
        return map_into(ontology_graph(), workspace, documents)


def channel(number: int, unit: str) -> structure.DeviceChannel:
    return structure.DeviceChannel(
        robot_id=rows.ROBOT, column_name=f"c_{number}", device_id="x", label=unit, unit=unit, rate_hz=1.0
    )


def parameter(number: int, unit: str) -> ParameterRow:
    named = {"parameter_id": f"p{number}", "twin_id": TWIN, "robot_id": rows.ROBOT, "effect": "coulomb_friction"}
    return ParameterRow(**named, name=unit, value=1.0, unit=unit)


def test_the_mapping_knows_the_units_of_the_ontology(tmp_path: Path, known: dict[str, str]) -> None:
    graph = mapped(tmp_path, sorted(known))
    for kind, name in (("Logged_Channel", "Channel_Label"), ("Twin_Parameter", "Parameter_Name")):
        found = graph.query(f"SELECT ?symbol ?unit {{ ?one a irt:{kind} ; irt:{name} ?symbol ; qudt:hasUnit ?unit }}")
        assert {row["symbol"]: row["unit"] for row in found} == known


def test_a_unit_that_no_ontology_has_gets_an_iri_of_its_own(tmp_path: Path) -> None:
    """A package's effect may say any; the symbol can be asked for as that of any other."""
    graph = mapped(tmp_path, ["N m/rad^3"])
    asked = "?one a irt:Twin_Parameter ; qudt:hasUnit ?unit . ?unit a qudt:Unit ; qudt:symbol ?symbol"
    (row,) = graph.query(f"SELECT ?unit ?symbol {{ {asked} }}")
    assert (row["unit"], row["symbol"]) == ("https://w3id.org/irtwin/unit/N%20m%2Frad%5E3", "N m/rad^3")


def test_all_that_channels_and_effects_say_is_in_the_ontology(known: dict[str, str]) -> None:
    of_channels = {unit for one in CHANNELS.values() for unit in (one.unit, one.sliding) if unit}
    assert of_channels <= known.keys()
    for robot in (arm(3, slides=(1,)), with_constants(arm(3, slides=(1,)))):
        for effect in catalogue().values():
            said = {term.unit for term in effect.terms(robot)}
            said |= {unit.replace("Nm", "N m") for unit in of_parameters(effect, robot).values()}
            assert said <= known.keys(), effect.id


def test_a_unit_of_our_own_says_its_dimensions(known: dict[str, str]) -> None:
    text = (folder("ontology") / "units.ttl").read_text(encoding="utf-8")
    own = [unit for unit in known.values() if not unit.startswith(QUDT)]
    assert text.count("qudt:hasDimensionVector dimension:A0E") == len(own)
