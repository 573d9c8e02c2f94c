"""Four robots whose energies are small round numbers, as rows: every named question can be answered of them by hand.

Arm_A was diagnosed as changed, Arm_B as ambiguous, Arm_C as unexplained and burns what its braking gives back;
Arm_D has a run and no twin. The ledger of each run adds up to its modelled energy. Arm_B is watched just now, far from
its twin; Arm_D was.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from typing import Any

from sqlalchemy.orm import Session

from irtwin.knowledge.vocabulary import GRAPH_SOURCE, IRT, XSD
from irtwin.storage import energy_schema, schema
from irtwin.storage import structure_schema as structure
from irtwin.storage.asserted import AssertedFact
from irtwin.storage.database import Workspace
from irtwin.storage.gap_schema import CLASSES, GapDiagnosis
from irtwin.storage.schema import Base

SOFTWARE = "irtwin 0.1.0"
JOINTS = {"Arm_A": ["j1", "j2"], "Arm_B": ["j1", "j2"], "Arm_C": ["j1"], "Arm_D": ["j1"]}
EFFECTS = {
    "Arm_A": ["rigid_body", "coulomb_friction", "standby_power"],
    "Arm_B": ["rigid_body", "standby_power"],
    "Arm_C": ["rigid_body", "coulomb_friction", "standby_power", "no_regeneration"],
}
# robot, run, start, s, payload kg, idle share, part, then J: measured, modelled, standby, returned; W: peak, RMSE
RUNS: list[tuple[Any, ...]] = [
    ("Arm_A", "fit_1", "2026-03-02 08:00", 10.0, 0.0, 0.1, "fit", 1000.0, 980.0, 500.0, 20.0, 250.0, 4.0),
    ("Arm_A", "check_1", "2026-03-02 09:00", 20.0, 3.0, 0.2, "held_out", 2000.0, 1760.0, 1000.0, 100.0, 300.0, 15.0),
    ("Arm_A", "idle_1", "2026-03-03 09:00", 30.0, 0.0, 0.8, "held_out", 1600.0, 1568.0, 1500.0, 0.0, 120.0, 2.0),
    ("Arm_B", "work_1", "2026-03-02 10:00", 5.0, 0.0, 0.0, "fit", 500.0, 400.0, 100.0, 10.0, 200.0, 25.0),
    ("Arm_B", "work_2", "2026-03-04 10:00", 8.0, 1.0, 0.05, "held_out", 800.0, 776.0, 160.0, 200.0, 260.0, 5.0),
    ("Arm_C", "press_1", "2026-03-04 06:00", 10.0, 0.0, 0.5, "fit", 400.0, 400.0, 100.0, 60.0, 90.0, 1.0),
    ("Arm_C", "press_2", "2026-04-01 06:00", 10.0, 0.0, 0.25, "held_out", 440.0, 400.0, 100.0, 40.0, 95.0, 3.0),
    ("Arm_D", "first", "2026-03-05 06:00", 4.0, 2.0, None, None, None, None, None, None, None, None),
]
REPEATS = {"Arm_C.press_2": "Arm_C.press_1"}
MADE = {  # run: product, pieces, cycles
    "Arm_A.fit_1": ("bracket", 10, None),
    "Arm_A.check_1": ("bracket", 30, 15),
    "Arm_C.press_1": (None, None, 4),
}
SLOWER = {"Arm_B.haul": ("Arm_B.work_1", 1.6, 12.0, 5.0)}  # plan: the run, times longer, J saved, half its interval
PLANS: list[
    tuple[Any, ...]
] = [  # robot, plan, the run that carried it out, s, payload kg, J: energy, half its interval
    ("Arm_A", "pick", "check_1", 18.0, 9.0, 1900.0, 150.0),
    ("Arm_B", "haul", "work_2", 8.0, 1.0, 700.0, 20.0),
    ("Arm_D", "draft", None, 900.0, 0.0, None, None),
]
LIVE = [  # robot, run, start, s, payload kg, stream, stale since, why
    ("Arm_B", "live_1", "2026-03-03 10:00", 12.0, 1.0, "stale", "2026-03-03 10:00:12", "no state came for 2.0 s"),
    ("Arm_D", "live_1", "2026-03-05 05:00", 4.0, 2.0, "ended", None, None),
]
EXCURSIONS = [  # of Arm_B.live_1: channel, joint, number, began, ended, s, residual, unit, times its band
    ("torque", "j2", 1, "2026-03-03 10:00:02", "2026-03-03 10:00:06", 4.0, 7.125, "N-M", 2.5),
    ("torque", "j2", 2, "2026-03-03 10:00:07", "2026-03-03 10:00:08", 1.0, 9.5, "N-M", 3.25),  # too short for an alarm
    ("power", None, 1, "2026-03-03 10:00:08", None, 4.0, 80.0, "W", 4.0),
]
LEDGER = {  # run: effect, joint, J
    "Arm_A.fit_1": "kinetic_energy j1 250, coulomb_friction j1 50, kinetic_energy j2 150, coulomb_friction j2 30",
    "Arm_A.check_1": "kinetic_energy j1 150, coulomb_friction j1 50, kinetic_energy j2 450, coulomb_friction j2 110",
    "Arm_A.idle_1": "kinetic_energy j1 30, coulomb_friction j1 10, kinetic_energy j2 20, coulomb_friction j2 8",
    "Arm_B.work_1": "kinetic_energy j1 200, kinetic_energy j2 100",
    "Arm_B.work_2": "kinetic_energy j1 300, kinetic_energy j2 316",
    "Arm_C.press_1": "kinetic_energy j1 200, coulomb_friction j1 80, no_regeneration - 20",
    "Arm_C.press_2": "kinetic_energy j1 196, coulomb_friction j1 80, no_regeneration - 24",
}
FRICTION_TOGETHER = ("Arm_A.fit_1", "coulomb_friction")  # of both joints: not told apart
SUPPLY = {  # run: state, s, W by the log and by the twin
    "Arm_A.fit_1": [("moving", 9.0, 105.0, 104.0), ("drives on at rest", 1.0, 55.0, 50.0)],
}
PARAMETERS = [  # robot, effect, joint, name, value, unit, lower, upper
    ("Arm_A", "coulomb_friction", "j1", "Fc", 4.0, "N m", 3.9, 4.1),
    ("Arm_A", "coulomb_friction", "j2", "Fc", 2.5, "N m", 2.3, 2.7),
    ("Arm_A", "standby_power", None, "P0", 50.0, "W", 49.0, 51.0),
    ("Arm_B", "standby_power", None, "P0", 20.0, "W", 18.0, 22.0),
]
ROUNDS = [("same effects", 14.0, 12.0, "better"), ("effects of a diagnosis", 12.0, 13.0, "no better")]
FITS = [  # robot, run, joint, part, RMSE, R squared
    ("Arm_A", "fit_1", "j1", "fit", 0.5, 0.99),
    ("Arm_A", "fit_1", "j2", "fit", 0.4, 0.98),
    ("Arm_A", "check_1", "j1", "held_out", 0.9, 0.95),
    ("Arm_A", "check_1", "j2", "held_out", 1.2, 0.9),
    ("Arm_A", "idle_1", "j2", "held_out", 0.2, 0.97),
    ("Arm_B", "work_2", "j1", "held_out", 0.3, None),
]


def fill(workspace: Workspace) -> None:
    """Put the fleet into a workspace's database."""
    with Session(workspace.engine) as session, session.begin():
        for row in [
            *_robots(),
            *(schema.RobotNote(robot_id=of, name=name, number=at, text=text) for of, name, at, text in NOTES),
            *_structures(),
            *_plans(),
            *_runs(),
            *_twins(),
            *_energies(),
            *_prices(),
            *_diagnoses(),
            *_live_runs(),
            *_facts(workspace.base),
        ]:
            session.add(row)
            session.flush()


