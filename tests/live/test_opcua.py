"""OPC UA: what is read of a robot by OPC 40010 or by node ids, and of one that is lost, stands, or says nonsense."""

from __future__ import annotations

import math
import subprocess
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from asyncua import ua
from tests.live.opcua_robot import ServedRobot
from tests.synthetic import arm

from irtwin.errors import InputError
from irtwin.live import opcua
from irtwin.live.joint_stream import State
from irtwin.live.opcua import OpcUa

NODES = "position = [" + ", ".join(f'"ns=2;s=B{joint + 1}"' for joint in range(6)) + "]\n"


@pytest.fixture(scope="module")
def stopped() -> ServedRobot:
    return ServedRobot()


@pytest.fixture
def served(stopped: ServedRobot) -> Iterator[ServedRobot]:
    stopped.start()
    yield stopped
    stopped.stop()


class Followed:
    """Follows a server until there are enough states, or refusals."""

    def __init__(self, served: ServedRobot, file: Path | None = None) -> None:
        self.states: list[State] = []
        self.refused: list[str] = []
        self.said: list[str] = []
        self.client = OpcUa(served.address, arm(6), "arm", file)
        self._done = threading.Event()
        self._thread = threading.Thread(target=self._follow, daemon=True)
        self._thread.start()

    def _follow(self) -> None:
        for it in self.client.states(self._done, self.said.append):
            if isinstance(it, InputError):
                self.refused.append(str(it))
            else:
                self.states.append(it)

    def until(self, enough: Any) -> None:
        ends = time.monotonic() + 20.0
        while not enough():
            assert time.monotonic() < ends, (len(self.states), self.refused[:3], self.said)
            time.sleep(0.02)

    def __enter__(self) -> Followed:
        return self

    def __exit__(self, *_: object) -> None:
        self._done.set()
        self._thread.join(10.0)
        assert not self._thread.is_alive()


def said(tmp_path: Path, text: str) -> Path:
    file = tmp_path / "nodes.toml"
    file.write_text(text)
    return file


def test_axes_of_opc_40010_are_read_in_their_unit(served: ServedRobot) -> None:
    with Followed(served) as it:
        it.until(lambda: len(it.states) > 60)
    assert it.client.what == "position (deg)"
    assert (it.refused, it.said) == ([], [])
    assert abs(it.states[-1].time - time.time()) < 5.0
    assert all(later.time > state.time for state, later in zip(it.states, it.states[1:], strict=False))
    for state in it.states:
        assert max(abs(one) for one in state.of("q")) <= math.radians(30.0)
        assert math.isnan(state.of("power")[0])
    assert it.states[0].of("q") != it.states[-1].of("q")


def test_node_ids_units_and_the_power_are_those_of_the_file(served: ServedRobot, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"the server says no unit; write units.position"):
        OpcUa(served.address, arm(6), "arm", said(tmp_path, NODES))
    text = NODES + 'power = "ns=2;s=P"\nunits = { position = "deg", power = "kW" }\n'
    with pytest.raises(InputError, match=r"power ns=2;s=Q: .*BadNodeIdUnknown"):
        OpcUa(served.address, arm(6), "arm", said(tmp_path, text.replace("=P", "=Q")))
    with pytest.raises(InputError, match='"bar" is no unit of it'):
        OpcUa(served.address, arm(6), "arm", said(tmp_path, text.replace("kW", "bar")))
    with Followed(served, said(tmp_path, text)) as it:
        it.until(lambda: len(it.states) > 10)
    assert it.states[-1].of("power") == (500.0,)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ('positions = "ns=2;s=A"\n', "did you mean position?"),
        ('position = "ns=2;s=A"\n', "position should be text for each of 6 joints"),
        ("user = 3\n", "user should be text"),
        ("units = 3\n", "units should be text"),
        ('power = ["ns=2;s=P"]\n', "power should be text"),
        (NODES.replace("ns=2;s=B1", "B1"), 'position: "B1" is no node id'),
    ],
)
def test_a_file_that_says_what_is_none_is_refused(tmp_path: Path, text: str, why: str) -> None:
    with pytest.raises(InputError) as refused:
        OpcUa("opc.tcp://127.0.0.1:9", arm(6), "arm", said(tmp_path, text))
    assert f"{tmp_path}" in str(refused.value)
    assert why in str(refused.value)


def test_a_number_that_is_none_and_a_node_that_fails_are_refused_and_the_rest_goes_on(served: ServedRobot) -> None:
    with Followed(served) as it:
        failed = ua.StatusCode(ua.StatusCodes.BadSensorFailure)
        for value, why in (
            (ua.Variant(float("nan")), "position is not a number within"),
            (ua.DataValue(ua.Variant(1.0), StatusCode=failed), "position ns=2;s=A2: BadSensorFailure"),
        ):
            served.values = {"ns=2;s=A2": value}
            it.until(lambda why=why: any(why in reason for reason in it.refused))
        served.values = {}
        count = len(it.states)
        it.until(lambda: len(it.states) > count + 20)
    assert it.said == []


