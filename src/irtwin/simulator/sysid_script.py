"""Fit a model's numbers to a robot's log by MuJoCo's own system identification, beginning where irtwin ended.

    pip install irtwin "mujoco[sysid]"
    python THIS_FILE

FREE has the numbers that `irtwin diagnose` found to be others. Change what you doubt, and run it again: where a number
begins, its bounds, a line more or less. What is fitted is printed beside what was found, and written to FITTED.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from mujoco import sysid

from irtwin.signals.log import DataSet, read_data_set
from irtwin.simulator.assembly import add_servo
from irtwin.simulator.formats import read_model_file
from irtwin.simulator.model import drop_pictures

# files, from where this one is
MODEL, LOGS, FITTED = "model.xml", "my_robot", "fitted.xml"
# joint, and the gains of its controller, kp and kd, where the model has no servo of its own
GAINS: Mapping[str, tuple[float, float]] = {}
# what the model calls the robot's joints, in their order; none where it calls them as the robot does
JOINTS: Sequence[str] = ()
# joint or body, number, the model's, the robot's, and bounds
FREE: Sequence[tuple[str, str, list[float], list[float], list[float], list[float]]] = ()
# what the robot has and no number of the model can say
LACKS: Sequence[str] = ()
# stretches of all runs, evenly spread, and how long each is played from where the robot is
STRETCHES, SECONDS = 16, 15.0
ITERATIONS = 50  # of the optimiser, at most


def change(spec: mujoco.MjSpec, parameter: sysid.Parameter, of: str, number: str) -> None:
    """Give a model's specification a number of a joint, of its servo, of a body, or of gravity."""
    value, joint, servo = parameter.value, spec.joint(of), servo_of(spec, of)
    match number:
        case "kp":
            servo.biasprm[0] *= value[0] / servo.gainprm[0]  # an offset of its command stays
            servo.gainprm[0], servo.biasprm[1] = value[0], -value[0]
        case "kv":
            servo.biasprm[2] = -value[0]
        case "offset":  # rad (m), added to its command
            servo.biasprm[0] = servo.gainprm[0] * value[0]
        case "forcerange":
            servo.forcelimited, servo.forcerange = True, (-value[0], value[0])
        case "damping":
            joint.damping[0] = value[0]
        case "frictionloss" | "armature":
            setattr(joint, number, value[0])
        case "solimpfriction":  # how firmly dry friction holds
            joint.solimp_friction[:2] = value[0]
        case "mass":  # and where its centre is
            sysid.apply_body_inertia(spec, of, parameter)
        case "gravity":  # along x and y: a tilted base
            length = np.linalg.norm(spec.option.gravity)
            spec.option.gravity = *value, np.copysign(np.sqrt(length**2 - value @ value), spec.option.gravity[2])


def servo_of(spec: mujoco.MjSpec, joint: str) -> Any:
    """Return the servo of a joint, None where it is none's."""
    return next((actuator for actuator in spec.actuators if actuator.target == joint), None)


def parameters() -> sysid.ParameterDict:
    """Return what is free: nominal is the model's number, the value to begin from the robot's."""
    free = sysid.ParameterDict()
    for of, number, model, robot, least, most in FREE:
        modifier = None if number == "delay" else partial(change, of=of, number=number)
        parameter = sysid.Parameter(f"{of} {number}", model, least, most, modifier=modifier)
        parameter.value = np.array(robot, dtype=float, ndmin=1)
        parameter.inertia_type, parameter.scale_rot_inertia = sysid.InertiaType.MassIpos, False  # of a mass
        free.add(parameter)
    return free


def loaded(model: Path) -> mujoco.MjSpec:
    """Return a model's specification, with servos by the controllers' gains that are told."""
    file = read_model_file(model)
    spec = file.spec()
    if file.is_urdf:  # what pictures need may be missing
        drop_pictures(spec, is_urdf=True)
    for joint, gains in GAINS.items():
        add_servo(spec, joint, gains)
    return spec


def specification(model: Path, joints: Sequence[str]) -> mujoco.MjSpec:
    """Return a model's specification whose sensors are the positions of the robot's joints."""
    spec = loaded(model)
    for sensor in list(spec.sensors):
        spec.delete(sensor)
    for joint in joints:
        spec.add_sensor(type=mujoco.mjtSensor.mjSENS_JOINTPOS, objtype=mujoco.mjtObj.mjOBJ_JOINT, objname=joint)
        spec.sensors[-1].name = joint
    for of, number, *_ in FREE:
        if number == "delay":  # commands have it while they are played
            servo_of(spec, of).delay = 0.0
    return spec


