"""Each effect against data made by a formula of its own: found again, predicted, booked, saved."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import make_interp_spline
from tests.synthetic import arm, rigid_torque, swing, truth, with_constants

from irtwin.effects import compliance, disturbance, drive, friction, load, local, sensing, supply, transmission
from irtwin.effects.catalogue import BASELINE, catalogue
from irtwin.effects.effect import Effect, Predicted
from irtwin.effects.stack import Stack
from irtwin.robot.kinematics import placements
from irtwin.robot.model import inverse_dynamics
from irtwin.robot.urdf import parse_urdf
from irtwin.twin.files import load as load_twin
from irtwin.twin.files import to_json
from irtwin.twin.identify import identify

pytestmark = pytest.mark.slow

TRUE = truth(arm(3))
ROBOT = with_constants(arm(3))
# rotors as on their data sheet: torque alone does not tell a rotor's inertia from a link's
JOINTS = (replace(joint, rotor_inertia=float(rotor)) for joint, rotor in zip(ROBOT.joints, TRUE["Ia"], strict=True))
ROBOT = replace(ROBOT, joints=tuple(JOINTS))
J2 = ("joint_2",)
KT = 8.0
SOFT = float((2 * np.pi * 10) ** 2 * pin.crba(ROBOT.model, ROBOT.model.createData(), np.zeros(3))[1, 1])  # 10 Hz


@dataclass
class State:
    """What a healthy robot of the `truth` does, for a formula to build on."""

    motion: object
    rigid: np.ndarray
    real: np.ndarray  # joint torque
    shown: np.ndarray  # with the offset of its measurement
    axes: np.ndarray  # W, mechanical and copper
    power: np.ndarray  # W, with standby

    @property
    def q(self):
        """Positions of joint 2, where most effects act, rad."""
        return self.motion.q[:, 1]

    @property
    def dq(self):
        """Speeds of joint 2, rad/s."""
        return self.motion.dq[:, 1]

    @property
    def sign(self):
        """Of the speeds of joint 2."""
        return np.sign(self.dq)


def healthy(motion):
    rigid = rigid_torque(ROBOT, motion)
    real = rigid + TRUE["Ia"] * motion.ddq + TRUE["Fc"] * np.sign(motion.dq) + TRUE["Fv"] * motion.dq
    axes = (real * motion.dq + TRUE["R"] * (real / KT) ** 2).sum(axis=1)
    return State(motion, rigid, real, real + TRUE["c"], axes, axes + TRUE["P0"])


@dataclass
class Case:
    """`torque`, `reading`, `power`: what the effect does to real torque, its measurement, measured power.

    `truth`: the values of its parameters `at` a joint or of the robot; `off`: how far they may be found, relative;
    `rate` Hz, `seconds` of a run.
    """

    effect: Effect
    truth: dict
    torque: Callable | None = None
    reading: Callable | None = None
    power: Callable | None = None
    at: str = "joint_2"
    off: float = 0.03
    rate: float = 100.0
    seconds: float = 15.0
    noise: float = 0.02  # N m, W
    rests_from: float | None = None  # s
    visible: bool = True  # what is not, other coefficients imitate

    def __str__(self):
        return self.effect.id


def only(column):
    """The torque of joint 2 among those of all."""
    return np.outer(column, [0, 1, 0])


def dahl(state, d=0.05, fc=TRUE["Fc"][1]):
    """The bristle's law by small steps of the way."""
    q, z, found = state.q, state.sign[0], []
    for before, after in zip(np.append(q[0], q[:-1]), q, strict=True):
        way = after - before
        for _ in range(100):
            z += way / 100 * (1 - np.sign(way) * z) / d
        found.append(z)
    return only(fc * (np.array(found) - state.sign))