NOTES = (
    ("Arm_A", "location", 1, "cell 4"),
    ("Arm_A", "cell", 1, "1"),
    ("Arm_A", "line", 1, "body"),
    ("Arm_B", "cell", 1, "2"),
    ("Arm_B", "line", 1, "body"),
    ("Arm_C", "cell", 1, "1"),
    ("Arm_D", "line", 1, "paint"),
    ("Arm_C", "supply.voltage", 1, "400"),
    ("Arm_C", "tools", 1, "gripper"),
    ("Arm_C", "tools", 2, "welder"),
)


def _facts(base: str) -> Iterator[Base]:
    yield AssertedFact(
        fact_id="1", about_robot="Arm_B", subject=f"{base}run/Arm_B.work_2", predicate=f"{IRT}Payload", value="1.0",
        kind=f"{XSD}double", graph=f"{GRAPH_SOURCE}run_process", author="anna", time=_moment("2026-03-05 08:00"),
        replaced="0.0", place="run.payload_kg", row_key='{"run_id": "Arm_B.work_2"}',
    )  # fmt: skip


def _robots() -> Iterator[Base]:
    makers = {"Arm_A": ("Acme", 30.0), "Arm_B": ("Bolt", 20.0), "Arm_C": ("Acme", 25.0), "Arm_D": ("Bolt", None)}
    for robot, (maker, weight) in makers.items():
        yield schema.RobotRow(
            robot_id=robot, name=robot, manufacturer=maker, type="articulated", weight_kg=weight, notes="{}",
            controlled_axes=len(JOINTS[robot]), rated_payload_kg=5.0 if robot == "Arm_A" else None, simulated=True,
            ambient_temperature_degc=21.0 if robot == "Arm_B" else None, urdf="<robot/>", urdf_sha256="0" * 64,
            power_measured_at="dc_bus" if robot == "Arm_B" else "mains",
        )  # fmt: skip
        for position, joint in enumerate(JOINTS[robot], 1):
            yield schema.JointRow(
                robot_id=robot, name=joint, position=position, lower_limit_rad=-3.0, upper_limit_rad=3.0,
                kind="prismatic" if robot == "Arm_D" else "revolute", speed_limit_rad_s=4.0,
                torque_limit_nm=None if robot == "Arm_B" else 100.0, gear_ratio=50.0 if robot == "Arm_A" else None,
            )  # fmt: skip