def test_a_text_where_a_number_should_be_is_refused(served: ServedRobot, tmp_path: Path) -> None:
    with Followed(served, said(tmp_path, 'power = "ns=2;s=T"\nunits = { power = "W" }\n')) as it:
        it.until(lambda: it.refused)
    assert it.refused[0] == f"{served.address}: power ns=2;s=T: 'open' is not a number"
    assert it.states == []


@pytest.mark.slow
def test_a_robot_that_stands_has_states_though_no_position_has_a_new_time(served: ServedRobot) -> None:
    served.still = True
    time.sleep(2.1)
    with Followed(served) as it:
        it.until(lambda: len(it.states) >= 3)
    assert abs(it.states[0].time - time.time()) < 8.0
    steps = [later.time - state.time for state, later in zip(it.states, it.states[1:], strict=False)]
    assert steps == pytest.approx([0.5] * len(steps), abs=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("hung", [1, 6])
def test_a_node_that_hangs_while_its_status_is_good_is_refused(served: ServedRobot, hung: int) -> None:
    served.stands = True
    with Followed(served) as it:
        it.until(lambda: len(it.states) > 40)
        assert it.refused == []
        served.hung, served.stands = hung, False
        it.until(lambda: it.refused)
        assert it.refused[0].endswith("position ns=2;s=A1: hangs: its status is good, its time stands still")
        served.hung, count = 0, len(it.states)
        it.until(lambda: len(it.states) > count + 10)
    assert it.said == []


def test_a_connection_that_is_lost_is_made_again(served: ServedRobot) -> None:
    with Followed(served) as it:
        it.until(lambda: len(it.states) > 10)
        served.stop()
        it.until(lambda: it.said)
        count = len(it.states)
        served.start()
        it.until(lambda: len(it.states) > count + 10)
    assert "the connection is lost" in it.said[0]
    assert it.said[-1] == f"{served.address}: connected again"
    assert all(later.time > state.time for state, later in zip(it.states, it.states[1:], strict=False))


def test_what_is_no_server_and_what_has_no_robot_of_these_joints_is_told_in_a_line(
    served: ServedRobot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(InputError, match=r"cannot be read by OPC UA .*check address, user and certificates"):
        OpcUa("opc.tcp://127.0.0.1:9", arm(6), "arm")
    with pytest.raises(InputError, match=r"give opc\.tcp://HOST:PORT"):
        OpcUa("robot", arm(6), "arm")
    with pytest.raises(InputError, match=r"KR6 has 6 axes, .* has 2 joints"):
        OpcUa(served.address, arm(2), "arm")
    with pytest.raises(InputError, match="its motion devices are KR6; say device"):
        OpcUa(served.address, arm(6), "arm", said(tmp_path, 'device = "KR7"'))
    monkeypatch.setattr(opcua, "_ROBOTICS", "urn:none")
    with pytest.raises(InputError, match="no robots by OPC 40010; name position by --nodes FILE"):
        OpcUa(served.address, arm(6), "arm")


@pytest.mark.slow
def test_a_server_that_asks_for_certificates_gets_them_and_has_to_show_its_own(
    stopped: ServedRobot, tmp_path: Path
) -> None:
    robot, ours = _certificate(tmp_path, "robot"), _certificate(tmp_path, "irtwin")
    text = f'certificate = "{ours[0]}"\nkey = "{ours[1]}"\nserver_certificate = "{{}}"\n'
    stopped.start(robot)
    try:
        for file in (None, said(tmp_path, text.format(ours[0]))):
            with pytest.raises(InputError, match="check address, user and certificates"):
                OpcUa(stopped.address, arm(6), "arm", file)
        with pytest.raises(InputError, match=r"none\.der"):
            OpcUa(stopped.address, arm(6), "arm", said(tmp_path, text.format(tmp_path / "none.der")))
        assert OpcUa(stopped.address, arm(6), "arm", said(tmp_path, text.format(robot[0]))).what == "position (deg)"
    finally:
        stopped.stop()


def _certificate(folder: Path, name: str) -> tuple[Path, Path]:
    certificate, key = folder / f"{name}.der", folder / f"{name}.pem"
    subprocess.run(
        ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-keyout", key, "-outform", "DER",
         "-out", certificate, "-days", "2", "-subj", f"/CN={name}", "-addext", f"subjectAltName=URI:urn:{name}"],
        check=True, capture_output=True,
    )  # fmt: skip
    return certificate, key