def behind_a_spring(state, stiffness, damping, play=0.0):
    """The torque of all joints where joint 2's link is behind a spring with play, less that behind a stiff gear."""
    motion, model, data = state.motion, ROBOT.model, ROBOT.model.createData()
    motors = [make_interp_spline(motion.time, values, k=1) for values in (motion.q, motion.dq, motion.ddq)]

    def passed(lead, speed):
        give = np.sign(lead) * max(abs(lead) - play / 2, 0.0)
        return stiffness * give + damping * speed * (give != 0)

    def links(now, *leads):
        q, dq, ddq = (motor(now) - np.multiply(lead, [0, 1, 0]) for motor, lead in zip(motors, leads, strict=True))
        return pin.rnea(model, data, q, dq, ddq), pin.crba(model, data, q)[1, 1]

    def gains(now, lead, speed):
        taken, inertia = links(now, lead, speed, 0.0)
        return (taken[1] - passed(lead, speed)) / inertia

    start = (state.rigid[0, 1] / stiffness + np.sign(state.rigid[0, 1]) * play / 2, 0.0)
    moved = solve_ivp(
        lambda now, lead: (lead[1], gains(now, *lead)),
        motion.time[[0, -1]], start, t_eval=motion.time, method="LSODA", max_step=2e-3, rtol=1e-5, atol=1e-8,
    )  # fmt: skip
    taken = [links(now, *lead, gains(now, *lead))[0] for now, lead in zip(moved.t, moved.y.T, strict=True)]
    return np.array(taken) - state.rigid


def tilted(state, x=0.05, y=-0.03):
    model = ROBOT.model.copy()
    turn = pin.rpy.rpyToMatrix(x, y, 0.0)
    model.gravity.linear = turn @ model.gravity.linear
    motion = state.motion
    return inverse_dynamics(model, motion.q, motion.dq, motion.ddq) - state.rigid


def ball(state):
    """A ball of 2 kg in the URDF, in the second run only."""
    if state.motion.run != "swing_1":
        return np.zeros_like(state.rigid)
    inner = '<inertial><origin xyz="0.05 -0.02 0.1"/><mass value="2"/><inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" '
    urdf = ROBOT.urdf.replace('<link name="flange"/>', f'<link name="flange">{inner}izz="0"/></inertial></link>')
    return rigid_torque(parse_urdf(urdf), state.motion) - state.rigid


def push(state, force=(30.0, -20.0, 40.0)):
    """A force at the flange from second 4 to 9, through the slope of the flange's place."""
    q, step = state.motion.q, 1e-6
    slopes = [
        (placements(ROBOT, q + step * e) - placements(ROBOT, q - step * e))[:, :3, 3] / (2 * step) for e in np.eye(3)
    ]
    during = (state.motion.time >= 4) & (state.motion.time <= 9) & (state.motion.run == "swing_1")
    return np.column_stack([slope @ np.array(force) for slope in slopes]) * during[:, None]


def shifted(state, e=0.02):
    """The torque at a position that is read e too small."""
    moved = state.motion.q + e * np.eye(3)[1]
    return rigid_torque(ROBOT, replace(state.motion, q=moved)) - state.rigid


def late(state, d=0.02):
    spline = make_interp_spline(state.motion.time, state.shown[:, 1], k=3)
    return only(spline(np.maximum(state.motion.time - d, 0.0)) - state.shown[:, 1])


def stored(state, store=30.0):
    """Grid power with a store between mains and axes, by the energy in it."""
    dt, energy, found = state.motion.time[1] - state.motion.time[0], 0.0, []
    for watts in state.axes:
        after = np.clip(energy - watts * dt, 0.0, store)
        found.append(watts + (after - energy) / dt)
        energy = after
    return np.array(found) - state.axes


def lagged(state, constant=0.2):
    dt, shown, found = state.motion.time[1] - state.motion.time[0], state.power[0], []
    for watts in state.power:
        shown += (watts - shown) * (1 - np.exp(-dt / constant))
        found.append(shown)
    return np.array(found) - state.power


def coupled(state):
    turn = 0.7 * np.sign(state.motion.dq[:, 1] + state.motion.dq[:, 2])
    return np.column_stack([0 * turn, *(1.1 * state.motion.dq[:, k] + turn for k in (2, 1))])


def warm(motion):
    return np.linspace(20, 55, len(motion.time))[:, None] * np.ones(3)


