from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.synthetic import arm, as_run, measure, rigid_torque, swing, truth, with_constants, with_torque

from irtwin.effects.catalogue import BASELINE, catalogue
from irtwin.errors import InputError
from irtwin.identification.cutoff import cutoff_for
from irtwin.signals.conditioning import condition, condition_for_fit
from irtwin.twin.identify import identify
from irtwin.twin.price import cost
from irtwin.twin.validate import validate

ALL = (*BASELINE, "copper_loss")


def wrong_inertias(robot):
    """The same robot as a maker's file would have it: every link half as heavy again."""
    return replace(robot, urdf=robot.urdf.replace('<mass value="', '<mass value="1'))


def values(twin, effect):
    return np.array([parameter.value for parameter in twin.parameters if parameter.effect == effect])


@pytest.mark.slow
@pytest.mark.parametrize(
    "robot", [arm(4), arm(6), arm(7), arm(4, slides=(2,))], ids=["4 joints", "6 joints", "7 joints", "one slides"]
)
def test_truth_is_found_under_wrong_inertias(robot):
    motions = [measure(robot, swing(robot, seed), noise=0.3, seed=seed) for seed in range(3)]
    twin = identify(wrong_inertias(robot), motions, BASELINE)
    true = truth(robot)
    np.testing.assert_allclose(values(twin, "viscous_friction"), true["Fv"], rtol=0.03, atol=0.05)
    np.testing.assert_allclose(values(twin, "coulomb_friction"), true["Fc"], rtol=0.03, atol=0.05)
    np.testing.assert_allclose(values(twin, "torque_offset"), true["c"], atol=0.15)
    new = swing(robot, 99)
    expected = measure(robot, new)
    error = (twin.torque(new) - expected.torque)[np.abs(new.dq) > 1e-3]
    assert np.sqrt(np.mean(error**2)) < 0.06
    np.testing.assert_allclose(twin.joint_torque(new), twin.torque(new) - values(twin, "torque_offset"), atol=1e-9)


def test_power_is_found_on_top_of_torque():
    robot = arm(4)
    motions = [measure(robot, swing(robot, seed), noise=0.3, seed=seed) for seed in range(3)]
    twin = identify(with_constants(robot), motions, ALL)
    true = truth(robot)
    assert values(twin, "standby_power")[0] == pytest.approx(true["P0"], abs=0.3)
    np.testing.assert_allclose(values(twin, "copper_loss")[:2], true["R"][:2], rtol=0.05)
    new = measure(robot, swing(robot, 99))
    (fit,) = validate(twin, [new])
    assert fit.energy_error < 0.2
    assert fit.power_r_squared > 0.999
    assert fit.r_squared.min() > 0.999
    assert twin.unidentified == ()


def test_friction_that_the_twin_lacks_is_no_heat_of_drives():
    robot, true = with_constants(arm(4)), truth(arm(4))

    def rubbing(seed):
        measured = measure(robot, swing(robot, seed), noise=0.1, seed=seed)
        return with_torque(robot, measured, 0.1 * np.abs(measured.torque - true["c"]) * np.sign(measured.dq))

    twin = identify(robot, [rubbing(seed) for seed in range(4)], ALL)
    np.testing.assert_allclose(values(twin, "copper_loss")[:2], true["R"][:2], rtol=0.03)
    new = rubbing(99)
    figure = cost(twin, [new]).energy
    assert abs(figure.value - np.trapezoid(new.power, new.time)) < figure.half_width


def test_through_the_whole_chain_from_positions_alone():
    robot = arm(4)
    motions = [condition(as_run(measure(robot, swing(robot, seed), noise=0.3)), robot) for seed in range(2)]
    twin = identify(wrong_inertias(robot), motions)
    true = truth(robot)
    np.testing.assert_allclose(values(twin, "viscous_friction"), true["Fv"], rtol=0.05, atol=0.05)
    np.testing.assert_allclose(values(twin, "coulomb_friction"), true["Fc"], rtol=0.05, atol=0.05)
    assert twin.cutoff == max(motion.cutoff for motion in motions)
    assert 1 < twin.condition_number < 100


def test_noise_of_positions_takes_nothing_off_friction():
    """Regressors with noise in them come out too small by plain least squares; the cutoff leaves none to speak of."""
    robot, rng = arm(3), np.random.default_rng(1)
    runs = []
    for seed in range(3):
        motion = measure(robot, swing(robot, seed, seconds=10), noise=0.3, seed=seed)
        noisy = as_run(replace(motion, q=motion.q + 1e-3 * rng.standard_normal(motion.q.shape)))
        runs.append(replace(noisy, name=f"run_{seed}"))
    cutoff = cutoff_for(robot, runs, None).hz
    twin = identify(robot, [condition_for_fit(run, robot, cutoff) for run in runs])
    np.testing.assert_allclose(values(twin, "viscous_friction"), truth(robot)["Fv"], rtol=0.01)
    np.testing.assert_allclose(values(twin, "coulomb_friction"), truth(robot)["Fc"], rtol=0.01)
    new = swing(robot, 99)
    error = (twin.torque(new) - measure(robot, new).torque)[np.abs(new.dq) > 1e-3]
    assert np.sqrt(np.mean(error**2)) < 0.05