def _structures() -> Iterator[Base]:
    """A post of 0.5 m, joint 1 on it about z, 0.4 m further joint 2 about y, a flange; Arm_C turns about x."""
    level = {"origin_roll_rad": 0.0, "origin_pitch_rad": 0.0, "origin_yaw_rad": 0.0}
    places = {"j1": (0.0, 0.0, 0.5), "j2": (0.4, 0.0, 0.0), "mount": (0.1, 0.0, 0.0)}
    axes: dict[str, tuple[float | None, ...]] = {"j1": (0.0, 0.0, 1.0), "j2": (0.0, 1.0, 0.0), "mount": (None,) * 3}
    for robot, joints in JOINTS.items():
        links = ["base", *(f"link_{joint}" for joint in joints), "flange"]
        for number, link in enumerate(links):
            yield structure.LinkRow(
                robot_id=robot, name=link, number=number, mass_kg=None if number == 0 else 2.0 * number
            )
        for joint, parent, child in zip([*joints, "mount"], links, links[1:], strict=False):
            x, y, z = places[joint]
            about_x = robot == "Arm_C" and joint == "j1"
            axis_x, axis_y, axis_z = (1.0, 0.0, 0.0) if about_x else axes[joint]
            yield structure.LinkJoint(
                robot_id=robot, name=joint, kind="fixed" if joint == "mount" else "revolute",
                parent_link=parent, child_link=child, origin_x_m=x, origin_y_m=y, origin_z_m=z, axis_x=axis_x,
                axis_y=axis_y, axis_z=axis_z, **level,
            )  # fmt: skip
        yield from _devices(robot, None, "controller", "time", "time of the sample", "s")
        yield from _devices(robot, None, "power_meter", "power", "electrical power", "W")
        if robot == "Arm_A":
            for joint in joints:
                yield from _devices(robot, joint, "encoder", f"q_{joint}", "position", "rad")
    ends = {f"{end}_{name}": 0.0 for end in ("base", "tool") for name in ("x_m", "y_m", "z_m")}
    ends |= {f"{end}_{name}_rad": 0.0 for end in ("base", "tool") for name in ("roll", "pitch", "yaw")}
    yield structure.DHTable(
        robot_id="Arm_A", convention="standard", end_link="flange", deviation_m=1e-16, deviation_rad=0.0, **ends
    )
    for number, (joint, a, alpha, d) in enumerate([("j1", 0.4, -0.5 * math.pi, 0.5), ("j2", 0.1, 0.0, 0.0)], 1):
        yield structure.DHRow(
            robot_id="Arm_A", convention="standard", number=number, joint=joint, a_m=a, alpha_rad=alpha, d_m=d,
            theta_rad=0.0,
        )  # fmt: skip


