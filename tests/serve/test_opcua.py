"""Clients of OPC UA read what each robot takes and what its last gap was, and change nothing."""

from __future__ import annotations

import shutil
import socket
from pathlib import Path
from typing import Any

import pytest
from asyncua import ua
from asyncua.sync import Client
from tests.endpoint import serving
from tests.forks import Command
from tests.plants import HOSTILE
from tests.waiting import wait_for

pytestmark = pytest.mark.slow


def values(client: Client, *path: str) -> dict[str, Any]:
    """Return the variables below an object of Machines by their names; what is no data is None."""
    node = client.nodes.objects
    for name in ("Machines", *path):
        found = [it for it in node.get_children() if it.read_browse_name().Name == name]
        if not found:
            return {}
        node = found[0]
    said = {it.read_browse_name().Name: it.read_data_value(raise_on_bad_status=False) for it in node.get_variables()}
    return {name: value.Value.Value if value.StatusCode.is_good() else None for name, value in said.items()}


def refused(action: Any) -> str:
    with pytest.raises(ua.UaStatusCodeError) as error:
        action()
    return str(error.value)


def test_robots_are_read_by_opc_ua_and_nothing_is_written(plant_place: Path, tmp_path: Path) -> None:
    graph = Path(shutil.copytree(plant_place, tmp_path / "plant")) / "graph"
    with socket.create_server(("127.0.0.1", 0)) as found:
        port = found.getsockname()[1]
    with serving(graph, "--opcua", port, token=None), Client(f"opc.tcp://127.0.0.1:{port}") as client:
        wait_for(lambda: "LastGapDiagnosed" in values(client, HOSTILE))  # the last that is made
        arm = values(client, "Arm_A")
        assert (arm["State"], arm["LastGapVerdict"], arm["LastGapClosedFraction"]) == ("standstill", "attributed", 0.8)
        main = ("Monitoring", "Consumption", "Electricity", "Main")
        assert values(client, "Arm_A", *main) == {
            "AcActivePowerTotal": None,
            "AcActiveEnergyTotalImportLp": pytest.approx(1.27778, rel=1e-5),
        }
        assert values(client, HOSTILE)["State"] is None
        assert values(client, "Arm_B")["State"] == "stale"  # its stream gave up while it moved
        assert values(client, "Arm_B", *main)["AcActivePowerTotal"] is None
        machines = next(it for it in client.nodes.objects.get_children() if it.read_browse_name().Name == "Machines")
        (state,) = [it for it in machines.get_children()[0].get_variables() if it.read_browse_name().Name == "State"]
        assert "BadUserAccessDenied" in refused(lambda: state.write_value("off"))
        assert "BadUserAccessDenied" in refused(lambda: machines.add_folder(1, "mine"))
        assert "BadUserAccessDenied" in refused(lambda: client.delete_nodes([state]))


def test_a_port_that_is_taken_is_told_in_a_line(plant_place: Path, tmp_path: Path) -> None:
    workspace = shutil.copytree(plant_place, tmp_path / "plant")
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        done = Command("serve", "--workspace", workspace, "--port", 0, "--opcua", port)
        _, said = done.communicate()
    assert done.returncode == 2
    assert said.splitlines()[-1].endswith(f"port {port}: Address already in use; give --opcua another")
