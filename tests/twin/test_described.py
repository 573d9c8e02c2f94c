"""A twin as URDF, MJCF and SDF: numbers come back, and torque is the twin's."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
import pytest
from tests import synthetic
from tests.data_sets import irtwin
from tests.virtual.scene_data import kr6

from irtwin.effects.rigid_body import model_of
from irtwin.errors import InputError
from irtwin.planning.plan import nominal_twin
from irtwin.robot.mjcf_text import mjcf_text
from irtwin.robot.model import inverse_dynamics
from irtwin.robot.sdf_text import sdf_text
from irtwin.robot.structure import structure_of
from irtwin.robot.urdf import parse_urdf
from irtwin.robot.urdf_text import with_numbers
from irtwin.signals.motion import Motion
from irtwin.twin.described import described, places, text_of
from irtwin.twin.files import to_json
from irtwin.twin.identify import identify
from irtwin.twin.twin import Twin

EFFECTS = ("rigid_body", "rotor_inertia", "coulomb_friction", "viscous_friction", "torque_offset")


@cache
def fitted(slides: tuple[int, ...] = ()) -> Twin:
    robot = synthetic.arm(3, slides)
    return identify(robot, [synthetic.measure(robot, synthetic.swing(robot, 1, seconds=6.0), noise=0.1)], EFFECTS)


def of(twin: Twin, effect: str) -> np.ndarray:
    return np.array([one.value for one in twin.parameters if one.effect == effect])


def states(twin: Twin) -> Motion:
    q, dq, ddq = np.random.default_rng(0).uniform(-2, 2, (3, 50, len(twin.robot.joints)))
    return Motion(np.arange(50.0), q, dq, ddq, run="random")


def torque(model: pin.Model, motion: Motion) -> np.ndarray:
    return inverse_dynamics(model, motion.q, motion.dq, motion.ddq)


@pytest.mark.parametrize("slides", [(), (1,)])
def test_the_urdf_has_the_bodies_and_friction_of_the_twin(slides: tuple[int, ...]) -> None:
    twin = fitted(slides)
    robot = parse_urdf(text_of(twin, "urdf"))
    own = of(twin, "rigid_body")
    moments = np.concatenate([inertia.toDynamicParameters() for inertia in list(robot.model.inertias)[1:]])
    assert moments == pytest.approx(own, rel=1e-12, abs=1e-12)
    motion = states(twin)
    assert torque(robot.model, motion) == pytest.approx(torque(model_of(twin.robot, own), motion), rel=1e-12, abs=1e-12)
    numbers = [(one.damping, one.friction) for one in structure_of(robot).connections if one.axis]
    assert numbers == list(zip(of(twin, "viscous_friction"), of(twin, "coulomb_friction"), strict=True))


@pytest.mark.parametrize("slides", [(), (1,)])
def test_the_mjcf_takes_the_torque_of_the_twin(slides: tuple[int, ...], tmp_path: Path) -> None:
    mujoco = pytest.importorskip("mujoco")
    twin = fitted(slides)
    model = mujoco.MjModel.from_xml_string(text_of(twin, "mjcf"))
    assert model.dof_armature == pytest.approx(of(twin, "rotor_inertia"), rel=1e-12)
    assert model.dof_damping == pytest.approx(of(twin, "viscous_friction"), rel=1e-12)
    assert model.dof_frictionloss == pytest.approx(of(twin, "coulomb_friction"), rel=1e-12)
    motion, data = states(twin), mujoco.MjData(model)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    wanted = torque(model_of(twin.robot, of(twin, "rigid_body")), motion)
    wanted += of(twin, "rotor_inertia") * motion.ddq + of(twin, "viscous_friction") * motion.dq
    for row, state in enumerate(zip(motion.q, motion.dq, motion.ddq, strict=True)):
        data.qpos[:], data.qvel[:], data.qacc[:] = state
        mujoco.mj_inverse(model, data)
        assert data.qfrc_inverse == pytest.approx(wanted[row], abs=1e-9)


def test_the_sdf_has_the_numbers_of_the_twin() -> None:
    twin = fitted()
    model = ElementTree.fromstring(text_of(twin, "sdf"))[0]
    links = {link.get("name"): link for link in model.iter("link")}
    assert list(links) == ["base", "link_1", "link_2", "link_3"]
    assert [frame.get("attached_to") for frame in model.iter("frame")] == ["link_3"]
    for number, values in enumerate(of(twin, "rigid_body").reshape(-1, 10), 1):
        inertial = links[f"link_{number}"].find("inertial")
        said = {each.tag: float(each.text) for each in (inertial.find("mass"), *inertial.find("inertia"))}
        centre = np.array(inertial.findtext("pose").split()[:3], dtype=float)
        upper = [said[name] for name in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")]
        full = np.zeros((3, 3))
        full[np.triu_indices(3)] = upper
        full = full + np.triu(full, 1).T
        again = pin.Inertia(said["mass"], centre, full).toDynamicParameters()
        assert again == pytest.approx(values, rel=1e-12, abs=1e-12)
    damping = [float(dynamics.findtext("damping") or 0) for dynamics in model.iter("dynamics")]
    assert damping == of(twin, "viscous_friction").tolist()
    poses = [link.find("pose") for link in list(links.values())[1:]]
    assert [pose.get("relative_to") for pose in poses if pose is not None] == ["base", "link_1", "link_2"]


def test_a_twin_that_knows_nothing_changes_nothing() -> None:
    robot = kr6()
    assert text_of(nominal_twin(robot), "urdf") == robot.urdf


def test_shapes_go_along() -> None:
    robot = kr6()
    drawn = [solid for solid in structure_of(robot).solids if solid.kind != "mesh"]
    mjcf, sdf = ElementTree.fromstring(mjcf_text(robot, {})), ElementTree.fromstring(sdf_text(robot))
    assert len(list(mjcf.iter("geom"))) == len(drawn)
    assert len(list(sdf.iter("visual"))) + len(list(sdf.iter("collision"))) == len(drawn)


def test_what_is_fixed_to_a_link_keeps_its_body_where_that_can_be() -> None:
    twin = fitted()
    heavy = {1e-4: {"flange": 1e-4}, 50.0: {"flange": 0.0}}  # of 2.7 kg together
    for mass, kept in heavy.items():
        ball = pin.Inertia(mass, np.zeros(3), 1e-9 * np.eye(3))
        found = described(twin, parse_urdf(with_numbers(twin.robot.urdf, {"flange": ball}, {})))
        assert {body.name: body.mass for body in structure_of(found).bodies if body.name == "flange"} == kept
        last = found.model.inertias[3].toDynamicParameters()
        assert last == pytest.approx(of(twin, "rigid_body")[20:], rel=1e-12, abs=1e-12)


def test_inconsistent_bodies_are_refused() -> None:
    twin = fitted()
    spoilt = [replace(one, value=-1.0) if one.name == "m" else one for one in twin.parameters]
    told = "the body that joint_1 moves is not physically consistent; identify the twin again"
    with pytest.raises(InputError, match=told):
        text_of(replace(twin, parameters=tuple(spoilt)), "sdf")


def test_what_a_format_has_no_place_for_is_said(tmp_path: Path) -> None:
    twin = fitted()
    assert dict(places(twin, "mjcf"))["rotor_inertia"] == "armature"
    assert dict(places(twin, "urdf"))["rotor_inertia"] is None
    (tmp_path / "twin.json").write_text(to_json(twin))
    said = irtwin("export", "--sdf", tmp_path / "arm.sdf", "--twin", tmp_path / "twin.json")
    assert (said.status, said.out) == (0, f"{tmp_path / 'arm.sdf'}\n")
    assert said.err == (
        "irtwin: SDF has rigid_body (inertia), coulomb_friction (friction), viscous_friction (damping) of the twin\n"
        "irtwin: SDF has no place for rotor_inertia, torque_offset\n"
    )
    assert (tmp_path / "arm.sdf").read_text() == text_of(twin, "sdf")
    said = irtwin("export", "--usd", tmp_path / "arm.usda", "--twin", tmp_path / "twin.json")
    assert said.err.splitlines()[0].startswith("irtwin: USD has rigid_body (inertia), rotor_inertia (armature), coul")
    assert (tmp_path / "arm.usda").read_text() == text_of(twin, "usd")
    said = irtwin("export", "--usd", tmp_path / "arm.usdc", "--twin", tmp_path / "twin.json")
    assert (said.status, said.out) == (2, "")
    assert said.err.endswith("arm.usdc: USD is written as text; name the file arm.usda\n")