def _devices(robot: str, joint: str | None, kind: str, column: str, label: str, unit: str) -> Iterator[Base]:
    device = kind if joint is None else f"{kind}.{joint}"
    yield structure.Device(robot_id=robot, device_id=device, kind=kind, joint=joint)
    yield structure.DeviceChannel(
        robot_id=robot, column_name=column, device_id=device, joint=joint, label=label, unit=unit, rate_hz=100.0
    )


def digest(text: str) -> str:
    """Return what stands for the SHA-256 of a file that this fleet does not have."""
    return hashlib.sha256(text.encode()).hexdigest()


def _series(kind: str, run_id: str, seconds: float, columns: str, made: str | None = None) -> Base:
    return schema.Series(
        series_id=digest(f"{kind} {run_id}"), run_id=run_id, kind=kind, columns=columns, activity_id=made,
        path=f"series/{run_id}{'.model' if made else ''}.parquet", row_count=int(100 * seconds),
    )  # fmt: skip


def _plans() -> Iterator[Base]:
    for robot, name, _, seconds, payload, *_ in PLANS:
        run_id = f"{robot}.{name}"
        scaled, times, *_ = SLOWER.get(run_id, (None, None))
        yield schema.RunRow(
            run_id=run_id, robot_id=robot, name=name, kind="Planned_Run", payload_kg=payload,
            time_scaling_of=scaled, time_scale=times, payload_com_x_m=0.0,
            payload_com_y_m=0.0, payload_com_z_m=0.0, run_time_s=seconds, sample_count=int(100 * seconds),
            sample_rate_hz=100.0, file=f"series/{run_id}.parquet", sha256=digest(f"plan of {run_id}"),
        )  # fmt: skip
        yield _series("planned", run_id, seconds, "time,q_j1")


def _prices() -> Iterator[Base]:
    for robot, name, _, seconds, _, joules, half in PLANS:
        if joules is None:
            continue
        run_id, made = f"{robot}.{name}", f"energy.{robot}.{name}"
        yield _activity(made, robot, "energy", "2026-03-05 12:03")
        *_, saved, width = SLOWER.get(run_id, (None, None))
        yield energy_schema.RunPrice(
            saving_j=saved, saving_lower_j=saved and saved - width, saving_upper_j=saved and saved + width,
            run_id=run_id, twin_id=f"{robot}.t1", energy_from="modelled", energy_j=joules, energy_lower_j=joules - half,
            energy_upper_j=joules + half, mean_power_w=joules / seconds, mean_power_lower_w=(joules - half) / seconds,
            mean_power_upper_w=(joules + half) / seconds, peak_power_w=280.0, peak_power_lower_w=270.0,
            peak_power_upper_w=290.0, activity_id=made,
        )  # fmt: skip
        yield _series("modelled", run_id, seconds, "time,power_model", made)


