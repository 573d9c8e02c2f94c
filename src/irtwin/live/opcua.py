"""States of a robot from an OPC UA server: by OPC 40010 (Robotics), or by the node ids that a file names.

position = ["ns=2;s=A1", "ns=2;s=A2"]   # of each joint, base to flange; without it, by OPC 40010
power = "ns=2;s=Power"                  # so too velocity, effort and temperature, of each joint
units = { power = "kW" }                # of what the server says no unit for
device = "KR6"                          # which motion device, where an OPC 40010 server has several
user = "irtwin"                         # its password stands in the environment's IRTWIN_OPCUA_PASSWORD
certificate = "irtwin.der"              # ours, and its key: signed and encrypted by Basic256Sha256
key = "irtwin.pem"
server_certificate = "robot.der"        # what the server has to show; without it, whatever it shows

All keys are optional. Values are read all at once: subscriptions leave a robot that stands
without a sample, and many servers sample them slower than they are read.
"""

from __future__ import annotations

import asyncio
import logging
import math
import os
import threading
import time
from collections import Counter
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from irtwin.announce import Announce
from irtwin.errors import InputError, first_line
from irtwin.live.joint_stream import STREAMED, State, state_of
from irtwin.robot.description import Robot
from irtwin.signals.unit import Unit, unit_of
from irtwin.toml_file import TomlTable, read_toml, shown

try:
    from asyncua import Client, Node, ua
    from asyncua.crypto.security_policies import SecurityPolicyBasic256Sha256
except ModuleNotFoundError as error:
    raise InputError("OPC UA needs the package asyncua; pip install 'irtwin[opcua]'") from error

_DI, _ROBOTICS = "http://opcfoundation.org/UA/DI/", "http://opcfoundation.org/UA/Robotics/"
_OF_AXES = {"position": "ActualPosition", "velocity": "ActualSpeed"}  # of OPC 40010, by key of a stream
# What UNECE's codes in `UnitId` mean; other units are known by how the server writes them
_UNECE = {"C81": "rad", "DD": "deg", "MTR": "m", "MMT": "mm", "2A": "rad/s", "E96": "deg/s", "RPM": "rpm", "NU": "N m"}
_UNECE |= {"MTS": "m/s", "C16": "mm/s", "WTT": "W", "KWT": "kW", "CEL": "degC"}
_FIELDS = {str(channel.streamed): field for field, channel in STREAMED.items()}
_TEXTS = ("device", "user", "certificate", "key", "server_certificate")
_PATIENCE = 5.0  # s for an answer
_AGAIN = 1.0  # s until the next try to connect
_RATE = 100.0  # samples a second that are read
_STANDS = 0.5  # s after which a state comes though no position has a new time: the robot stands
_HUNG = 2.0  # s, or five times its usual pause, after which a node that says a new time at rest, too, hangs
_AT_REST = 20  # values that came again with a new time: the server says when it looked, not when they changed
_OLD = 2.0  # s by which a position's time may lie behind the server's clock, which many tell in whole seconds
logging.getLogger("asyncua").setLevel(logging.CRITICAL)  # what matters is raised, and told in one line
_LOST = (OSError, ua.UaError, asyncio.CancelledError)  # what asyncua raises where a connection breaks


@dataclass(frozen=True)
class _Place:
    """A node of a channel, by the channel's key, and what makes SI units of its value."""

    key: str
    node: Node
    unit: Unit


class _NodeTimes:
    """Tells which nodes hang: their status is good, and their time stands still though it went on at rest before.

    A server that says when a value changed, not when it looked, tells nobody which of its nodes hang.
    """

    def __init__(self) -> None:
        self._heard: dict[str, tuple[ua.DataValue, float]] = {}  # the newest by its time, and when it came
        self._began: dict[str, float] = {}
        self._times: Counter[str] = Counter()
        self._at_rest: Counter[str] = Counter()

    def hear(self, node: str, value: ua.DataValue, now: float) -> None:
        """Take what a node says at a moment, s."""
        newest, _ = self._heard.get(node, (None, now))
        if newest is not None and newest.SourceTimestamp == value.SourceTimestamp:
            return
        self._at_rest[node] += newest is not None and newest.Value == value.Value
        self._times[node] += 1
        self._began.setdefault(node, now)
        self._heard[node] = value, now

    def hangs(self, node: str, now: float) -> bool:
        """Whether a node's time has stood still for too long."""
        _, at = self._heard[node]
        usual = (at - self._began[node]) / max(self._times[node] - 1, 1)
        return self._at_rest[node] >= _AT_REST and now - at > max(_HUNG, 5.0 * usual)