CASES = [
    Case(
        friction.StribeckFriction(vs=0.08, joints=J2), {"Fs": 4.0, "vs": 0.08, "d": 1.0},
        lambda s: only(4 * s.sign * np.exp(-np.abs(s.dq) / 0.08)),
    ),
    Case(
        friction.NonlinearViscousFriction(d=2.0, joints=J2), {"k": -1.5, "d": 2.0},
        lambda s: only(-1.5 * s.dq * np.abs(s.dq)),
    ),
    Case(friction.AsymmetricFriction(joints=J2), {"b": -0.8}, lambda s: only(1.2 - 0.8 * np.abs(s.dq)), off=0.1),
    Case(
        friction.LoadDependentFriction(joints=J2), {"mu": 0.1, "mu_back": 0.2}, off=0.06,
        torque=lambda s: only(np.where(s.real[:, 1] * s.sign > 0, 0.1, 0.2) * np.abs(s.real[:, 1]) * s.sign),
    ),
    Case(
        friction.TemperatureDependentFriction(k=0.02, joints=J2), {"k": 0.02},
        lambda s: only(TRUE["Fv"][1] * s.dq * (np.exp(-0.02 * (warm(s.motion)[:, 1] - 25)) - 1)),
    ),
    Case(friction.PreslidingHysteresis(d=0.05, joints=J2), {"d": 0.05}, dahl),
    Case(
        compliance.Backlash(b=1e-3, joints=J2), {"b": 1e-3}, lambda s: behind_a_spring(s, 4e4, 150.0, 1e-3),
        rate=250.0, seconds=8.0, off=0.2,
    ),
    Case(
        compliance.JointElasticity(joints=J2), {"K": 1500.0}, rate=200.0, off=0.1, noise=1e-3,
        torque=lambda s: only(TRUE["Ia"][1] / 1500 * np.gradient(np.gradient(s.rigid[:, 1], 0.005), 0.005)),
    ),
    Case(
        compliance.JointElasticity(antiresonance=10.0, joints=J2), {"K": SOFT},
        lambda s: behind_a_spring(s, SOFT, 11.5), seconds=8.0, off=0.1, noise=2e-3,
    ),
    Case(
        transmission.TorqueRipple(N=50.0, joints=J2), {"A": 1.7, "N": 50.0},
        lambda s: only(1.7 * np.sin(50 * s.q + 0.6)),
    ),
    Case(
        friction.PositionDependentFriction(joints=J2), {"a": 0.2, "b": -0.1}, off=0.1,
        torque=lambda s: only(TRUE["Fc"][1] * (0.2 * np.cos(s.q) - 0.1 * np.sin(s.q)) * s.sign),
    ),
    Case(transmission.JointCoupling(joints=("joint_2", "joint_3")), {"Fv": 1.1, "Fc": 0.7}, coupled, at="joint_3"),
    Case(load.CableDrag(joints=J2), {"k": 6.0}, lambda s: only(6 * s.q), off=0.1),
    Case(
        load.CableDrag(stiffens=True, rest=0.5, joints=J2), {"k": 6.0},
        lambda s: only(6 * s.q + 4 * (s.q - 0.5) ** 3), off=0.1,
    ),
    # a spring without length of its own: of one order, which gravity itself imitates
    Case(load.GravityCompensation(joints=J2), {}, lambda s: only(-80 * np.sin(2 * s.q - 0.4))),
    Case(load.Payload(runs=("swing_1",)), {"m": 2.0, "c_x": 0.05, "c_z": 0.1}, ball, off=0.05),
    Case(load.BaseTilt(), {"angle_x": 0.05, "angle_y": -0.03}, tilted, off=0.1),
    Case(
        load.ExternalContact(start=4.0, stop=9.0, runs=("swing_1",)),
        {"f_x": 30.0, "f_y": -20.0, "f_z": 40.0, "f": 2900**0.5}, push,
    ),
    Case(sensing.TorqueConstantError(joints=J2), {"g": 1.15}, reading=lambda s: only(0.15 * s.real[:, 1]), off=0.05),
    Case(sensing.TorqueDrift(joints=J2), {"r": 0.08}, reading=lambda s: only(0.08 * s.motion.time)),
    Case(sensing.EncoderOffset(joints=J2), {}, reading=shifted, visible=False),  # a plane arm carries its zero along
    Case(sensing.TimeDelay(d=0.02, joints=J2), {"d": 0.02}, reading=late, off=0.1),
    Case(
        drive.WindingTemperature(), {"T": 30.0}, off=0.1,
        power=lambda s: (TRUE["R"] * 0.0039 * (warm(s.motion) - 25) * (s.real / KT) ** 2).sum(axis=1),
    ),
    Case(
        drive.IronLoss(joints=J2), {"k1": 9.0, "k2": 4.0}, power=lambda s: 9 * np.abs(s.dq) + 4 * s.dq**2, off=0.1,
    ),
    Case(drive.InverterLoss(joints=J2), {"V0": 3.0}, power=lambda s: 3 * np.abs(s.real[:, 1]) / KT, off=0.1),
    Case(supply.NoRegeneration(), {"returned": 0.0}, power=lambda s: np.maximum(s.axes, 0) - s.axes),
    Case(supply.BusCapacitor(E=30.0), {"E": 30.0}, power=stored),
    Case(
        supply.HoldingBrakes(delay=0.5), {"Pb": 40.0}, rests_from=10.0,
        power=lambda s: np.where(s.motion.time - 10 <= 0.5, 40.0, 0.0),
    ),
    Case(sensing.MeterLag(T=0.2), {"T": 0.2}, power=lagged),
    Case(sensing.MeterGain(), {"g": 1.2}, power=lambda s: 0.2 * s.power, off=0.02),
    Case(
        local.LocalWear(q0=0.1, w=0.08, joints=J2), {"Fw": 3.0, "q0": 0.1, "w": 0.08},
        lambda s: only(3 * s.sign * np.exp(-(((s.q - 0.1) / 0.08) ** 2))), seconds=8.0,
    ),
    Case(
        local.JointLimitSpring(q0=-0.3, side=-1.0, joints=J2), {"k": 40.0, "q0": -0.3, "side": -1.0},
        lambda s: only(40 * np.minimum(s.q + 0.3, 0.0)), seconds=8.0, off=0.05,
    ),
    Case(
        disturbance.PeriodicDisturbance(f=2.9, joints=J2), {"f": 2.9, "A": 5.0},
        lambda s: only(5 * np.sin(2 * np.pi * 2.9 * s.motion.time + 0.4)),
    ),
    Case(
        disturbance.SwitchingLoad(period=4.0, duty=0.3, start=1.0), {"P": 80.0, "duty": 0.3, "period": 4.0},
        power=lambda s: 80.0 * ((s.motion.time - 1.0) % 4.0 < 1.2),
    ),
]  # fmt: skip