def _runs() -> Iterator[Base]:
    performs = {f"{robot}.{run}": f"{robot}.{plan}" for robot, plan, run, *_ in PLANS}
    for robot, name, start, seconds, payload, idle, *_ in RUNS:
        run_id = f"{robot}.{name}"
        product, pieces, cycles = MADE.get(run_id, (None, None, None))
        yield schema.RunRow(
            product=product, pieces=pieces, cycles=cycles,
            run_id=run_id, robot_id=robot, name=name, kind="Measured_Run", role="observed", payload_kg=payload,
            payload_com_x_m=0.0, payload_com_y_m=0.0, payload_com_z_m=0.0, repeat_of=REPEATS.get(run_id),
            performs=performs.get(run_id), start_time=_moment(start), start_time_from="log",
            started=_moment(start), ended=_moment(start) + timedelta(seconds=seconds), run_time_s=seconds,
            sample_count=int(100 * seconds), sample_rate_hz=100.0, file=f"runs/{name}.csv",
            sha256=digest(f"log of {run_id}"),
        )  # fmt: skip
        yield _series("measured", run_id, seconds, "time,q_j1,power")
        if idle is None:
            continue
        made = f"run_state.{run_id}"
        yield _activity(made, robot, "run_state", "2026-03-05 12:00")
        yield schema.RunState(run_id=run_id, current_state="standstill", idle_share=idle, activity_id=made)
        for position, joint in enumerate(JOINTS[robot], 1):
            yield schema.JointState(
                run_id=run_id, joint=joint, robot_id=robot, joint_position_rad=0.1 * position, joint_speed_rad_s=0.0,
                joint_acc_rad_s2=0.0, joint_torque_nm=-20.0 * position, activity_id=made,
                joint_temperature_degc=40.0 if robot == "Arm_C" else None,
            )  # fmt: skip


CUTOFF_WHY = {"Arm_A": "found: 10 times the bandwidth of the motion", "Arm_B": "stated"}


def _twins() -> Iterator[Base]:
    conditions = {"Arm_A": 42.0, "Arm_B": 250.0, "Arm_C": 30.0}
    for robot, effects in EFFECTS.items():
        made, twin = f"identification.{robot}", f"{robot}.t1"
        yield _activity(made, robot, "identification", "2026-03-05 12:01")
        yield schema.TwinRow(
            twin_id=twin, robot_id=robot, created=_moment("2026-03-05 12:01"), file=f"twins/{twin}.json",
            sha256=digest(f"twin of {robot}"), cutoff_hz=10.0, cutoff_why=CUTOFF_WHY.get(robot),
            condition_number=conditions[robot],
            base_parameter_count=11,
            split="by run", activity_id=made,
            torque_scale_uncertainty=0.1 if robot == "Arm_A" else None,
            torque_scale_why="torque of drives comes from nominal constants" if robot == "Arm_A" else None,
        )  # fmt: skip
        for effect in effects:
            yield schema.TwinEffect(twin_id=twin, effect=effect, activity_id=made)
        for of, name, *_, part in (run[:7] for run in RUNS):
            if of == robot and part == "fit":
                yield schema.ActivityUse(activity_id=made, entity=f"run/{robot}.{name}", relation="wasInformedBy")
            if of == robot:
                yield schema.TwinRun(twin_id=twin, run_id=f"{robot}.{name}", part=part, activity_id=made)
    yield schema.TwinChoice(
        choice_id="Arm_A.t1.copper_loss.chosen", twin_id="Arm_A.t1", effect="copper_loss", joints="j1", chosen=True,
        probability=0.75, rivals="inverter_loss", rmse_unit="W", rmse_without=6.0, rmse_with=3.0,
        energy_error_without_percent=2.0, energy_error_with_percent=1.0, activity_id="identification.Arm_A",
    )  # fmt: skip
    yield schema.TwinChoice(
        choice_id="Arm_A.t1.iron_loss.open", twin_id="Arm_A.t1", effect="iron_loss", chosen=False, probability=0.4,
        activity_id="identification.Arm_A",
    )  # fmt: skip
    for robot, effect, joint, name, value, unit, lower, upper in PARAMETERS:
        yield schema.ParameterRow(
            parameter_id=f"{robot}.t1.{effect}.{joint or 'robot'}.{name}", twin_id=f"{robot}.t1", robot_id=robot,
            effect=effect, joint=joint, name=name, value=value, unit=unit, lower=lower, upper=upper,
            scaled_lower=0.9 * lower if unit == "N m" else None, scaled_upper=1.1 * upper if unit == "N m" else None,
            activity_id=f"identification.{robot}",
        )  # fmt: skip
    yield schema.BaseParameterRow(
        twin_id="Arm_A.t1", number=1, combination="Ia j1 + Izz l1", value=1.5, unit="kg m^2", lower=1.0, upper=2.0,
        activity_id="identification.Arm_A",
    )  # fmt: skip
    for number, (tried, before, after, outcome) in enumerate(ROUNDS, 1):
        made = f"improvement.Arm_A.{number}"
        yield _activity(made, "Arm_A", "improvement", "2026-03-05 12:04")
        yield schema.ActivityUse(activity_id=made, entity="run/Arm_A.check_1", relation="wasInformedBy")
        yield schema.ActivityUse(activity_id=made, entity="twin/Arm_A.t0", relation="used")
        yield schema.ImprovementRound(
            round_id=f"Arm_A.{number}", robot_id="Arm_A", number=number, tried=tried, effects="rigid_body",
            earlier_twin_id="Arm_A.t0", tried_twin_id=f"Arm_A.t{number}", error_before_percent=before,
            error_after_percent=after, limit_percent=10.0, outcome=outcome, activity_id=made,
        )  # fmt: skip
    for robot, name, joint, part, rmse, r_squared in FITS:
        yield schema.TorqueFit(
            twin_id=f"{robot}.t1", run_id=f"{robot}.{name}", joint=joint, part=part, robot_id=robot, rmse_nm=rmse,
            r_squared=r_squared, activity_id=f"identification.{robot}",
        )  # fmt: skip