@pytest.mark.nightly
def test_intervals_hold_the_truth():
    robot = arm(3)
    true = truth(robot)
    inside = []
    for seed in range(12):
        motions = [measure(robot, swing(robot, seed, seconds=10), noise=1.0, seed=seed)]
        twin = identify(robot, motions, BASELINE)
        for effect, name in (("viscous_friction", "Fv"), ("coulomb_friction", "Fc"), ("torque_offset", "c")):
            found = [parameter for parameter in twin.parameters if parameter.effect == effect]
            inside += [low.lower <= value <= low.upper for low, value in zip(found, true[name], strict=True)]
    assert np.mean(inside) >= 0.88


def test_base_parameters_are_sure_where_single_ones_are_not():
    robot = arm(3)
    twin = identify(robot, [measure(robot, swing(robot, 1), noise=0.1)])
    mass = next(p for p in twin.parameters if p.link == "link_1" and p.name == "m")
    assert (mass.lower, mass.upper) == (None, None)
    inertia = next(p for p in twin.base_parameters if p.name.startswith("Izz_link_1"))
    assert 0 < inertia.lower < inertia.value < inertia.upper < 2 * inertia.value


def test_a_told_payload_is_no_part_of_the_twin():
    robot = arm(4)
    heavy = [replace(swing(robot, seed), payload_mass=4.0 * seed, payload_com=(0.1, 0.0, 0.05)) for seed in range(3)]
    ball = '<link name="flange"><inertial><origin xyz="0.1 0 0.05"/><mass value="{}"/><inertia ixx="0" ixy="0" '
    ball += 'ixz="0" iyy="0" iyz="0" izz="0"/></inertial></link>'
    motions = []
    for motion in heavy:
        urdf = robot.urdf.replace('<link name="flange"/>', ball.format(motion.payload_mass))
        loaded = replace(robot, urdf=urdf) if motion.payload_mass else robot
        motions.append(replace(motion, torque=rigid_torque(loaded, motion)))
    twin = identify(robot, motions, ["rigid_body"])
    np.testing.assert_allclose(twin.torque(motions[2]), motions[2].torque, atol=1e-4)
    empty = swing(robot, 9)
    np.testing.assert_allclose(twin.torque(empty), rigid_torque(robot, empty), atol=1e-4)


def test_torque_constants_come_from_the_balance_of_power():
    robot = arm(4)
    motions = [replace(measure(robot, swing(robot, seed), noise=0.5, seed=seed), torque=None) for seed in range(2)]
    twin = identify(robot, motions, ALL)
    constants = np.array([joint.torque_constant for joint in twin.robot.joints])
    np.testing.assert_allclose(constants[:3], 8.0, rtol=0.05)
    named = [parameter for parameter in twin.parameters if parameter.name == "kt"]
    assert [parameter.unit for parameter in named] == ["N m/A"] * 4
    np.testing.assert_allclose([parameter.value for parameter in named], constants)
    np.testing.assert_allclose(values(twin, "viscous_friction")[:2], truth(robot)["Fv"][:2], rtol=0.05)
    (fit,) = validate(twin, [replace(measure(robot, swing(robot, 50)), torque=None)])
    assert fit.power_r_squared > 0.99
    assert fit.energy_error < 1
    assert fit.r_squared.min() > 0.98  # torque is judged by current times constant


@pytest.mark.slow
def test_torque_can_be_found_through_power_alone():
    robot = arm(3)
    whole = [measure(robot, swing(robot, seed, seconds=30), noise=0.5, seed=seed) for seed in range(3)]
    motions = [replace(motion, torque=None, current=None) for motion in whole]
    twin = identify(with_constants(robot), motions, ALL)
    np.testing.assert_allclose(values(twin, "viscous_friction")[:2], truth(robot)["Fv"][:2], rtol=0.1)
    assert twin.unidentified == ("torque_offset",)
    (fit,) = validate(twin, [measure(robot, swing(robot, 50))])
    assert fit.power_r_squared > 0.99


def test_without_power_nothing_is_said_of_standby():
    robot = arm(2)
    motion = replace(measure(robot, swing(robot, 1)), power=None)
    twin = identify(robot, [motion], ALL)
    assert twin.unidentified == ("standby_power", "copper_loss")
    assert "standby_power" not in {parameter.effect for parameter in twin.parameters}
    np.testing.assert_allclose(twin.power(motion), (twin.joint_torque(motion) * motion.dq).sum(axis=1))
    (fit,) = validate(twin, [motion])
    assert fit.power_rmse is fit.measured_energy is fit.energy_error is None


def test_runs_may_lack_what_others_have():
    robot = arm(3)
    full, torque_only = measure(robot, swing(robot, 1)), replace(measure(robot, swing(robot, 2)), power=None)
    twin = identify(robot, [torque_only, full])
    assert values(twin, "standby_power")[0] > 0
    assert twin.fitted == ("swing_2", "swing_1")


