"""A small data set, as rows."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from hashlib import sha256
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from irtwin.storage.schema import Activity, Base, JointRow, RobotRow, RunEnergy, RunRow, RunState, TwinRow, TwinRun

if TYPE_CHECKING:
    from irtwin.providers.provider import Made
    from irtwin.storage.database import Workspace

ROBOT = "KUKA_KR6_R700"
DataSet = tuple[RobotRow, list[JointRow], list[RunRow], dict[str, pa.Table]]
NOON = datetime(2026, 3, 1, 12, tzinfo=UTC)


def robot(**changes: Any) -> RobotRow:
    values: dict[str, Any] = {
        "robot_id": ROBOT,
        "name": "KUKA KR6 R700",
        "type": "articulated",
        "manufacturer": "KUKA",
        "weight_kg": 50.0,
        "controlled_axes": 2,
        "arm_movement_type": None,
        "rated_payload_kg": 6.0,
        "ambient_temperature_degc": None,
        "power_measured_at": "mains",
        "simulated": True,
        "urdf": "<robot/>",
        "urdf_sha256": "0" * 64,
        "twin_effects": None,
        "notes": "{}",
    }
    return RobotRow(**values | changes)


def joints() -> list[JointRow]:
    return [
        JointRow(
            robot_id=ROBOT,
            name=f"joint_a{position}",
            position=position,
            kind="revolute",
            lower_limit_rad=-2.0,
            upper_limit_rad=2.0,
            speed_limit_rad_s=6.0,
            torque_limit_nm=None,
            gear_ratio=100.0,
        )
        for position in (1, 2)
    ]


def run(name: str, **changes: Any) -> RunRow:
    values: dict[str, Any] = {
        "run_id": f"{ROBOT}.{name}",
        "robot_id": ROBOT,
        "name": name,
        "kind": "Measured_Run",
        "role": "observed",
        "payload_kg": 0.0,
        "payload_com_x_m": 0.0,
        "payload_com_y_m": 0.0,
        "payload_com_z_m": 0.0,
        "repeat_of": None,
        "start_time": NOON,
        "start_time_from": "log",
        "started": NOON,
        "ended": NOON + timedelta(seconds=1.0),
        "run_time_s": 1.0,
        "sample_count": 5,
        "sample_rate_hz": 4.0,
        "file": f"runs/{name}.csv",
        "sha256": "1" * 64,
    }
    return RunRow(**values | changes)


def samples(seed: int) -> pa.Table:
    time = np.linspace(0.0, 1.0, 5)
    return pa.table({"time": time, "q_joint_a1": np.sin(seed + time), "power": 100.0 + time})


def data_set() -> DataSet:
    # The first run repeats a later one: the order of rows is the user's.
    runs = [run("again", repeat_of=f"{ROBOT}.work"), run("work")]
    return robot(), joints(), runs, {item.run_id: samples(seed) for seed, item in enumerate(runs)}


def activity(name: str, provider: str, subject: str = f"robot/{ROBOT}", robot_id: str = ROBOT) -> Activity:
    return Activity(
        activity_id=name, robot_id=robot_id, provider=provider, subject=subject, started=NOON, ended=NOON,
        software="irtwin 0.1.0",
    )  # fmt: skip


def keep(workspace: Workspace, robot_id: str, provider: str, subject: str, made: Made) -> None:
    """Keep what a provider made, as the planner does."""
    by = activity(f"{provider}.{subject}", provider, subject, robot_id)
    workspace.replace_activity(by, made.used, made.rows, made.series, made.documents)


def twin(twin_id: str) -> list[Base]:
    return [
        TwinRow(
            twin_id=twin_id,
            robot_id=ROBOT,
            created=NOON,
            file=f"twins/{twin_id}.json",
            sha256=sha256(b"{}").hexdigest(),
            split="by run",
        ),
        TwinRun(twin_id=twin_id, run_id=f"{ROBOT}.work", part="fit"),
    ]


def identify(
    workspace: Workspace, twin_id: str, used: Sequence[str] = (), parts: Sequence[Base] = (), name: str = "twin.1"
) -> None:
    """Keep a twin, its parts and its file, as its provider does."""
    by, made = activity(name, "identification"), [*twin(twin_id), *parts]
    workspace.replace_activity(by, list(used), made, documents={f"twins/{twin_id}.json": b"{}"})


def run_state() -> list[Base]:
    return [RunState(run_id=f"{ROBOT}.work", current_state="standstill", idle_share=0.25)]


def run_energy(twin_id: str) -> list[Base]:
    return [
        RunEnergy(
            run_id=f"{ROBOT}.work",
            twin_id=twin_id,
            part="fit",
            energy_consumption_j=100.5,
            energy_from="measured",
            run_power_w=100.5,
            peak_power_w=101.0,
            measured_energy_j=100.5,
            modelled_energy_j=98.0,
            energy_error_percent=2.49,
            power_rmse_w=3.0,
            standby_energy_j=80.0,
            standby_share=0.8,
            returned_energy_j=1.5,
        )
    ]
