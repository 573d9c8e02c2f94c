from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import rdflib
from tests.synthetic import arm, rigid_torque, swing, truth, with_constants

from irtwin.effects.catalogue import BASELINE, catalogue
from irtwin.effects.effect import Coefficients, Predicted
from irtwin.effects.local import LocalEffect
from irtwin.effects.rigid_body import NAMES
from irtwin.effects.stack import Stack
from irtwin.errors import InputError
from irtwin.resources import folder
from irtwin.robot.urdf import parse_urdf
from irtwin.signals.sparse import Sparse

CONTRACT = Path(__file__).parents[3] / "shared/contract/effects.toml"


@pytest.mark.system
@pytest.mark.skipif(not CONTRACT.exists(), reason="the shared contract is not here")
def test_effects_are_as_the_contract_says():
    contract = tomllib.loads(CONTRACT.read_text())
    robot = with_constants(arm(3))
    assert tuple(name for name, entry in contract.items() if entry.get("baseline")) == BASELINE
    for name, entry in contract.items():
        effect = catalogue()[name]
        assert effect.channel == entry["channel"]
        if name == "rigid_body":  # its ten per link are beyond the table
            continue
        stated = {key: value[0] for key, value in entry.get("parameters", {}).items()}
        assert units(effect, robot).items() >= stated.items()
        per_joint = all(term.joint for term in effect.terms(robot))
        assert per_joint == (entry["per"] != "robot" or name == "mechanical_power")
    own = {name for name, effect in catalogue().items() if effect.disturbance or isinstance(effect, LocalEffect)}
    assert catalogue().keys() - own == contract.keys()


QUDT_UNITS = {
    "UNITLESS": "1", "M": "m", "KiloGM": "kg", "KiloGM-M2": "kg m^2", "SEC": "s", "HZ": "Hz", "K": "K", "PER-K": "1/K",
    "RAD": "rad", "RAD-PER-SEC": "rad/s", "PER-REV": "1/rev", "N": "N", "N-M": "Nm", "N-M-PER-SEC": "Nm/s",
    "N-M-PER-RAD": "Nm/rad", "N-M-SEC-PER-RAD": "Nm s/rad", "J": "J", "W": "W", "W-SEC-PER-RAD": "W s/rad",
    "W-SEC2-PER-RAD2": "W s^2/rad^2", "V": "V", "OHM": "ohm",
}  # fmt: skip


def test_parameters_have_the_units_of_the_ontology():
    graph = rdflib.Graph().parse(folder("ontology") / "effects.ttl")
    irt, effect_iri = rdflib.Namespace("https://w3id.org/irtwin#"), "https://w3id.org/irtwin/effect/"
    unit_of = rdflib.URIRef("http://qudt.org/schema/qudt/hasUnit")
    robot = with_constants(arm(3))
    for name, effect in catalogue().items():
        own = units(effect, robot)
        for parameter in graph.objects(rdflib.URIRef(effect_iri + name), irt.has_Effect_Parameter):
            unit = QUDT_UNITS[str(graph.value(parameter, unit_of)).rpartition("/")[2]]
            said = str(graph.value(parameter, irt.Parameter_Name))
            assert own[said] == unit if said in own else said in effect.ranges, name


def test_the_ontology_knows_the_numbers_of_shapes():
    graph = rdflib.Graph().parse(folder("ontology") / "effects.ttl")
    irt, effect_iri = rdflib.Namespace("https://w3id.org/irtwin#"), "https://w3id.org/irtwin/effect/"
    robot = with_constants(arm(3))
    for name, effect in catalogue().items():
        every = graph.objects(rdflib.URIRef(effect_iri + name), irt.has_Effect_Parameter)
        shapes = {parameter for parameter in every if (parameter, rdflib.RDF.type, irt.Shape_Parameter) in graph}
        said = {str(graph.value(parameter, irt.Parameter_Name)) for parameter in shapes}
        as_it_is = {each.name for each in parameters(effect, robot) if each.lower is None}
        assert said == as_it_is & effect.shape.keys(), name


def parameters(effect, robot):
    """What an effect says of coefficients of one that are known to one."""
    terms = [term for term in effect.terms(robot) if not term.fixed]
    names = {"coulomb_friction": "Fc", "viscous_friction": "Fv", "rotor_inertia": "Ia", "copper_loss": "R"}
    known = {(effect, joint, name): 1.0 for effect, name in names.items() for joint in robot.joint_names}
    return effect.parameters(robot, Coefficients(np.ones(len(terms)), np.eye(len(terms)), known)) if terms else ()


def units(effect, robot):
    """The names and units of an effect's parameters, "N m" as "Nm"; parts of a vector ("f_x") under the whole's."""
    return {each.name.partition("_")[0]: each.unit.replace("N m", "Nm") for each in parameters(effect, robot)}


def test_ids_and_keys_agree():
    assert all(effect.id == name for name, effect in catalogue().items())


