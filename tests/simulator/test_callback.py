"""What MuJoCo is told to add: the torque that a motion takes is the twin's, and a played servo's dead band is there."""

from __future__ import annotations

import json
from pathlib import Path

import mujoco
import numpy as np
import pytest
from tests import gap_cases, servo_arm
from tests.synthetic import arm, swing

from irtwin.effects import compliance, friction, load, local, transmission
from irtwin.effects.effect import Effect
from irtwin.effects.stack import Stack
from irtwin.errors import InputError
from irtwin.simulator.callback import Rest, apply
from irtwin.simulator.play import play, whole
from irtwin.twin.described import text_of
from irtwin.twin.files import to_json
from irtwin.twin.twin import Parameter, Twin

ROBOT = arm(3)
NUMBERS = {"rotor_inertia": [0.8, 0.4, 0.3], "coulomb_friction": [3.0, 2, 1], "viscous_friction": [5.0, 4, 3]}
J2 = ("joint_2",)
REST: dict[Effect, list[float]] = {
    friction.StribeckFriction(joints=J2, vs=0.3): [2.0],
    friction.NonlinearViscousFriction(joints=J2, d=0.5): [-1.0],
    friction.AsymmetricFriction(joints=J2): [1.0, 0.5],
    friction.LoadDependentFriction(joints=J2): [0.2, 0.15],
    friction.PositionDependentFriction(joints=J2): [1.0, 0.5],
    transmission.TorqueRipple(joints=J2, N=9.0): [1.0, 0.5],
    transmission.JointCoupling(joints=("joint_2", "joint_3")): [0.1, 0.5, 0.5],
    load.CableDrag(joints=J2): [9.0],
    load.GravityCompensation(joints=J2): [5.0, 3, 2, 1],
    load.BaseTilt(): [0.05, 0.02],
    local.LocalWear(joints=J2, q0=0.2): [2.0],
    local.JointLimitSpring(joints=J2, q0=0.2): [20.0],
}


@pytest.fixture(autouse=True)
def taken_out():
    yield
    mujoco.set_mjcb_passive(None)


def twin_of(*effects: Effect) -> Twin:
    """A twin whose numbers of bodies are the URDF's."""
    numbers = {name: list(values) for name, values in NUMBERS.items()}
    numbers |= {effect.id: list(REST.get(effect, [0.5, 0.5])) for effect in effects}
    every = ("rigid_body", *NUMBERS, *effects)
    parameters = [
        Parameter(
            effect.id, term.joint, term.link, term.name,
            numbers[effect.id].pop(0) if effect.id in numbers else term.expected, term.unit,
        )
        for effect, term in Stack(ROBOT, every).torque_terms
    ]  # fmt: skip
    return Twin(ROBOT, every, tuple(parameters))


def applied(twin: Twin, folder: Path) -> tuple[mujoco.MjModel, Rest]:
    (folder / "twin.json").write_text(to_json(twin))
    model = mujoco.MjModel.from_xml_string(text_of(twin, "mjcf"))
    return model, apply(model, folder / "twin.json")


@pytest.mark.parametrize("effect", REST, ids=lambda effect: effect.id)
def test_the_torque_of_a_motion_is_the_twins(effect: Effect, tmp_path: Path) -> None:
    twin = twin_of(effect)
    model, rest = applied(twin, tmp_path)
    assert (rest.effects, rest.left_out) == ((effect.id,), ())
    motion, data = swing(ROBOT, 1, seconds=2.0, rate=20.0), mujoco.MjData(model)
    found = np.empty(motion.q.shape)
    for row, state in enumerate(zip(motion.q, motion.dq, motion.ddq, strict=True)):
        data.qpos[:], data.qvel[:], data.qacc[:] = state
        mujoco.mj_inverse(model, data)
        found[row] = data.qfrc_inverse
    slides = np.abs(motion.dq) > 0.1  # slower, MuJoCo's dry friction turns by its own law
    wanted = twin.joint_torque(motion)
    np.testing.assert_allclose(found[slides], wanted[slides], atol=1e-12)
    assert np.abs(wanted - twin_of().joint_torque(motion))[slides].max() > 0.2


def moved(model: mujoco.MjModel, rate: int) -> np.ndarray:
    """Return where a controller has brought the arm, and how fast it moves, after 0.2 s."""
    model.opt.timestep = 1 / rate
    data = mujoco.MjData(model)
    for _ in range(round(0.2 * rate)):
        data.ctrl[:] = 60 * (0.3 * np.sin(6 * data.time) - data.qpos) - 8 * data.qvel
        mujoco.mj_step(model, data)
    return np.concatenate([data.qpos, data.qvel])


def test_an_arm_moves_alike_at_500_and_1000_steps_a_second(tmp_path: Path) -> None:
    stiff = [effect for effect in REST if effect.id in ("stribeck_friction", "load_dependent_friction")]
    model, _ = applied(twin_of(*stiff, *(one for one in REST if one.id == "joint_coupling")), tmp_path)
    np.testing.assert_allclose(moved(model, 500), moved(model, 1000), atol=0.02)