class OpcUa:
    """A server of a robot; `what` says which values come."""

    what: str

    def __init__(self, address: str, robot: Robot, robot_id: str, file: Path | None = None) -> None:
        """Connect to opc.tcp://HOST:PORT, and find what is to be read.

        Raises InputError where no such server answers, or a node is not there, or the file says what is none.
        """
        if not address.startswith("opc.tcp://"):
            raise InputError(f'--opcua "{address[:100]}": give opc.tcp://HOST:PORT')
        self.address, self._robot, self.robot_id = address, robot, robot_id
        self._said = _read_file(file, len(robot.joints))
        self._stamp = self._newest = self._told = -math.inf
        self._times = _NodeTimes()
        try:
            self._connect()
        except (*_LOST, ValueError) as error:
            raise InputError(
                f"{address}: cannot be read by OPC UA ({first_line(error)}); check address, user and certificates"
            ) from error

    def states(self, done: threading.Event, announce: Announce) -> Iterator[State | InputError]:
        """Yield each state until `done`, and the error of one that is none.

        A connection that is lost is made again, and announced.
        """
        while not done.is_set():
            try:
                yield from self._read(done)
            except (*_LOST, InputError) as error:
                if done.is_set():
                    return
                announce(f"{self.address}: the connection is lost ({first_line(error)}); trying again")
                if self._connected_again(done):
                    announce(f"{self.address}: connected again")

    def _connected_again(self, done: threading.Event) -> bool:
        while not done.wait(_AGAIN):
            try:
                self._connect()
                return True
            except (*_LOST, InputError):
                continue
        return False

    def _connect(self) -> None:
        """Connect for a moment. Raises InputError, or one of `_LOST`."""
        self.what = asyncio.run(self._described())

    def _read(self, done: threading.Event) -> Iterator[State | InputError]:
        """Yield what the nodes say, `_RATE` times a second. Raises one of `_LOST` where the connection breaks."""
        with asyncio.Runner() as runner:
            readings = self._readings(done)
            while (reading := runner.run(_next(readings))) is not None:
                yield reading

    async def _described(self) -> str:
        async with self._places() as (_, places):
            units = {place.key: place.unit.name for place in places}
            return ", ".join(f"{STREAMED[_FIELDS[key]].label} ({unit})" for key, unit in units.items())

    async def _readings(self, done: threading.Event) -> AsyncIterator[State | InputError]:
        async with self._places() as (client, places):
            clock = await client.get_node(ua.ObjectIds.Server_ServerStatus_CurrentTime).read_value()
            due = time.monotonic()
            while not done.is_set():
                values = await client.read_attributes([place.node for place in places])
                for place, value in zip(places, values, strict=True):
                    self._times.hear(str(place.node), value, time.monotonic())
                try:
                    if (stamp := self._moment(places, values, clock)) is not None:
                        yield self._state(places, values, stamp)
                except InputError as error:
                    yield error
                due = max(due + 1.0 / _RATE, time.monotonic())
                await asyncio.sleep(due - time.monotonic())

    def _moment(self, places: list[_Place], values: list[ua.DataValue], clock: datetime) -> float | None:
        """Return the time of the values, s since 1970; None where they are those of the state before.

        clock: the server's as the connection was made: a robot that stood then has positions of a time long ago.
        """
        of_positions = [
            value.SourceTimestamp for place, value in zip(places, values, strict=True) if place.key == "position"
        ]
        newest = max((_seconds(at) for at in of_positions if at is not None), default=time.time())
        now, began = time.monotonic(), _seconds(clock)
        if newest != self._newest:
            self._stamp = newest if newest > began - _OLD else max(began, self._stamp)
        elif now - self._told < _STANDS:
            return None
        else:
            self._stamp += now - self._told
        self._newest, self._told = newest, now
        return self._stamp

    def _state(self, places: list[_Place], values: list[ua.DataValue], stamp: float) -> State:
        """Return the state of values. Raises InputError where a value is none of a robot."""
        readings: dict[str, tuple[float, ...]] = {}
        for place, value in zip(places, values, strict=True):
            readings[_FIELDS[place.key]] = (*readings.get(_FIELDS[place.key], ()), self._number(place, value))
        return state_of(self.robot_id, len(self._robot.joints), stamp, readings, where=self.address)

    def _number(self, place: _Place, value: ua.DataValue) -> float:
        reading = None if value.Value is None else value.Value.Value
        if value.StatusCode is not None and not value.StatusCode.is_good():
            raise InputError(f"{self.address}: {place.key} {place.node}: {value.StatusCode.name}")
        if self._times.hangs(str(place.node), time.monotonic()):
            raise InputError(
                f"{self.address}: {place.key} {place.node}: hangs: its status is good, its time stands still"
            )
        if isinstance(reading, bool) or not isinstance(reading, int | float):
            raise InputError(f"{self.address}: {place.key} {place.node}: {shown(reading)} is not a number")
        return place.unit.factor * reading + place.unit.offset

    @asynccontextmanager
    async def _places(self) -> AsyncIterator[tuple[Client, list[_Place]]]:
        """Connect, and give what is to be read. Raises InputError where a node, or its unit, is not known."""
        client, settings = Client(self.address, timeout=_PATIENCE), self._said
        if "user" in settings:
            client.set_user(settings["user"])
            client.set_password(os.environ.get("IRTWIN_OPCUA_PASSWORD", ""))
        if "certificate" in settings:
            files = settings["certificate"], settings.get("key", ""), None, settings.get("server_certificate")
            await client.set_security(SecurityPolicyBasic256Sha256, *files)
        async with client:
            nodes = {key: [client.get_node(node) for node in settings[key]] for key in _FIELDS if key in settings}
            if "position" not in nodes:
                nodes |= await self._of_axes(client)
            yield (
                client,
                [await self._place(key, place, node) for key in nodes for place, node in enumerate(nodes[key])],
            )

    async def _of_axes(self, client: Client) -> dict[str, list[Node]]:
        """Return the nodes of each axis, base to flange, as OPC 40010 has them."""
        try:
            di, robotics = [await client.get_namespace_index(uri) for uri in (_DI, _ROBOTICS)]
            systems = await (await client.nodes.objects.get_child(f"{di}:DeviceSet")).get_children()
        except (ValueError, ua.UaStatusCodeError):
            raise InputError(f"{self.address}: it has no robots by OPC 40010; name position by --nodes FILE") from None
        folders = [await _child(system, f"{robotics}:MotionDevices") for system in systems]
        devices = {
            (await device.read_browse_name()).Name: device
            for folder in folders
            if folder
            for device in await folder.get_children()
        }
        name = self._said.get("device", next(iter(devices)) if len(devices) == 1 else None)
        if name not in devices:
            raise InputError(f"{self.address}: its motion devices are {', '.join(devices)}; say device in --nodes FILE")
        axes = await (await devices[name].get_child(f"{robotics}:Axes")).get_children()
        if len(axes) != len(self._robot.joints):
            raise InputError(
                f"{self.address}: {name} has {len(axes)} axes, {self._robot.name} has {len(self._robot.joints)} joints"
            )
        nodes = {
            key: [await _child(axis, f"{di}:ParameterSet", f"{robotics}:{variable}") for axis in axes]
            for key, variable in _OF_AXES.items()
        }
        return {
            key: all_there
            for key, of_key in nodes.items()
            if len(all_there := [node for node in of_key if node]) == len(axes)
        }

    async def _place(self, key: str, joint: int, node: Node) -> _Place:
        channel = STREAMED[_FIELDS[key]]
        kind = self._robot.joints[joint].kind if channel.per_joint else ""
        try:
            (await node.read_data_value()).StatusCode.check()
            text = self._said.get("units", {}).get(key) or await _unit_text(node)
        except ua.UaStatusCodeError as error:
            raise InputError(f"{self.address}: {key} {node}: {first_line(error)}") from None
        unit = unit_of(text, (channel.unit_of(kind),))
        if unit is None:
            why = f'"{text}" is no unit of it' if text else "the server says no unit"
            raise InputError(f"{self.address}: {key} {node}: {why}; write units.{key} in --nodes FILE")
        return _Place(key, node, unit)