def _energies() -> Iterator[Base]:
    for robot, name, _, seconds, _, _, part, measured, modelled, standby, returned, peak, rmse in RUNS:
        if part is None:
            continue
        run_id, made = f"{robot}.{name}", f"energy.{robot}.{name}"
        yield _activity(made, robot, "energy", "2026-03-05 12:02")
        yield schema.RunEnergy(
            run_id=run_id, twin_id=f"{robot}.t1", part=part, energy_consumption_j=measured, energy_from="measured",
            run_power_w=measured / seconds, peak_power_w=peak, measured_energy_j=measured, modelled_energy_j=modelled,
            energy_error_percent=100 * abs(modelled - measured) / measured, power_rmse_w=rmse, standby_energy_j=standby,
            standby_share=standby / modelled, returned_energy_j=returned, activity_id=made,
        )  # fmt: skip
        yield _series("modelled", run_id, seconds, "time,power_model", made)
        entries = [entry.split() for entry in f"standby_power - {standby}, {LEDGER[run_id]}".split(", ")]
        for effect, joint, joules in entries:
            yield energy_schema.EnergyShare(
                twin_id=f"{robot}.t1", run_id=run_id, effect=effect, robot_id=robot,
                place=joint.replace("-", "robot"), joint=None if joint == "-" else joint,
                energy_j=float(joules), lower_j=0.5 * float(joules), upper_j=1.5 * float(joules),
                inseparable=1 if (run_id, effect) == FRICTION_TOGETHER else None, activity_id=made,
            )  # fmt: skip
        if run_id == FRICTION_TOGETHER[0]:
            yield energy_schema.InseparableEnergy(
                run_id=run_id, number=1, robot_id=robot, energy_j=80.0, lower_j=77.0, upper_j=83.0, activity_id=made
            )
        for number, (state, lasts, logged, told) in enumerate(SUPPLY.get(run_id, ()), start=1):
            yield energy_schema.SupplyStateRow(
                run_id=run_id, number=number, robot_id=robot, state=state, seconds=lasts, power_w=logged,
                modelled_power_w=told, modelled_power_lower_w=told - 3, modelled_power_upper_w=told + 3,
                differs=abs(logged - told) > 3, activity_id=made,
            )  # fmt: skip
        for joint in JOINTS[robot]:
            taken = sum(float(joules) for _, at, joules in entries if at == joint)
            yield energy_schema.JointEnergy(
                run_id=run_id, joint=joint, robot_id=robot, energy_j=taken, activity_id=made
            )