def measured(case, seed):
    motion = swing(ROBOT, seed, seconds=case.seconds, rate=case.rate)
    if stop := case.rests_from:  # the arm rests from then on
        rest = motion.time > stop
        still = {name: np.where(rest[:, None], 0.0, getattr(motion, name)) for name in ("dq", "ddq")}
        motion = replace(motion, q=np.where(rest[:, None], motion.q[np.argmax(rest)], motion.q), **still)
    motion = replace(motion, temperature=warm(motion))
    state = healthy(motion)
    rng = np.random.default_rng(seed)
    shown = state.shown + case.noise * rng.standard_normal(state.shown.shape)
    if case.reading:
        shown = shown + case.reading(state)
    power = state.power
    if case.torque:
        added = case.torque(state)
        whole = state.real + added
        shown = shown + added
        power = TRUE["P0"] + (whole * motion.dq + TRUE["R"] * (whole / KT) ** 2).sum(axis=1)
    if case.power:
        power = power + case.power(state)
    return replace(motion, torque=shown, power=power + case.noise * rng.standard_normal(len(power)))


@pytest.mark.parametrize(
    "case",
    [pytest.param(case, marks=[pytest.mark.nightly] * (str(case) == "backlash"), id=str(case)) for case in CASES],
)
def test_truth_is_found_predicted_booked_and_saved(case, tmp_path):
    motions = [measured(case, seed) for seed in range(2)]
    twin = identify(ROBOT, motions, (*BASELINE, "copper_loss", case.effect))
    own = [one for one in (*twin.parameters, *twin.quantities) if one.effect == case.effect.id]
    found = {one.name: one.value for one in own if one.joint in (case.at, None)}
    for name, value in case.truth.items():
        assert found[name] == pytest.approx(value, rel=case.off, abs=0.02 if value == 0 else None), name
    without = identify(ROBOT, motions, (*BASELINE, "copper_loss"))
    again = measured(case, 1 if case.effect.runs else 7)

    def errors(judged):
        moving = np.all(np.abs(again.dq) > 1e-2, axis=1)
        torque = np.sqrt(np.mean((judged.torque(again) - again.torque)[moving] ** 2))
        return torque, np.sqrt(np.mean((judged.power(again) - again.power) ** 2))

    which = int(case.effect.signal == "power")
    assert errors(twin)[which] < (0.6 * errors(without)[which] if case.visible else 1.2 * case.noise)
    assert sum(entry.energy for entry in twin.ledger(again)) == pytest.approx(twin.energy(again), rel=1e-9)
    (tmp_path / "twin.json").write_text(to_json(twin))
    loaded = load_twin(tmp_path / "twin.json")
    assert loaded.effects == twin.effects and loaded.quantities == twin.quantities
    np.testing.assert_array_equal(loaded.torque(again), twin.torque(again))
    np.testing.assert_array_equal(loaded.power(again), twin.power(again))