def stretches(data_set: DataSet, spec: mujoco.MjSpec) -> tuple[sysid.ModelSequences, list[np.ndarray]]:
    """Return stretches of the observed runs, and the speeds (N, nu) that are commanded in each."""
    model, joints = spec.compile(), JOINTS or data_set.robot.joint_names
    places = [model.jnt_qposadr[model.joint(joint).id] for joint in joints]
    speeds = [model.jnt_dofadr[model.joint(joint).id] for joint in joints]
    drives = [
        next(k for k in range(model.nu) if model.actuator(k).trnid[0] == model.joint(joint).id) for joint in joints
    ]
    names, states, controls, measured, speeds_told = [], [], [], [], []
    runs = [run for run in data_set.runs if run.role == "observed"]
    for run in runs:
        signals, commands, lasts = run.signals, np.asarray(run.signals.command), np.ptp(run.signals.time)
        commanded_speeds = np.zeros_like(commands) if signals.command_speed is None else signals.command_speed
        count = max(1, min(int(lasts // SECONDS), round(STRETCHES / len(runs))))
        for place in range(count):
            begin = signals.time[0] + max(0.0, (place + 0.5) * lasts / count - SECONDS / 2)
            rows = (signals.time >= begin) & (signals.time < begin + SECONDS)
            time, q = signals.time[rows] - signals.time[rows][0], signals.q[rows]
            qpos, qvel = model.qpos0.copy(), np.zeros(model.nv)
            few = time <= time[1] + 0.1
            qvel[speeds], qpos[places] = np.polyfit(time[few], q[few], 1)
            steps = np.arange(0.0, time[-1], model.opt.timestep)
            held = np.searchsorted(time, steps, side="right") - 1  # each command until the next comes
            told = np.zeros((2, len(steps), model.nu))
            told[:, :, drives] = commands[rows][held], commanded_speeds[rows][held]
            told *= model.actuator_gear[:, 0]
            names.append(f"{run.name} from {begin:g} s")
            states.append(sysid.create_initial_state(model, qpos, qvel))
            controls.append(sysid.TimeSeries.from_control_names(steps, told[0], model))
            speeds_told.append(told[1])
            measured.append(sysid.TimeSeries.from_names(time, q, model))
    return sysid.ModelSequences("robot", spec, names, states, controls, measured), speeds_told


def difference(
    params: sysid.ParameterDict,
    predicted: sysid.TimeSeries,
    measured: sysid.TimeSeries,
    model: mujoco.MjModel,
    return_pred_all: bool,
    state: np.ndarray,
) -> tuple[np.ndarray, sysid.TimeSeries, sysid.TimeSeries]:
    """Return what the robot's positions have beyond the model's, rad (m), all joints alike.

    By the states: MuJoCo's sensors are a step late.
    """
    places = [1 + model.jnt_qposadr[joint] for joint in model.sensor_objid]
    moved = sysid.TimeSeries(state[:, 0], state[:, places], measured.signal_mapping).resample(measured.times)
    return measured.data - moved.data, moved, measured


def played_late(
    models: Sequence[mujoco.MjModel],
    control_signal: Sequence[sysid.TimeSeries],
    param_dicts: Sequence[sysid.ParameterDict],
    speeds: Sequence[np.ndarray],
    **others: Any,
) -> Sequence[sysid.SystemTrajectory]:
    """Play commands, each joint's as late as its `delay` says; controllers of told gains damp towards `speeds`."""
    late = []
    for place, control in enumerate(control_signal):
        of, model = param_dicts[place * len(param_dicts) // len(models)], models[place]
        told = control.data.copy()
        for drive in range(told.shape[1]):
            joint = joint_of(model, drive)
            if joint in GAINS:
                lead = -model.actuator_biasprm[drive, 2] / model.actuator_gainprm[drive, 0]
                told[:, drive] += lead * speeds[place % len(speeds)][:, drive]
            delay = f"{joint} delay"
            if delay in of:
                told[:, drive] = np.interp(control.times - of[delay].value[0], control.times, told[:, drive])
        late.append(sysid.TimeSeries(control.times, told, control.signal_mapping))
    trajectories: Sequence[sysid.SystemTrajectory] = sysid.sysid_rollout(models=models, control_signal=late, **others)
    return trajectories


def joint_of(model: mujoco.MjModel, drive: int) -> str:
    """Return the name of the joint that an actuator drives."""
    return str(model.joint(model.actuator(drive).trnid[0]).name)


def written(fitted: sysid.ParameterDict, model: Path) -> str:
    """Return the model with what was fitted, as MJCF."""
    spec = loaded(model)
    for (of, number, *_), parameter in zip(FREE, fitted.values(), strict=True):
        parameter.apply_modifier(spec)
        if number == "delay":
            servo = servo_of(spec, of)
            servo.delay = parameter.value[0]
            servo.nsample = int(np.ceil(servo.delay / spec.option.timestep)) + 1
            servo.interp = 1  # linear; else MuJoCo's delay is of whole steps
    spec.compile()
    return str(spec.to_xml())


def main() -> None:
    """Fit, print and write."""
    here = Path(__file__).parent
    for line in LACKS:
        print(f"The model cannot say: {line}")
    data_set, free = read_data_set(here / LOGS, commanded=True), parameters()
    sequences, speeds = stretches(data_set, specification(here / MODEL, JOINTS or data_set.robot.joint_names))
    residual = sysid.build_residual_fn(
        models_sequences=[sequences], custom_rollout=partial(played_late, speeds=speeds), modify_residual=difference
    )
    fitted, result = sysid.optimize(
        free,
        residual,
        verbose=False,
        x_scale="jac",  # numbers are of many units
        gtol=1e-4,  # rad: a tenth of the noise of encoders
        xtol=1e-5,  # of all numbers together
        max_iters=ITERATIONS,
        mu_factor=10.0,  # at the end, where nothing is won, it tries all it has
    )
    left = [residual(x, free.copy())[0] for x in (free.as_nominal_vector(), free.as_vector(), result.x)]
    rms = [1e3 * np.sqrt(np.mean(np.concatenate([part.ravel() for part in some]) ** 2)) for some in left]
    print("Tracking error, mrad (mm): model {:.2f}, by irtwin {:.2f}, fitted {:.2f}".format(*rms))
    _, spread = sysid.calculate_intervals([part.ravel() for part in left[-1]], result.jac)
    names = [f"{parameter.name} {k or ''}" for parameter in free.values() for k in range(parameter.size)]
    for row in zip(names, free.as_nominal_vector(), free.as_vector(), fitted.as_vector(), spread, strict=True):
        print("{:32} model {:10.4g}  by irtwin {:10.4g}  fitted {:10.4g} +- {:.2g}".format(*row))
    (here / FITTED).write_text(written(fitted, here / MODEL), encoding="utf-8")


if __name__ == "__main__":
    main()
