"""What two runs of one motion differ by: found, described, and not found where there is noise alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.gap.test_diagnosis import data_set
from tests.synthetic import arm, as_run, measure, swing

from irtwin.gap.data.case import case_of
from irtwin.gap.data.noise_floor import noise_floor
from irtwin.gap.diagnosis import diagnose
from irtwin.gap.repeats.disturbances import disturbances
from irtwin.gap.repeats.lines import lines
from irtwin.gap.repeats.series import EvenSeries, correlation_samples
from irtwin.gap.repeats.slow import creep
from irtwin.gap.repeats.switching import saved
from irtwin.gap.thresholds import DEFAULT

ROBOT = arm(3)


def repeated(change=None, **more):
    return case_of(data_set(runs_of_one_motion(change, **more), ROBOT), (), DEFAULT)


def runs_of_one_motion(change=None, count=2, noise=0.3, rate=100.0):
    """Two to four runs; `change(run's number, time)` gives what is added to torque (N, n) and power."""
    made = []
    for number in range(count):
        motion = replace(swing(ROBOT, 0, seconds=10.0, rate=rate), run=f"run_{number}")
        shown = replace(measure(ROBOT, motion, noise=noise, seed=number), current=None)
        if change is not None:
            torque, power = change(number, motion.time)
            shown = replace(shown, torque=shown.torque + torque, power=shown.power + power)
        made.append(replace(as_run(shown), role="observed", repeat_of="run_0" if number else None))
    return made


def in_joint_2(values):
    return np.column_stack([np.zeros_like(values), values, np.zeros_like(values)]), np.zeros_like(values)


def in_power(values):
    return np.zeros((len(values), 3)), values


def only(found):
    assert len(found) == 1, [(one.kind, one.joint) for one in found]
    return found[0], {each.name: each for each in found[0].quantities}


def wandering(count, memory, rng):
    """Noise of unit variance that remembers `memory` samples."""
    found = np.zeros(count)
    for k, push in enumerate(rng.standard_normal(count)):
        found[k] = found[k - 1] * (1 - 1 / memory) + push
    return found / found.std()


def test_all_motions_have_the_cutoff_that_is_stated_or_found():
    found = repeated()
    assert not found.cutoff.stated
    stated = case_of(replace(data_set(list(found.runs), ROBOT), cutoff=7.25), (), DEFAULT)
    assert stated.cutoff.stated
    for case in (found, stated):
        assert {motion.cutoff for motion in case.motions.values()} == {case.cutoff.hz}
    assert stated.cutoff.hz == 7.25 != found.cutoff.hz


@pytest.mark.parametrize("frequency", [0.5, 2.9, 12.0, 30.0])
def test_a_torque_that_swings_is_a_line_at_its_joint(frequency):
    case = repeated(lambda k, t: in_joint_2(3.0 * np.sin(2 * np.pi * frequency * t + 2.0 * k)))
    one, said = only(disturbances(case))
    assert (one.channel, one.joint, one.kind) == ("torque", "joint_2", "line")
    assert said["f"].value == pytest.approx(frequency, abs=0.02)
    assert said["f"].lower < frequency < said["f"].upper
    assert one.share > 0.5 and one.p < 1e-3


@pytest.mark.parametrize("duty", [0.2, 0.5, 0.8])
def test_a_load_that_switches_is_told_by_its_power_duty_and_period(duty):
    case = repeated(lambda k, t: in_power(60.0 * ((t / 3.0 + 0.4 * k) % 1 < duty)))
    one, said = only(disturbances(case))
    assert (one.channel, one.joint, one.kind) == ("power", None, "switching")
    assert said["P"].value == pytest.approx(60.0, rel=0.1)
    assert said["duty"].value == pytest.approx(duty, abs=0.06)
    assert said["period"].value == pytest.approx(3.0, rel=0.1)


@pytest.mark.parametrize(("duty", "later", "period"), [(0.34, 0.15, 3.0), (0.8, 0.3, 3.0), (0.5, 0.5, 1.5)])
def test_motion_takes_nothing_of_a_load(duty, later, period):
    case = repeated(lambda k, t: in_power(60.0 * ((t / period + later * k) % 1 < duty)))
    one, said = only(disturbances(case))
    assert one.kind == "switching" and said["P"].value == pytest.approx(60.0, rel=0.1)
    assert said["period"].value == pytest.approx(period, rel=0.05) and said["duty"].value == pytest.approx(
        duty, abs=0.05
    )


def warming(size, constant=2.0):
    """The loss of windings that are cold in the second run, and warm as it goes on."""
    motion = swing(ROBOT, 0, seconds=10.0)
    loss = np.sum(measure(ROBOT, motion).torque ** 2, axis=1)
    return lambda k, t: in_power(size * loss / loss.mean() * (1 - k * np.exp(-t / constant)))


@pytest.mark.parametrize("constant", [2.0, 5.0])
def test_windings_that_warm_drift_and_are_no_load_that_switches(constant):
    one, said = only(disturbances(repeated(warming(100.0, constant))))
    time = np.arange(1000) / 100
    slope = np.polyfit(time, 100.0 * np.exp(-time / constant), 1)[0]
    assert (one.channel, one.joint, one.kind) == ("power", None, "drift")
    assert said["drift"].value == pytest.approx(slope, rel=0.2)


@pytest.mark.parametrize("seed", range(3))
def test_a_course_that_costs_more_than_it_says_is_no_load(seed):
    rng = np.random.default_rng(seed)
    assert disturbances(repeated(lambda k, t: in_power(3.0 * wandering(len(t), 8, rng)))) == []


@pytest.mark.parametrize("apart", [0.3, 1.0, 3.0])
def test_phases_of_a_line_are_in_the_interval_of_its_amplitude(apart):
    _, said = only(disturbances(repeated(lambda k, t: in_joint_2(3.0 * np.sin(2 * np.pi * 2.9 * t + apart * k)))))
    assert said["A"].lower < 3.0 < said["A"].upper


def test_a_slow_line_is_no_drift_that_runs_share():
    case = repeated(lambda k, t: in_joint_2(9.0 * np.sin(2 * np.pi * 0.32 * t + 0.3 * k)))
    assert [one.kind for one in disturbances(case)] == ["line"]


def test_an_offset_between_runs_is_located():
    one, said = only(disturbances(repeated(lambda k, t: in_joint_2(4.0 * k + 0 * t))))
    assert (one.joint, one.kind) == ("joint_2", "offset")
    assert said["offset"].lower < -4.0 < said["offset"].upper


def test_a_drift_is_located_and_is_no_offset_too():
    one, said = only(disturbances(repeated(lambda k, t: in_joint_2(0.5 * k * t))))
    assert (one.joint, one.kind) == ("joint_2", "drift")
    assert said["drift"].lower < -0.5 < said["drift"].upper


@pytest.mark.slow
def test_a_drift_that_both_runs_share_is_found_by_the_search(no_experiment):
    found = diagnose(data_set(runs_of_one_motion(lambda k, t: in_joint_2(0.5 * t)), ROBOT))
    assert {cause.effect: cause.joints for _, cause in found.causes}["torque_drift"] == ("joint_2",)
    assert found.not_repeating == ()


def test_an_offset_that_both_runs_share_repeats():
    assert disturbances(repeated(lambda k, t: in_joint_2(4.0 + 0 * t))) == []


@pytest.mark.parametrize(("times", "count"), [(0.4, 0), (1.2, 1)])
def test_an_offset_matters_from_half_of_the_noise_on(times, count):
    quiet = repeated()
    noise = noise_floor(quiet.runs, quiet.motions, DEFAULT.data).sensor_torque[1]
    assert len(disturbances(repeated(lambda k, t: in_joint_2(times * noise * k + 0 * t)))) == count


def test_a_strong_line_does_not_hide_itself_by_what_it_leaks():
    time, rng = np.arange(1000) / 125, np.random.default_rng(0)
    slow = np.column_stack([np.ones(1000), time, np.tanh(np.sin(2.4 * time) / 0.02), np.sin(2.4 * time)])
    series = EvenSeries(time, 80 * np.sin(2 * np.pi * 0.8 * time) + rng.standard_normal(1000), slow)
    found, _ = lines([series], 6)
    assert [round(one.frequency, 2) for one in found] == [0.8]
    assert found[0].p < 1e-12


@pytest.mark.parametrize("count", [2, 4])
def test_noise_differs_but_is_no_disturbance(count):
    assert disturbances(repeated(count=count)) == []


def test_friction_that_differs_between_runs_follows_the_motion():
    speed = swing(ROBOT, 0, seconds=10.0).dq[:, 1]
    assert disturbances(repeated(lambda k, t: in_joint_2(k * (2.0 * np.sign(speed) + speed)))) == []


def test_what_is_small_beside_the_noise_is_no_disturbance():
    assert disturbances(repeated(lambda k, t: in_joint_2(0.02 * np.sin(18.2 * t + 2 * k)))) == []


def test_without_repeats_nothing_is_said():
    case = repeated(lambda k, t: in_joint_2(3.0 * np.sin(18.2 * t + 2.0 * k)))
    assert disturbances(replace(case, runs=tuple(replace(run, repeat_of=None) for run in case.runs))) == []


def test_a_line_of_what_follows_the_motion_is_none_of_what_differs():
    rng, time = np.random.default_rng(0), np.arange(0, 15, 0.01)
    slow = np.sin(0.4 * time)
    rounding = slow + 0.3 * np.sin(2 * np.pi * 7.9 * time)
    series = EvenSeries(time, slow + 0.2 * rng.standard_normal(len(time)), rounding[:, None])
    assert lines([series], 6)[0] == []


@pytest.mark.parametrize("memory", [1, 5, 20, 100])
def test_noise_that_remembers_has_no_lines(memory):
    rng, false = np.random.default_rng(memory), 0
    time = np.arange(1000) / 125
    for _ in range(30):
        series = EvenSeries(time, wandering(1000, memory, rng), np.column_stack([np.ones(1000), time]))
        false += bool(lines([series], 6)[0])
    assert false <= 1


@pytest.mark.parametrize("memory", [1, 10, 50])
def test_the_correlation_of_what_remembers_is_found(memory):
    rng = np.random.default_rng(0)
    found = np.median([correlation_samples(wandering(4000, memory, rng)) for _ in range(10)])
    assert found == pytest.approx(max(2 * memory - 1, 1), rel=0.3)


def test_a_line_is_no_sensors_noise():
    case = repeated(lambda k, t: in_joint_2(18.0 * np.sin(2 * np.pi * 30.0 * t + 2.0 * k)))
    quiet = repeated()
    loud, still = (noise_floor(one.runs, one.motions, DEFAULT.data) for one in (case, quiet))
    assert loud.sensor_torque[1] < 2 * still.sensor_torque[1] < 0.3


TIME = np.arange(1000) / 100
COPPER = 1 + np.sin(2.2 * TIME) ** 2


@pytest.mark.parametrize("course", [TIME, 10 * (1 - np.exp(-TIME / 2.5))])
@pytest.mark.parametrize("loss", [np.ones(1000), COPPER / COPPER.mean()])
def test_a_drift_is_followed_and_is_by_so_much_a_second(course, loss):
    drift = 3.0 * loss * course
    noise = 0.1 * np.random.default_rng(0).standard_normal(1000)
    series = EvenSeries(TIME, 7.0 + drift + noise, np.column_stack([np.ones(1000), TIME - TIME.mean(), COPPER]))
    found = creep(series, COPPER[:, None])
    assert np.std(found.left()) == pytest.approx(0.1, rel=0.1)
    assert found.coefficients()[1] == pytest.approx(np.polyfit(TIME, drift, 1)[0], rel=0.1)


def test_noise_is_no_exponential():
    noise = np.random.default_rng(1).standard_normal(1000)
    found = creep(EvenSeries(TIME, noise, np.column_stack([np.ones(1000), TIME - TIME.mean()])), None)
    assert np.allclose(np.diff(found.beside[:, 1]), TIME[1])


def test_white_noise_is_worth_its_likelihood():
    after = np.random.default_rng(0).standard_normal(2000)
    assert saved([2 * after], [after]) == pytest.approx(2000 / 2 * np.log(4), rel=0.1)


def test_each_series_saves_by_itself():
    after = np.random.default_rng(0).standard_normal(500)
    assert saved([2 * after, after], [after, after]) == pytest.approx(saved([2 * after], [after]))


def test_what_remembers_says_less():
    after = np.convolve(np.random.default_rng(0).standard_normal(2000), np.ones(20), "valid")
    assert saved([2 * after], [after]) < 0.1 * len(after) / 2 * np.log(4)
