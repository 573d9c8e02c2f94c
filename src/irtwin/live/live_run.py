"""A live run as rows of the database: while it lasts from its newest state, at its end from all its samples."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import chain

import numpy as np
import pyarrow as pa

from irtwin.live.joint_stream import STREAMED, State
from irtwin.providers.live_energy import watching
from irtwin.providers.names import run_iri
from irtwin.providers.provider import software
from irtwin.signals.channels import CHANNELS, Signals, from_columns
from irtwin.signals.motion import STILL_SHARE, STILL_SPEED
from irtwin.storage.journal import Header
from irtwin.storage.rows import Tables, Values
from irtwin.storage.schema import LIVE, moment_of

_COM = tuple(f"payload_com_{axis}_m" for axis in "xyz")
_JOINT_STATE = (
    "joint_position_rad", "joint_speed_rad_s", "joint_acc_rad_s2", "joint_torque_nm", "joint_temperature_degc",
)  # fmt: skip


def columns(joints: Sequence[str]) -> tuple[str, ...]:
    """Return the columns of a journal."""
    return ("time", *(column for channel in STREAMED.values() for column in channel.columns(joints)))


def joints_of(columns: Sequence[str]) -> tuple[str, ...]:
    """Return the names of the joints, base to flange, by the columns of a journal."""
    prefix = f"{CHANNELS['q'].prefix}_"
    return tuple(name.removeprefix(prefix) for name in columns if name.startswith(prefix))


def journal_rows(states: Sequence[State]) -> np.ndarray:
    """Return states as rows of a journal, (N, columns)."""
    return np.array([(state.time, *chain.from_iterable(state.values)) for state in states])


def speed_of(state: State, before: State) -> Sequence[float]:
    """Return the speed that a state says, else the one by which its position differs from the state before."""
    if not math.isnan(state.of("dq")[0]):
        return state.of("dq")
    step = state.time - before.time
    return [(now - was) / step for now, was in zip(state.of("q"), before.of("q"), strict=True)]


def moving(speed: Sequence[float], fastest: Sequence[float]) -> bool:
    """Whether a joint moves, by the bounds by which a recorded run is judged; fastest: (n,) speeds so far."""
    return any(abs(now) >= max(STILL_SPEED, STILL_SHARE * top) for now, top in zip(speed, fastest, strict=True))


def rows(
    header: Header,
    joints: Sequence[str],
    began: float,
    now: float,
    count: int,
    newest: Sequence[Sequence[float]],
    current_state: str,
    live: Values,
) -> Tables:
    """Return the rows of a run that `began`, and is at `now`, in s since 1970; `live`: what else its live_state says.

    newest: position, speed, acceleration, torque and temperature, each (n,), NaN where it was not said.
    """
    activity_id = activities(header.run_id)[0]
    run = {
        "run_id": header.run_id,
        "robot_id": header.robot_id,
        "name": header.run_id.removeprefix(f"{header.robot_id}."),
        "kind": header.kind,
        "payload_kg": header.payload_kg,
        **dict(zip(_COM, header.payload_com, strict=True)),
        "start_time": moment_of(began),
        "start_time_from": "log",
        "started": moment_of(began),
        "run_time_s": now - began,
        "sample_count": count,
        **({} if header.performs is None else {"performs": header.performs}),
    }
    made = {"run_id": header.run_id, "activity_id": activity_id}
    return {
        "run": [run],
        "activity": [activity(header, activity_id, LIVE, began)],
        "run_state": [{**made, "current_state": current_state}],
        "joint_state": [
            {**made, "robot_id": header.robot_id, "joint": joint, **_joint_state(values)}
            for joint, *values in zip(joints, *newest, strict=True)
        ],
        "live_state": [{**made, "state_time": moment_of(now), **live}],
    }


def closed_rows(header: Header, samples: np.ndarray, live: Values) -> tuple[Tables, pa.Table]:
    """Return the rows of a run that is over, and its series: a channel that was never said is left out."""
    joints = joints_of(header.columns)
    columns = dict(zip(header.columns, samples.T, strict=True))
    signals = from_columns(columns, joints)
    time = signals.time
    began, ended = float(time[0]), float(time[-1])
    speed = _speeds(signals)
    size = np.nan_to_num(np.abs(speed))
    still = size < np.maximum(STILL_SPEED, STILL_SHARE * size.max(axis=0))
    acceleration = np.diff(speed, axis=0, prepend=np.nan)[-1] / np.diff(time, prepend=np.nan)[-1]
    last = (signals.q[-1], speed[-1], acceleration, _last(signals, "torque"), _last(signals, "temperature"))
    newest = [values.tolist() for values in last]
    idle = still.all(axis=1)
    tables = rows(header, joints, began, ended, len(time), newest, "standstill" if idle[-1] else "moving", live)
    length = ended - began
    tables["run"][0] |= {
        "ended": moment_of(ended),
        "sample_rate_hz": (len(time) - 1) / length if length else None,
    }
    tables["activity"][0] |= {"ended": moment_of(ended)}
    tables["run_state"][0] |= {"idle_share": float(idle.mean())}
    table = columns | {"time": time - began}
    return tables, pa.table({name: values for name, values in table.items() if not np.isnan(values).all()})


def activities(run_id: str) -> tuple[str, str]:
    """Return the ids of the two activities of a live run: who watched it, and who worked out its energy."""
    return watching(run_id), f"energy.{run_id}"


def activity(header: Header, activity_id: str, provider: str, began: float) -> Values:
    """Return the row of an activity on a run that was from `began` on, s since 1970."""
    return {
        "activity_id": activity_id,
        "robot_id": header.robot_id,
        "provider": provider,
        "subject": run_iri(header.run_id),
        "started": moment_of(began),
        "software": software(),
    }


def together(*parts: Tables) -> Tables:
    """Return the rows of several parts, table by table."""
    tables: Tables = {}
    for part in parts:
        for name, some in part.items():
            tables[name] = [*tables.get(name, ()), *some]
    return tables


def _speeds(signals: Signals) -> np.ndarray:
    """Return the speeds that were said, else those by which positions differ, (N, n); NaN at the first then."""
    steps = np.diff(signals.q, axis=0, prepend=np.nan) / np.diff(signals.time, prepend=np.nan)[:, None]
    return steps if signals.dq is None else np.where(np.isnan(signals.dq), steps, signals.dq)


def _last(signals: Signals, field: str) -> np.ndarray:
    """Return a channel's last values, (n,); NaN where it was never said."""
    values = getattr(signals, field)
    return np.full(signals.q.shape[1], np.nan) if values is None else values[-1]


def _joint_state(values: Sequence[float]) -> Values:
    return {name: None if math.isnan(value) else value for name, value in zip(_JOINT_STATE, values, strict=True)}