async def _next(readings: AsyncIterator[State | InputError]) -> State | InputError | None:
    return await anext(readings, None)


async def _child(node: Node, *path: str) -> Node | None:
    try:
        return await node.get_child(list(path))
    except ua.UaStatusCodeError:
        return None


async def _unit_text(node: Node) -> str:
    """Return the unit that a server says of a node; nothing where it says none."""
    units = await _child(node, "0:EngineeringUnits")
    unit = None if units is None else await units.read_value()
    if not isinstance(unit, ua.EUInformation):  # nothing, or what nobody filled in
        return ""
    code = int(unit.UnitId).to_bytes(4, "big", signed=True).lstrip(b"\0").decode("ascii", "replace")
    return _UNECE.get(code, unit.DisplayName.Text or "")


def _read_file(file: Path | None, joints: int) -> dict[str, Any]:
    """Return what a file says, node ids by channel. Raises InputError, naming file and key, where it is wrong."""
    if file is None:
        return {}
    settings = read_toml(file)
    table = TomlTable(file, "", settings)
    table.check_keys((*_FIELDS, "units", *_TEXTS))
    for key in settings:
        if key in _FIELDS:
            settings[key] = _node_ids(file, key, settings[key], joints if STREAMED[_FIELDS[key]].per_joint else None)
        elif key != "units":
            table.text(key)
        elif not isinstance(settings[key], dict) or not all(isinstance(unit, str) for unit in settings[key].values()):
            raise InputError(f'{file}: units should be text by channel, as {{ position = "deg" }}')
    return settings


def _node_ids(file: Path, key: str, given: Any, joints: int | None) -> list[ua.NodeId]:
    texts = given if joints is not None else [given]
    if not isinstance(texts, list) or len(texts) != (joints or 1) or not all(isinstance(text, str) for text in texts):
        raise InputError(f"{file}: {key} should be text{'' if joints is None else f' for each of {joints} joints'}")
    try:
        return [ua.NodeId.from_string(text) for text in texts]
    except ua.UaStringParsingError as error:
        wrong = next(text for text in texts if text in str(error))
        raise InputError(f'{file}: {key}: "{wrong[:100]}" is no node id, as "ns=2;s=Axis1.Position"') from None


def _seconds(at: datetime) -> float:
    return (at if at.tzinfo else at.replace(tzinfo=UTC)).timestamp()
