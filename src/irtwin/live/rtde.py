"""States of a Universal Robots arm by RTDE, the real-time data exchange of its controller: version 2 of the protocol.

Packages are a size (2 bytes, its own among them), a kind (1 byte) and what is in it, big-endian. The client asks for
version 2, says which variables it wants, and has data sent.
"""

from __future__ import annotations

import math
import socket
import struct
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import closing
from itertools import islice

from irtwin.errors import InputError
from irtwin.live.controller import Controller
from irtwin.live.joint_stream import State, state_of
from irtwin.robot.description import Robot

PORT = 30004
_VERSION, _SETUP, _START, _DATA = ord("V"), ord("O"), ord("S"), ord("U")  # kinds of packages
_HEAD = struct.Struct(">HB")
_JOINTS = 6
_FORMS = {"DOUBLE": "d", "VECTOR6D": "6d"}
_WANTED = ("timestamp", "actual_q")  # s since the controller started; rad
_IF_THERE = (
    "actual_qd",  # rad/s
    "actual_current",  # A
    "joint_temperatures",  # degC
    "actual_robot_voltage",  # V
    "actual_robot_current",  # A
    "payload",  # kg
)
_PATIENCE = 5.0  # s for a whole package, however it comes: the controller sends some hundred a second
_LOOK_UP = 0.5  # s of a wait until it is seen that nobody follows any more
_HEAVIEST = 1e6  # kg
_LONGEST_UP = 1e9  # s since a controller started
_SKIPPED = 100  # packages of other kinds before an answer


class LostError(Exception):
    """The connection broke, or what came is no RTDE."""