@pytest.mark.parametrize("robot", [arm(4), arm(6), arm(7), arm(3, slides=(1,))], ids=["4", "6", "7", "slide"])
def test_torque_is_that_of_inverse_dynamics(robot):
    motion = swing(robot, 1, seconds=2)
    stack = Stack(robot, ["rigid_body"])
    nominal = np.array([term.expected for _, term in stack.torque_terms])
    np.testing.assert_allclose(stack.torque_columns(motion) @ nominal, rigid_torque(robot, motion), atol=1e-10)


@pytest.mark.slow
def test_torque_is_that_of_mujoco():
    mujoco = pytest.importorskip("mujoco")
    robot = arm(6)
    motion = swing(robot, 2, seconds=1)
    model = mujoco.MjModel.from_xml_string(robot.urdf)
    model.dof_armature[:] = truth(robot)["Ia"]
    data = mujoco.MjData(model)
    expected = []
    for state in zip(motion.q, motion.dq, motion.ddq, strict=True):
        data.qpos[:], data.qvel[:], data.qacc[:] = state
        mujoco.mj_inverse(model, data)
        expected.append(data.qfrc_inverse - data.qfrc_passive)
    stack = Stack(robot, ["rigid_body", "rotor_inertia"])
    values = np.array([term.expected for _, term in stack.torque_terms])
    values[-6:] = truth(robot)["Ia"]
    np.testing.assert_allclose(stack.torque_columns(motion) @ values, expected, atol=1e-8)


def test_friction_opposes_motion_and_rests_at_standstill():
    robot = arm(2)
    motion = swing(robot, 3, seconds=1)
    motion.dq[:3] = [[0.0, 1e-5], [0.5, -0.5], [-2.0, 2.0]]
    coulomb, viscous = catalogue()["coulomb_friction"], catalogue()["viscous_friction"]
    signs = np.einsum("tjj->tj", coulomb.columns(robot, motion))
    assert signs[:3].tolist() == [[0, 0], [1, -1], [-1, 1]]
    np.testing.assert_allclose(np.einsum("tjj->tj", viscous.columns(robot, motion)), motion.dq)


def test_payload_is_a_point_mass_on_the_last_link():
    robot = arm(4)
    motion = swing(robot, 4, seconds=1)
    loaded = replace(motion, payload_mass=3.0, payload_com=(0.05, -0.02, 0.1))
    stack = Stack(robot, ["rigid_body"])
    nominal = np.array([term.expected for _, term in stack.torque_terms])
    # independent: the same robot with a ball in its URDF
    ball = '<inertial><origin xyz="0.05 -0.02 0.1"/><mass value="3"/><inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" '
    ball += 'izz="0"/></inertial>'
    urdf = robot.urdf.replace('<link name="flange"/>', f'<link name="flange">{ball}</link>')
    expected = rigid_torque(parse_urdf(urdf), motion)
    np.testing.assert_allclose(
        stack.torque_columns(loaded) @ (nominal + stack.shift(loaded)), expected, rtol=1e-9, atol=1e-9
    )


def test_units_of_a_sliding_joint_are_those_of_force():
    robot = arm(3, slides=(1,))
    units = {(effect.id, term.joint): term.unit for effect, term in Stack(robot, BASELINE).torque_terms}
    assert units["viscous_friction", "joint_2"] == "N s/m"
    assert units["viscous_friction", "joint_1"] == "N m s/rad"
    assert units["rotor_inertia", "joint_2"] == "kg"
    assert units["coulomb_friction", "joint_2"] == units["torque_offset", "joint_2"] == "N"


def test_offset_shows_in_the_measurement_but_is_no_torque():
    robot = arm(2)
    stack = Stack(robot, ["viscous_friction", "torque_offset"])
    assert stack.real.tolist() == [True, True, False, False]
    motion = swing(robot, 1, seconds=1)
    np.testing.assert_allclose(stack.real_torque(motion, np.array([2.0, 3.0, 50.0, 60.0])), motion.dq * [2, 3])


def test_the_log_alone_tells_the_torque_of_a_joint_at_rest():
    stack = Stack(arm(2), ["coulomb_friction", "viscous_friction", "torque_offset"])
    motion = swing(arm(2), 1, seconds=1)
    rests = np.zeros((100, 2), dtype=bool)
    rests[30:60, 1] = True
    motion = replace(motion, dq=np.where(rests, 0.0, motion.dq), torque=np.full((100, 2), 7.0), standing=rests)
    values = np.array([4.0, 4.0, 2.0, 3.0, 0.5, 0.6])
    known, borne = stack.real_torque(motion, values), stack.borne_torque(motion, values)
    told = stack.told_by_log(motion)
    assert told[30:60, 1].all() and not told[:30].any()
    np.testing.assert_allclose(borne[told], 7.0 - 0.6)
    np.testing.assert_array_equal(borne[~told], known[~told])
    unlogged = replace(motion, torque=None)
    np.testing.assert_array_equal(stack.borne_torque(unlogged, values), known)