def _live_runs() -> Iterator[Base]:
    for robot, name, start, seconds, payload, stream, stale_since, why in LIVE:
        run_id, made = f"{robot}.{name}", f"live.{robot}.{name}"
        yield schema.RunRow(
            run_id=run_id, robot_id=robot, name=name, kind="Live_Run", payload_kg=payload, payload_com_x_m=0.0,
            payload_com_y_m=0.0, payload_com_z_m=0.0, start_time=_moment(start), start_time_from="log",
            started=_moment(start), ended=_moment(start) + timedelta(seconds=seconds) if stream == "ended" else None,
            run_time_s=seconds, sample_count=int(100 * seconds), sample_rate_hz=100.0,
            file=f"series/{run_id}.parquet", sha256=digest(f"log of {run_id}"),
        )  # fmt: skip
        yield _activity(made, robot, "live", start)
        if robot == "Arm_B":
            yield schema.RunState(run_id=run_id, current_state="moving", idle_share=0.2, activity_id=made)
        yield schema.LiveState(
            run_id=run_id, state_time=_moment(start) + timedelta(seconds=seconds), stream_state=stream,
            stale_since=stale_since and _moment(stale_since), stale_reason=why, activity_id=made,
        )  # fmt: skip
    for channel, joint, number, began, ended, seconds, residual, unit, ratio in EXCURSIONS:
        yield schema.GapExcursion(
            run_id="Arm_B.live_1", place=joint or "robot", number=number, twin_id="Arm_B.t1", robot_id="Arm_B",
            channel=channel, joint=joint, unit=unit, began=_moment(began), ended=ended and _moment(ended),
            lasted_s=seconds, peak_residual=residual, peak_ratio=ratio, activity_id="live.Arm_B.live_1",
        )  # fmt: skip


_SURE = {  # of a location
    "share_lower": 0.1, "share_upper": 0.8, "excess": 9.0, "excess_lower": 5.0, "excess_upper": 12.0,
    "concentration": 2.0, "false_discovery_rate": 0.01,
}  # fmt: skip