def test_friction_of_a_load_holds_a_joint_that_stands(tmp_path: Path) -> None:
    fell = []
    for twin in (twin_of(), twin_of(friction.LoadDependentFriction(joints=J2))):
        mujoco.set_mjcb_passive(None)
        model, _ = applied(twin, tmp_path)
        data = mujoco.MjData(model)
        data.qpos[1] = 1.2
        mujoco.mj_forward(model, data)
        carried = np.array([1.0, 0.8, 1.0])  # dry friction of 2 N m is too little for the rest
        for _ in range(150):
            data.ctrl[:] = data.qfrc_bias * carried
            mujoco.mj_step(model, data)
        fell.append(abs(data.qpos[1] - 1.2))
    assert fell[1] < 0.1 * fell[0], fell


def test_what_needs_the_past_is_left_out_and_other_models_are_left_alone(tmp_path: Path) -> None:
    lost = compliance.Backlash(joints=J2, b=0.01)
    cable = load.CableDrag(joints=J2)
    other = mujoco.MjModel.from_xml_string(text_of(twin_of(), "mjcf"))
    model, rest = applied(twin_of(lost, cable), tmp_path)
    assert (rest.effects, rest.left_out) == (("cable_drag",), ("backlash",))
    forces = []
    for each in (model, other):
        data = mujoco.MjData(each)
        data.qpos[1] = 1.0
        mujoco.mj_forward(each, data)
        forces.append(data.qfrc_passive[1])
    assert forces == [pytest.approx(-9.0), 0.0]


def diagnosis(folder: Path, joint: str = "elbow", width: float = 0.03) -> Path:
    said = gap_cases.diagnosis("attributed")
    cause = next(one for one in said["causes"] if one["parameters"])
    number = cause["parameters"][0] | {"name": "dead_band", "joint": joint, "value": width, "unit": "rad"}
    cause |= {"effect": "servo_dead_band", "joints": [joint], "parameters": [number]}
    (folder / "found.json").write_text(json.dumps(said))
    return folder / "found.json"


def test_the_model_is_given_the_twins_numbers_which_belong_with_what_is_added(tmp_path: Path) -> None:
    twin = twin_of(next(iter(REST)))
    (tmp_path / "twin.json").write_text(to_json(twin))
    model = mujoco.MjModel.from_xml_string(text_of(twin, "mjcf"))
    own = {number: getattr(model, f"dof_{number}").copy() for number in ("armature", "damping", "frictionloss")}
    model.dof_damping[:] += 3.0  # as a mended file may have it, which has no place for the rest
    model.dof_armature[:] *= 0.9
    apply(model, tmp_path / "twin.json")
    for number, values in own.items():
        np.testing.assert_allclose(getattr(model, f"dof_{number}"), values, atol=1e-6, err_msg=number)


@pytest.mark.parametrize(("late", "gear"), [(0, 1.0), (20, 1.0), (0, -3.0)])
def test_a_servo_has_its_dead_band_as_it_is_played(late: int, gear: float, tmp_path: Path) -> None:
    delay = f'kp="15" delay="{2e-3 * late - 1e-3}" nsample="{late + 1}"'  # MuJoCo's is of whole steps
    text = servo_arm.MODEL.replace('kp="15"', delay) if late else servo_arm.MODEL
    servo = f'kp="{15 / gear**2!r}" kv="{0.6 / gear**2!r}" gear="{gear}" ctrlrange="-4.5 4.5"'
    text = text if gear == 1 else text.replace('kp="15" kv="0.6" ctrlrange="-1.5 1.5"', servo)
    data_set, model, own = servo_arm.read(*servo_arm.write(tmp_path, {"a": servo_arm.swings(3, 1)}, text))
    (run,) = data_set.runs
    stiff, loose = (servo_arm.changed(own, dead_band=(0.0, band), delay=(0.0, 2e-3 * late)) for band in (0.0, 0.03))
    without, wanted = (played[0] for played in play(own, [stiff, loose], [whole(run)]))
    compiled = mujoco.MjModel.from_xml_path(str(model.file.path))
    assert apply(compiled, diagnosis(tmp_path)).effects == ("servo_dead_band",)
    data, found = mujoco.MjData(compiled), np.empty_like(wanted)
    for row, told in enumerate(run.signals.command):
        found[row], data.ctrl[:] = data.qpos, told * [1.0, gear]
        for _ in range(round(0.02 / compiled.opt.timestep)):
            mujoco.mj_step(compiled, data)
    assert np.abs(wanted - without).max() > 0.02
    np.testing.assert_allclose(found, wanted, atol=1e-6)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("{", "twin.json: not JSON .*; name a twin that irtwin saved, or the JSON of a diagnosis"),
        ("{}", 'twin.json: "format" is not "irtwin twin"'),
    ],
)
def test_a_file_of_something_else_is_refused(content: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "twin.json").write_text(content)
    with pytest.raises(InputError, match=message):
        apply(mujoco.MjModel.from_xml_string(servo_arm.MODEL), tmp_path / "twin.json")


def test_a_model_without_the_joint_or_its_servo_is_refused(tmp_path: Path) -> None:
    model = mujoco.MjModel.from_xml_string(servo_arm.MODEL)
    with pytest.raises(InputError, match="the model: has no joint wrist; its joints are lift, elbow"):
        apply(model, diagnosis(tmp_path, "wrist"))
    bare = mujoco.MjModel.from_xml_string(text_of(twin_of(), "mjcf"))
    with pytest.raises(InputError, match="the model: joint joint_1 is not driven by one position servo"):
        apply(bare, diagnosis(tmp_path, "joint_1"))