def test_copper_loss_takes_current_where_the_torque_constant_is_known():
    robot = arm(2)
    motion = swing(robot, 1, seconds=1)
    torque = np.ones((100, 2)) * [4.0, 6.0]
    copper = catalogue()["copper_loss"]
    assert [term.unit for term in copper.terms(robot)] == ["W/(N m)^2"] * 2
    np.testing.assert_allclose(copper.columns(robot, motion, Predicted(torque))[0], [16, 36])
    known = with_constants(robot, 2.0)
    assert [term.unit for term in copper.terms(known)] == ["ohm"] * 2
    np.testing.assert_allclose(copper.columns(known, motion, Predicted(torque))[0], [4, 9])


def test_a_joint_feels_the_links_that_it_carries():
    robot = arm(3)
    pattern = Stack(robot, ["rigid_body"]).pattern.reshape(3, 3, len(NAMES)).any(axis=2)
    assert (pattern == np.triu(np.ones((3, 3), dtype=bool))).all()


@pytest.mark.parametrize(
    "effects, message",
    [
        (["rigid_body", "magic"], 'there is no effect "magic"; choose from rigid_body'),
        (["rigid_body", "rigid_body"], 'effect "rigid_body" is listed twice; list it once'),
        ([catalogue()["cable_drag"].on("elbow")], 'effect "cable_drag": there is no joint "elbow"; choose from join'),
    ],
)
def test_wrong_lists_of_effects(effects, message):
    with pytest.raises(InputError) as error:
        Stack(arm(2), effects)
    assert str(error.value).startswith(message)


@pytest.mark.parametrize("name", [name for name, effect in catalogue().items() if effect.signal == "torque"])
def test_a_contribution_is_columns_by_coefficients(name):
    robot = arm(4)
    motion = swing(robot, 8, seconds=2)
    motion = replace(motion, temperature=np.full_like(motion.q, 40.0))
    predicted = Predicted(10 * np.sin(motion.q))
    effect = catalogue()[name]
    values = np.random.default_rng(0).uniform(0.5, 1.5, len(effect.terms(robot)))
    expected = effect.columns(robot, motion, predicted) @ values
    np.testing.assert_allclose(effect.contribution(robot, motion, values, predicted), expected, rtol=1e-9, atol=1e-9)


@pytest.fixture(scope="module")
def various():
    """The baseline with effects of a load, of the past, and of some runs."""
    contact = replace(catalogue()["external_contact"], runs=("x",))
    return Stack(arm(3), [*BASELINE, "load_dependent_friction", "presliding_hysteresis", contact])


def test_columns_by_joint_are_those_of_torque_without_zeros(various):
    stack, told = various, replace(swing(arm(3), 1, seconds=0.5), payload_mass=2.0)
    for motion in (told, told.part(10, 30)):
        dense = stack.torque_columns(motion)
        columns = stack.columns_by_joint(motion)
        for joint, used in enumerate(stack.pattern):
            np.testing.assert_array_equal(columns[joint], dense[:, joint, used])
        np.testing.assert_allclose(stack.shift_torque(motion), dense @ stack.shift(motion), atol=1e-12)
        assert stack.shift_torque(motion).any()


def test_what_columns_carry_is_their_sum_over_joints(various):
    stack, told = various, swing(arm(3), 1, seconds=0.5)
    for motion in (told, told.part(10, 30)):
        expected = np.einsum("njk,nj->nk", stack.torque_columns(motion), motion.dq)[:, stack.real]
        np.testing.assert_allclose(stack.carried(motion, motion.dq), expected, rtol=1e-9, atol=1e-9)


def test_sparse_columns_are_those_of_torque_however_few_are_worked_out():
    robot = arm(3)
    told = replace(swing(robot, 1, seconds=20), payload_mass=2.0, cutoff=4.0)
    stack = Stack(robot, [*BASELINE, "payload"])
    part = told.part(100, 1500)
    dense = stack.torque_columns(part)
    for joint, (columns, used) in enumerate(zip(stack.sparse_by_joint(part), stack.pattern, strict=True)):
        found = [each.values @ each.mixed for each in columns if isinstance(each, Sparse)]
        expected = dense[::3, joint, used]
        bodies, payload = (int(used[k].sum()) for k in (slice(0, 30), slice(-10, None)))
        np.testing.assert_allclose(found[0], expected[:, :bodies], atol=1e-9)
        np.testing.assert_allclose(found[1], expected[:, expected.shape[1] - payload :], atol=1e-9)
        read = sum((each.values if isinstance(each, Sparse) else each).shape[1] for each in columns)
        assert read < used.sum()
    values = np.random.default_rng(0).uniform(0.5, 1.5, len(stack.torque_terms))
    torque = stack.real_torque(part, values)
    np.testing.assert_allclose(stack.real_torque(part, values, sparse=True), torque, atol=1e-5 * np.abs(torque).max())
    known = stack.shift_torque(part)
    np.testing.assert_allclose(stack.shift_torque(part, sparse=True), known, atol=1e-5 * np.abs(known).max())