class Rtde(Controller):
    """An arm's controller; `what` says which values come, and what is missing for others."""

    lost = (OSError, LostError)

    def __init__(self, address: str, robot: Robot, robot_id: str, rate: float = 125.0) -> None:
        """Connect to HOST or HOST:PORT. Raises InputError where no controller of such an arm answers.

        rate: samples a second to ask for, Hz.
        """
        self._where, self._rate = _read_address(address), rate
        self.address = f"{self._where[0]}:{self._where[1]}"
        self._robot, self.robot_id = robot, robot_id
        if len(robot.joints) != _JOINTS:
            raise InputError(
                f"{robot.name} has {len(robot.joints)} moving joints; an arm of Universal Robots has {_JOINTS}"
            )
        constants = [joint.torque_constant for joint in robot.joints]
        self._constants = None if None in constants else [float(constant or 0.0) for constant in constants]
        self._fields: dict[str, str] = {}
        self._recipe = 0
        try:
            self.connect()
        except self.lost as error:
            raise InputError(
                f"{self.address}: no controller answers by RTDE ({self.reason(error)}); check address and port"
            ) from error

    def _described(self) -> str:
        """Which values come, and what is missing for others."""
        torque = "actual_current" in self._fields
        parts = ["positions", *(["speeds"] if "actual_qd" in self._fields else [])]
        parts += ["torques (current times torque constant)"] if torque and self._constants else []
        parts += ["temperatures"] if "joint_temperatures" in self._fields else []
        parts += ["power (robot voltage times robot current)"] if self._has_power else []
        lacking = [] if not torque or self._constants else ["no torques: give torque_constant of each joint"]
        lacking += [] if self._has_power else ["no power: the controller does not offer it"]
        return "; ".join([", ".join(parts), *lacking])

    def read(self, done: threading.Event) -> Iterator[State | InputError]:
        """Yield what comes by the connection."""
        with closing(self._socket):
            for values, offset in self._packages(done):
                try:
                    yield self._state(values, offset)
                except InputError as error:
                    yield error

    def reason(self, error: BaseException) -> str:
        """Say in words why a connection broke."""
        return f"no whole package within {_PATIENCE:g} s" if isinstance(error, TimeoutError) else str(error)

    @property
    def _has_power(self) -> bool:
        return {"actual_robot_voltage", "actual_robot_current"} <= self._fields.keys()

    def connect(self) -> None:
        """Connect, agree on version and variables, and start the data."""
        give_up = time.monotonic() + _PATIENCE  # for all of it
        connection = socket.create_connection(self._where, timeout=_PATIENCE)
        try:
            if self._ask(connection, _VERSION, struct.pack(">H", 2), give_up) != b"\x01":
                raise LostError("it does not speak version 2 of RTDE")
            self._set_up(connection, give_up)
            if self._ask(connection, _START, b"", give_up) != b"\x01":
                raise LostError("it does not start to send")
        except BaseException:
            connection.close()
            raise
        self._socket, self.what = connection, self._described()

    def _set_up(self, connection: socket.socket, give_up: float) -> None:
        """Ask for the variables, and once more without those that the controller does not have."""
        names = [*_WANTED, *_IF_THERE]
        for _ in range(2):
            answer = self._ask(connection, _SETUP, struct.pack(">d", self._rate) + ",".join(names).encode(), give_up)
            kinds = answer[1:].decode("ascii", "replace").split(",")
            if not answer or len(kinds) != len(names):
                raise LostError("it does not say which variables it has")
            self._recipe = answer[0]
            self._fields = {name: kind for name, kind in zip(names, kinds, strict=True) if kind in _FORMS}
            names = list(self._fields)
            if absent := [name for name in _WANTED if name not in names]:
                raise LostError(f"it has no {absent[0]}")
            if len(names) == len(kinds):
                return
        raise LostError("it does not keep to the variables that it said")

    def _ask(self, connection: socket.socket, kind: int, content: bytes, give_up: float) -> bytes:
        connection.sendall(_HEAD.pack(_HEAD.size + len(content), kind) + content)
        for _ in range(_SKIPPED):
            came, answer = _package(connection, give_up)
            if came == kind:
                return answer
        raise LostError("it does not answer")

    def _packages(self, done: threading.Event) -> Iterator[tuple[dict[str, tuple[float, ...]], float]]:
        """Yield the variables of each data package, and what its timestamp counts from, s since 1970."""
        form = struct.Struct(">B" + "".join(_FORMS[kind] for kind in self._fields.values()))
        offset = None
        while not done.is_set():
            kind, content = _package(self._socket, time.monotonic() + _PATIENCE, done)
            if kind != _DATA:
                continue  # a text of the controller's, say
            if len(content) != form.size or content[0] != self._recipe:
                raise LostError("a data package is not what was asked for")
            values = self._by_name(form.unpack(content)[1:])
            if offset is None and 0.0 <= values["timestamp"][0] <= _LONGEST_UP:
                offset = time.time() - values["timestamp"][0]
            yield values, math.nan if offset is None else offset

    def _by_name(self, values: tuple[float, ...]) -> dict[str, tuple[float, ...]]:
        left = iter(values)
        widths = {name: _JOINTS if kind == "VECTOR6D" else 1 for name, kind in self._fields.items()}
        return {name: tuple(islice(left, width)) for name, width in widths.items()}

    def _state(self, said: Mapping[str, tuple[float, ...]], offset: float) -> State:
        """Return the state of a data package. Raises InputError where a value is none of a robot."""
        values = {"q": said["actual_q"]}
        if "actual_qd" in said:
            values["dq"] = said["actual_qd"]
        if "actual_current" in said and self._constants is not None:
            values["torque"] = tuple(a * b for a, b in zip(said["actual_current"], self._constants, strict=True))
        if "joint_temperatures" in said:
            values["temperature"] = said["joint_temperatures"]
        if self._has_power:
            values["power"] = (said["actual_robot_voltage"][0] * said["actual_robot_current"][0],)
        payload = said.get("payload", (math.nan,))[0]
        return state_of(
            self.robot_id,
            _JOINTS,
            offset + said["timestamp"][0],
            values,
            payload if 0 <= payload <= _HEAVIEST else None,
            where=self.address,
        )


def _package(connection: socket.socket, give_up: float, done: threading.Event | None = None) -> tuple[int, bytes]:
    """Return the next package's kind and content, whole before `give_up`, as time.monotonic() has it.

    Raises TimeoutError where it is not, and LostError where it is `done` before.
    """
    size, kind = _HEAD.unpack(_exactly(connection, _HEAD.size, give_up, done))
    if size < _HEAD.size:
        raise LostError("what it sends is no RTDE")
    return kind, _exactly(connection, size - _HEAD.size, give_up, done)


def _exactly(connection: socket.socket, count: int, give_up: float, done: threading.Event | None) -> bytes:
    parts = bytearray()
    while len(parts) < count:
        left = give_up - time.monotonic()
        if left <= 0.0:
            raise TimeoutError
        if done is not None and done.is_set():
            raise LostError("it is not followed any more")
        connection.settimeout(min(left, _LOOK_UP))
        try:
            part = connection.recv(count - len(parts))
        except TimeoutError:
            continue
        if not part:
            raise LostError("it closed the connection")
        parts += part
    return bytes(parts)


def _read_address(text: str) -> tuple[str, int]:
    host, _, port = text.rpartition(":") if ":" in text else (text, "", str(PORT))
    if not host or not port.isascii() or not port.isdigit() or not 0 < int(port) < 1 << 16:
        raise InputError(f'--rtde "{text[:100]}": give HOST or HOST:PORT')
    return host, int(port)