def _diagnoses() -> Iterator[Base]:
    yield from _diagnosis("Arm_A", "attributed", 12.0)
    yield from _cause("Arm_A", 1, "coulomb_friction", "j2", "changed", 0.9, ("Fc", 0.8, "N m", 0.4, 1.2))
    yield from _cause("Arm_A", 2, "viscous_friction", "j1", "changed", 0.6, ("Fv", 0.1, "N m s/rad", -0.1, 0.3))
    of = {"diagnosis_id": "Arm_A.d1", "activity_id": "diagnosis.Arm_A"}
    yield CLASSES["gap_location"](
        **of,
        location_id="torque@j2:low_speed",
        robot_id="Arm_A",
        rank=1,
        channel="torque",
        joint="j2",
        regime="low_speed",
        follows="speed",
        share=0.7,
        **_SURE,
    )
    yield CLASSES["gap_location"](
        **of, **_SURE, location_id="power", robot_id="Arm_A", rank=2, channel="power", share=0.2
    )
    yield CLASSES["gap_shrinkage"](**of, closed_fraction=0.8, lower=0.7, upper=0.9)
    yield CLASSES["gap_change"](
        **of, measure="torque_rmse", part="together", place="all", before=1.0, after=0.4, noise_floor=0.3, lower=0.35,
        upper=0.45, unit="N m",
    )  # fmt: skip
    yield CLASSES["gap_change"](
        **of, measure="torque_rmse", part="alone", place="coulomb_friction@j2", cause_id="coulomb_friction@j2",
        before=1.0, after=0.6, unit="N m",
    )  # fmt: skip
    yield CLASSES["gap_not_testable"](**of, number=1, effect="payload", why="no run carries a load")
    yield CLASSES["gap_refused"](
        **of, number=1, robot_id="Arm_A", effect="torque_constant_error", joint="j2", why="g = 2.1 (2 to 2.2)"
    )
    yield CLASSES["gap_refused"](**of, number=2, robot_id="Arm_A", effect="payload", why="m = -9 kg (-9.5 to -8.5)")
    yield from _diagnosis("Arm_B", "ambiguous", 5.0)
    of = {"diagnosis_id": "Arm_B.d1", "activity_id": "diagnosis.Arm_B"}
    yield from _cause("Arm_B", 1, "payload", None, "missing", 0.5, ("m", 1.5, "kg", 1.3, 1.7))
    yield from _cause("Arm_B", 2, "torque_constant_error", "j2", "missing", 0.4, ("g", 0.1, "1", 0.05, 0.15))
    yield CLASSES["gap_cause_rival"](**of, cause_id="payload", effect="torque_constant_error")
    yield CLASSES["gap_cause_rival"](**of, cause_id="torque_constant_error@j2", effect="payload")
    yield CLASSES["gap_cause_competitor"](**of, cause_id="payload", effect="torque_constant_error", probability=0.4)
    yield CLASSES["gap_cause_competitor"](**of, cause_id="torque_constant_error@j2", effect="payload", probability=0.5)
    yield CLASSES["gap_experiment"](
        **of, purpose="tell payload from torque_constant_error", separation_now=1.5, expected_separation=8.0, enough=5.0
    )
    yield CLASSES["gap_experiment_effect"](**of, effect="payload")
    yield CLASSES["gap_experiment_effect"](**of, effect="torque_constant_error")
    yield CLASSES["gap_experiment_instruction"](**of, number=1, text="lift a known mass")
    yield CLASSES["gap_experiment_instruction"](**of, number=2, text="hang another on joint 2")
    yield from _diagnosis("Arm_C", "unexplained", None)


def _diagnosis(robot: str, verdict: str, error: float | None) -> Iterator[Base]:
    made = f"diagnosis.{robot}"
    yield _activity(made, robot, "diagnosis", "2026-03-06 12:00")
    yield GapDiagnosis(
        diagnosis_id=f"{robot}.d1", robot_id=robot, verdict=verdict, created=_moment("2026-03-06 12:00"),
        energy_error_percent=error, noise_floor_from="repeats", cutoff_hz=12.5, cutoff_why="stated",
        file=f"diagnoses/{robot}.d1.json", sha256="2" * 64,
        evidence_file=f"diagnoses/{robot}.d1.evidence.json", evidence_sha256="3" * 64, activity_id=made,
    )  # fmt: skip


def _cause(
    robot: str,
    rank: int,
    effect: str,
    joint: str | None,
    scope: str,
    confidence: float,
    parameter: tuple[Any, ...],
) -> Iterator[Base]:
    cause_id = f"{effect}@{joint}" if joint else effect
    of: dict[str, Any] = {"diagnosis_id": f"{robot}.d1", "cause_id": cause_id, "activity_id": f"diagnosis.{robot}"}
    yield CLASSES["gap_cause"](
        **of, robot_id=robot, rank=rank, effect=effect, scope=scope, confidence=confidence, channel="torque",
        closed_where_it_acts=0.8, gain=2.0, log_odds=5.0,
    )  # fmt: skip
    if joint is not None:
        yield CLASSES["gap_cause_joint"](**of, robot_id=robot, joint=joint)
    name, value, unit, lower, upper = parameter
    yield CLASSES["gap_cause_parameter"](
        **of, robot_id=robot, number=1, joint=joint, name=name, value=value, unit=unit, lower=lower, upper=upper
    )


def _activity(activity_id: str, robot: str, provider: str, ended: str) -> Base:
    return schema.Activity(
        activity_id=activity_id, robot_id=robot, provider=provider, subject=f"robot/{robot}", software=SOFTWARE,
        started=min(_moment("2026-03-05 12:00"), _moment(ended)), ended=_moment(ended),
    )  # fmt: skip


def _moment(text: str) -> datetime:
    return datetime.fromisoformat(text).replace(tzinfo=UTC)