def both_signals(robot, seed, gain=1.0, harder=0.0, told=None):
    """What a robot of the truth shows whose joint 2 has an own gain, and is harder to move forwards than back, N m.

    `told`: what power is that the robot takes, by that which it would.
    """
    rng, true = np.random.default_rng(seed), truth(robot)
    motion = measure(robot, swing(robot, seed, seconds=10.0))
    torque = motion.torque - true["c"]
    torque[:, 1] += harder * (motion.dq[:, 1] > 0)
    power = true["P0"] + (torque * motion.dq).sum(axis=1) + (true["R"] * (torque / 8.0) ** 2).sum(axis=1)
    shown = torque * [1.0, gain, 1.0] + true["c"] + 0.5 * rng.standard_normal(torque.shape)
    power = power if told is None else told(power)
    return replace(motion, torque=shown, power=power + 2 * rng.standard_normal(len(power)))


def at_joint_2(twin, effect, name):
    return next(p for p in twin.parameters if (p.effect, p.joint, p.name) == (effect, "joint_2", name))


def test_power_tells_friction_from_an_offset():
    robot = with_constants(arm(3))
    motions = [both_signals(robot, seed, harder=4.0) for seed in (1, 2)]
    effects = (*ALL, catalogue()["asymmetric_friction"].on("joint_2"))
    blind = identify(robot, [replace(motion, power=None) for motion in motions], effects)
    assert at_joint_2(blind, "torque_offset", "c").lower is None  # torque cannot tell
    twin = identify(robot, motions, effects)
    offset, friction = at_joint_2(twin, "torque_offset", "c"), at_joint_2(twin, "asymmetric_friction", "a")
    assert offset.upper - offset.lower < 0.4
    assert offset.value == pytest.approx(0.0, abs=0.2)
    assert friction.value == pytest.approx(2.0, abs=0.6)  # gravity is constant too, nearly


def test_power_tells_a_torque_constant_that_is_off():
    robot = with_constants(arm(3))
    motions = [both_signals(robot, seed, gain=1.1) for seed in (1, 2)]
    twin = identify(robot, motions, (*ALL, catalogue()["torque_constant_error"].on("joint_2")))
    gain = at_joint_2(twin, "torque_constant_error", "g - 1")
    assert gain.lower < 0.1 < gain.upper
    assert gain.upper - gain.lower < 0.06
    assert at_joint_2(twin, "viscous_friction", "Fv").value == pytest.approx(truth(robot)["Fv"][1], rel=0.03)


@pytest.mark.parametrize(
    ("effects", "told"),
    [(BASELINE, None), (ALL, lambda power: np.maximum(power, 150.0)), (ALL, lambda power: power / 0.9)],
    ids=["no copper loss", "braking is burnt", "mains"],
)
def test_what_the_twin_lacks_of_power_does_not_look_like_an_offset(effects, told):
    robot = with_constants(arm(3))
    twin = identify(robot, [both_signals(robot, seed, told=told) for seed in (1, 2)], effects)
    true = truth(robot)
    np.testing.assert_allclose(values(twin, "torque_offset"), true["c"], atol=0.25)
    np.testing.assert_allclose(values(twin, "coulomb_friction"), true["Fc"], rtol=0.03)
    np.testing.assert_allclose(values(twin, "viscous_friction"), true["Fv"], rtol=0.03)


def test_power_without_work_says_nothing_of_torque():
    robot = with_constants(arm(2))
    motion = measure(robot, swing(robot, 1, seconds=6.0), noise=0.3)
    effects = [effect for effect in ALL if effect != "mechanical_power"]
    blind = identify(robot, [replace(motion, power=None)], effects)
    twin = identify(robot, [motion], effects)
    np.testing.assert_array_equal(values(twin, "torque_offset"), values(blind, "torque_offset"))


def test_nothing_to_fit():
    robot = arm(2)
    with pytest.raises(InputError, match="no run to fit a twin to; give at least one"):
        identify(robot, [])
    with pytest.raises(InputError, match="neither torque nor power was measured in any run; log tau_, i_ or power"):
        identify(robot, [swing(robot, 1)])
    with pytest.raises(InputError, match='no effect "stiction"'):
        identify(robot, [measure(robot, swing(robot, 1))], ["stiction"])


@pytest.mark.slow
def test_a_long_log_says_the_same_read_in_part_first(monkeypatch):
    robot = with_constants(arm(3))
    motions = [replace(measure(robot, swing(robot, seed), noise=0.3, seed=seed), cutoff=20.0) for seed in range(3)]
    whole = identify(robot, motions, ALL)
    monkeypatch.setattr("irtwin.identification.accumulate._ENOUGH", 1500)
    twin = identify(robot, motions, ALL)
    assert twin.effects == whole.effects
    for one, other in zip(twin.base_parameters, whole.base_parameters, strict=True):
        assert one.value == pytest.approx(other.value, abs=0.02 * (other.upper - other.lower))