def test_an_elastic_joint_moves_the_others_as_its_full_dynamics_say():
    motion = swing(ROBOT, 2, seconds=4, rate=200)
    added = behind_a_spring(healthy(motion), SOFT, 11.5)
    said = compliance.JointElasticity(antiresonance=10.0, joints=J2).columns(ROBOT, motion)[..., 0]
    share = SOFT / ((2 * np.pi * 10) ** 2 * ROBOT.mean_inertia[1])  # of the spring whose link swings so
    missed, whole = (np.sqrt((values[motion.time > 1] ** 2).mean(axis=0)) for values in (added - said / share, added))
    assert (missed[1:] < 0.15 * whole[1:]).all()
    assert missed[0] < 0.1 * whole[1]  # of the upright axis: Coriolis' force alone


def test_an_encoders_offset_shifts_torque_as_inverse_dynamics_says():
    motion = swing(ROBOT, 2, seconds=3)
    state = healthy(motion)
    column = sensing.EncoderOffset(joints=J2).columns(ROBOT, motion)[:, :, 0]
    np.testing.assert_allclose(column * 1e-4, shifted(state, 1e-4), atol=1e-5)


def test_every_effect_beyond_the_baseline_has_a_case():
    assert {case.effect.id for case in CASES} == catalogue().keys() - {*BASELINE, "copper_loss"}


@pytest.mark.parametrize("name, key, value", [("stribeck_friction", "vs", 0.08), ("meter_lag", "T", 0.2)])
def test_data_choose_the_shape_of_an_effect_that_is_only_named(name, key, value):
    case = next(case for case in CASES if case.effect.id == name)
    twin = identify(ROBOT, [measured(case, seed) for seed in range(2)], (*BASELINE, "copper_loss", name))
    chosen = [effect for effect in twin.stack.effects if effect.id == name and "joint_2" in (effect.joints or J2)]
    assert [getattr(effect, key) for effect in chosen] == [pytest.approx(value, rel=0.02)]


@pytest.mark.parametrize("effect", catalogue().values(), ids=lambda effect: effect.id)
def test_columns_are_one_per_term_and_blind_to_other_joints(effect):
    motion = swing(ROBOT, 3, seconds=3)
    motion = replace(motion, temperature=warm(motion))
    rng = np.random.default_rng(0)
    predicted = Predicted(rng.normal(size=motion.q.shape), rng.normal(size=300), rng.normal(size=300))
    everywhere = effect.columns(ROBOT, motion, predicted)
    shape = (300,) if effect.signal == "power" else (300, 3)
    assert everywhere.shape == (*shape, len(effect.terms(ROBOT)))
    if effect.terms(ROBOT)[0].joint and effect.id not in ("rigid_body", "joint_coupling"):
        own = effect.on("joint_2")
        assert {term.joint for term in own.terms(ROBOT)} == {"joint_2"}
        chosen = [term.joint == "joint_2" for term in effect.terms(ROBOT)]
        np.testing.assert_array_equal(own.columns(ROBOT, motion, predicted), everywhere[..., chosen])
    for candidate in effect.candidates(ROBOT):
        assert np.all(np.isfinite(candidate.columns(ROBOT, motion, predicted)))
        assert type(candidate) is type(effect)


@pytest.mark.parametrize("case", [case for case in CASES if case.effect.memory], ids=str)
def test_memory_reaches_over_the_pieces_of_a_run(case):
    stack = Stack(ROBOT, (*BASELINE, "copper_loss", case.effect))
    motion = measured(case, 1)
    both = stack.torque_terms, stack.power_terms
    torque, power = (np.array([term.expected + 0.1 for _, term in terms]) for terms in both)
    for columns, values in ((stack.torque_columns, [torque]), (stack.predicted_power_columns, [torque, power])):
        pieces = np.concatenate([columns(piece, *values) for piece in motion.pieces(217)])
        np.testing.assert_allclose(pieces, columns(motion, *values), atol=1e-9)
