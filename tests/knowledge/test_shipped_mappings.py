"""What the shipped mappings make of a database filled by hand."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from pyoxigraph import NamedNode, Quad, RdfFormat, parse
from sqlalchemy import insert, select
from tests import rows
from tests.mapped import MAPPINGS

from irtwin import resources
from irtwin.knowledge.mapping import map_database
from irtwin.knowledge.mapping.document import RR
from irtwin.storage.database import Workspace
from irtwin.storage.energy_schema import EnergyShare, JointEnergy
from irtwin.storage.schema import Base, BaseParameterRow, JointState, ParameterRow, Series, TorqueFit, TwinEffect

EXPECTED = Path(__file__).parent / "data" / "mapped_robot.trig"
WORK = f"{rows.ROBOT}.work"
TWIN = f"{rows.ROBOT}.abc"
JOINT = {"robot_id": rows.ROBOT, "joint": "joint_a1"}


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Workspace]:
    with Workspace(tmp_path_factory.mktemp("workspace")) as filled:
        fill(filled)
        yield filled


def fill(workspace: Workspace) -> None:
    workspace.ingest(*rows.data_set())
    values = {"joint_position_rad": 0.5, "joint_speed_rad_s": 0.0, "joint_acc_rad_s2": -1e-9, "joint_torque_nm": 12.5}
    state = JointState(run_id=WORK, **JOINT, **values)
    workspace.replace_activity(rows.activity("state.1", "run_state"), [], [*rows.run_state(), state])
    rows.identify(workspace, TWIN, [f"https://w3id.org/irtwin/id/run/{WORK}"], twin_parts())
    workspace.replace_activity(
        rows.activity("energy.1", "energy"),
        [f"https://w3id.org/irtwin/id/twin/{TWIN}"],
        [*rows.run_energy(TWIN), *ledger()],
        series={WORK: rows.samples(9)},
    )


def twin_parts() -> list[Base]:
    friction = {"twin_id": TWIN, "effect": "coulomb_friction", "name": "Fc", "unit": "N m"}
    standby = {"twin_id": TWIN, "effect": "standby_power", "name": "P0", "unit": "W", "robot_id": rows.ROBOT}
    base = {"twin_id": TWIN, "number": 1, "combination": "Ia joint_a1 + Izz link_1", "unit": "kg m^2"}
    of_joint = f"{TWIN}.coulomb_friction.joint_a1.Fc"
    return [
        TwinEffect(twin_id=TWIN, effect="coulomb_friction"),
        ParameterRow(parameter_id=of_joint, **friction, **JOINT, value=7.25, lower=7.0, upper=7.5),
        BaseParameterRow(**base, value=1.5, lower=1.0, upper=2.0),
        ParameterRow(parameter_id=f"{TWIN}.standby_power.robot.P0", **standby, value=80.0),
        TorqueFit(twin_id=TWIN, run_id=WORK, part="fit", **JOINT, rmse_nm=1.5, r_squared=0.98),
    ]


def ledger() -> list[Base]:
    share = {"twin_id": TWIN, "run_id": WORK, "robot_id": rows.ROBOT}
    return [
        EnergyShare(**share, effect="coulomb_friction", place="joint_a1", joint="joint_a1", energy_j=5.0),
        EnergyShare(**share, effect="standby_power", place="robot", energy_j=80.0),
        JointEnergy(run_id=WORK, **JOINT, energy_j=18.0),
    ]


def test_what_the_rows_say(workspace: Workspace) -> None:
    """Each triple in its graph, and nothing else: NULL gives none."""
    text = EXPECTED.read_text()
    with workspace.reading() as session:
        for series in session.scalars(select(Series)):
            # The checksum of a Parquet file depends on the library that wrote it.
            text = text.replace(f"{series.kind}_{series.run_id.rpartition('.')[2]}", series.series_id)
    assert set(map_database(workspace.engine, MAPPINGS)) == set(parse(text, RdfFormat.TRIG))


def test_every_individual_of_a_provider_says_who_made_it(workspace: Workspace) -> None:
    quads = list(map_database(workspace.engine, MAPPINGS))
    generated = {quad.subject for quad in quads if quad.predicate.value.endswith("#wasGeneratedBy")}
    made = {quad.subject for quad in quads if is_made(quad)}
    assert len(made) == 10
    assert made <= generated


def is_made(quad: Quad) -> bool:
    return (
        quad.predicate.value.endswith("#type")
        and "/graph/activity/" in str(quad.graph_name)
        and not str(quad.object).endswith("Activity>")
    )


def test_every_term_is_declared_in_the_ontology() -> None:
    declared = {
        quad.subject.value
        for file in resources.folder("ontology").glob("*.ttl")
        for quad in parse(file.read_bytes(), RdfFormat.TURTLE)
        if isinstance(quad.subject, NamedNode) and quad.predicate.value.endswith("#type")
    }
    used = {
        quad.object.value
        for file in MAPPINGS
        for quad in parse(file.read_bytes(), RdfFormat.TURTLE)
        if quad.predicate.value in (f"{RR}predicate", f"{RR}class") and isinstance(quad.object, NamedNode)
    } - {"http://www.w3.org/1999/02/22-rdf-syntax-ns#type", "http://www.w3.org/2000/01/rdf-schema#label"}
    assert len(used) > 80
    assert used - declared == set()


def test_a_changed_mapping_changes_the_graph(workspace: Workspace, tmp_path: Path) -> None:
    changed = tmp_path / "robot.r2rml.ttl"
    shutil.copy(resources.folder("mappings") / changed.name, changed)
    text = changed.read_text().replace("irt:IR_Weight", "irt:Axes").replace('"weight_kg"', '"controlled_axes"')
    changed.write_text(text)
    found = {(quad.predicate.value, str(quad.object)) for quad in map_database(workspace.engine, [changed])}
    assert ("https://w3id.org/irtwin#Axes", '"2"^^<http://www.w3.org/2001/XMLSchema#double>') in found
    assert not any(predicate.endswith("IR_Weight") for predicate, _ in found)


@pytest.mark.system
def test_postgresql_gives_the_same_graph(
    workspace: Workspace, new_postgresql_database: Callable[[], str], tmp_path: Path
) -> None:
    with Workspace(tmp_path, new_postgresql_database()) as other:
        with workspace.engine.connect() as source, other.engine.begin() as target:
            for table in Base.metadata.sorted_tables:
                for row in source.execute(select(table)).mappings():
                    target.execute(insert(table), dict(row))
        assert set(map_database(other.engine, MAPPINGS)) == set(map_database(workspace.engine, MAPPINGS))
