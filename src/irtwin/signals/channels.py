"""The channels of a run, each said in one line: its columns in a log, unit, range, and the field that holds it.

A new channel is a line of `Signals`. It is then read from every source, checked, conditioned, stored and given back;
`docs/LOG_FORMAT.md` lists it, and a line of the live stream may say it where it has a key there.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, replace
from functools import partial
from typing import Annotated, Any, Self, get_type_hints

import numpy as np
import numpy.typing as npt

Samples = npt.NDArray[np.float64]
Logged = Samples | None


@dataclass(frozen=True)
class Channel:
    """What a log calls a channel, and what its values may be.

    Its columns are PREFIX_JOINT, one a joint; PREFIX alone where it is the whole robot's, and not `per_joint`.
    `unit`, of a joint that slides `sliding`; `greatest`: the largest magnitude that any robot reaches; `label`: what it
    is; `device`: what measures it. `streamed`: its key in a live stream, None where a stream has none. `strict`:
    PREFIX_NAME is a mistake where no joint has that name; else it is some other column.
    """

    prefix: str
    unit: str
    greatest: float
    label: str
    per_joint: bool = True
    sliding: str | None = None
    streamed: str | None = None
    strict: bool = False
    device: str = "sensor"

    def column(self, joint: str) -> str:
        """Return the name of its column for a joint; of the whole robot's, whatever the joint."""
        return f"{self.prefix}_{joint}" if self.per_joint else self.prefix

    def columns(self, joints: Iterable[str]) -> tuple[str, ...]:
        """Return the names of its columns for a robot of these joints."""
        return tuple(map(self.column, joints)) if self.per_joint else (self.prefix,)

    def unit_of(self, kind: str) -> str:
        """Return its unit at a joint of a kind: "prismatic" ones slide."""
        return self.sliding if self.sliding and kind == "prismatic" else self.unit


_encoder = partial(Channel, strict=True, device="encoder")
_meter = partial(Channel, per_joint=False, device="power_meter")


@dataclass(frozen=True)
class Signals:
    """One run's samples, N rows of a robot of n joints, in SI units; None where nothing was logged.

    (N, n) where the channel has a value for each joint, else (N,). `torque` is on the joint side, `power`,
    `meter_voltage` and `meter_current` are the whole robot's, where its power is measured.
    """

    time: Annotated[Samples, Channel("time", "s", 1e11, "time of the sample", per_joint=False, device="controller")]
    q: Annotated[Samples, _encoder("q", "rad", 1e4, "position", sliding="m", streamed="position")]
    _: KW_ONLY
    dq: Annotated[Logged, _encoder("dq", "rad/s", 1e4, "speed", sliding="m/s", streamed="velocity")] = None
    ddq: Annotated[Logged, _encoder("ddq", "rad/s^2", 1e6, "acceleration", sliding="m/s^2")] = None
    torque: Annotated[
        Logged,
        Channel("tau", "N m", 1e6, "torque", sliding="N", streamed="effort", strict=True, device="torque_sensor"),
    ] = None
    current: Annotated[Logged, Channel("i", "A", 1e5, "motor current", device="current_sensor")] = None
    command: Annotated[Logged, Channel("cmd", "rad", 1e4, "commanded position", sliding="m", device="controller")] = (
        None
    )
    command_speed: Annotated[
        Logged, Channel("dcmd", "rad/s", 1e4, "commanded speed", sliding="m/s", device="controller")
    ] = None
    temperature: Annotated[
        Logged, Channel("temp", "degC", 1e3, "temperature", streamed="temperature", device="thermometer")
    ] = None
    power: Annotated[Logged, _meter("power", "W", 1e7, "electrical power", streamed="power")] = None
    meter_voltage: Annotated[Logged, _meter("voltage", "V", 1e5, "supply voltage")] = None
    meter_current: Annotated[Logged, _meter("current", "A", 1e5, "supply current")] = None

    def logged(self) -> dict[str, Samples]:
        """Return what was logged, by field, in the order of the table."""
        return {field: values for field in CHANNELS if (values := getattr(self, field)) is not None}

    @property
    def motion(self) -> Self:
        """What of them is motion: time, positions, and speeds and accelerations where they were logged."""
        return type(self)(self.time, self.q, dq=self.dq, ddq=self.ddq)

    def rows(self, chosen: slice | np.ndarray) -> Self:
        """Return some of the samples."""
        some: dict[str, Any] = {
            name: values[chosen] for name, values in vars(self).items() if isinstance(values, np.ndarray)
        }
        return replace(self, **some)


_HINTS = get_type_hints(Signals, include_extras=True)
CHANNELS: Mapping[str, Channel] = {  # by field of Signals
    field: hint.__metadata__[0] for field, hint in _HINTS.items() if hasattr(hint, "__metadata__")
}
REQUIRED = ("time", "q")  # fields without which a run is none


def by_column(joints: Iterable[str]) -> dict[str, Channel]:
    """Return the channel of each column that a log of these joints may have."""
    names = tuple(joints)
    return {column: channel for channel in CHANNELS.values() for column in channel.columns(names)}


def columns_of(signals: Signals, joints: Iterable[str]) -> dict[str, Samples]:
    """Return signals as columns of a log, each (N,)."""
    names = tuple(joints)
    columns: dict[str, Samples] = {}
    for field, values in signals.logged().items():
        parts = values.T if CHANNELS[field].per_joint else values[None]
        columns |= dict(zip(CHANNELS[field].columns(names), parts, strict=True))
    return columns


def from_columns(columns: Mapping[str, Samples], joints: Iterable[str]) -> Signals:
    """Return the signals of a log's columns, each (N,): the inverse of `columns_of`.

    KeyError, with its name, where a column is absent of a channel that has others, or of time or the positions.
    """
    names = tuple(joints)
    samples: dict[str, Samples] = {}
    for field, channel in CHANNELS.items():
        own = channel.columns(names)
        if field in REQUIRED or any(name in columns for name in own):
            parts = [columns[name] for name in own]
            nothing = np.empty((len(columns["time"]), 0))  # of a robot whose joints nobody logged
            samples[field] = np.column_stack([nothing, *parts]) if channel.per_joint else parts[0]
    return Signals(**samples)


def csv_text(motion: Signals, joint_names: Sequence[str]) -> str:
    """Return columns time, q_J, dq_J, ddq_J (s, rad, rad/s, rad/s^2) of each joint J, a row a sample, to ten digits."""
    columns = columns_of(motion, joint_names)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows([f"{value:.10g}" for value in row] for row in np.column_stack(list(columns.values())))
    return text.getvalue()
