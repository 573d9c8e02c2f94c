"""The plant as an OPC UA server that answers beside the endpoint: energy, power, state and last gap of each robot.

Machines / ROBOT / Monitoring / Consumption / Electricity / Main has the variables of OPC 34100's profile E2, where OPC
40001-4 has them; their companion types are not loaded. Whoever reaches the port may read; nobody writes.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from datetime import UTC, datetime
from typing import Any

from irtwin.errors import InputError
from irtwin.report.questions import Row
from irtwin.serve.asking import Asking
from irtwin.serve.protocol import Refusal

try:
    from asyncua import Node, Server, ua
except ModuleNotFoundError as error:
    raise InputError("OPC UA needs the package asyncua; pip install 'irtwin[opcua]'") from error

_log = logging.getLogger(__name__)
EVERY = 1.0  # s between two looks at the graph
_OURS, _MACHINERY, _ECM = (
    "https://w3id.org/irtwin",
    "http://opcfoundation.org/UA/Machinery/",
    "http://opcfoundation.org/UA/ECM/",
)
_UNITS = "http://www.opcfoundation.org/UA/units/un/cefact"
_MAIN = ("Monitoring", "Consumption", "Electricity", "Main")
# (column of `plant_now`, name, type, UNECE's number of the unit, unit); what is measured by OPC 34100 stands in `Main`
_MEASURED = (
    ("power_W", "AcActivePowerTotal", ua.VariantType.Float, 5723220, "W"),
    ("energy_Wh", "AcActiveEnergyTotalImportLp", ua.VariantType.Float, 5720146, "W·h"),
)
_SAID = (
    ("state", "State", ua.VariantType.String, ""),
    ("verdict", "LastGapVerdict", ua.VariantType.String, ""),
    ("closed_fraction", "LastGapClosedFraction", ua.VariantType.Double, 0.0),
    ("diagnosed", "LastGapDiagnosed", ua.VariantType.DateTime, datetime.fromtimestamp(0, UTC)),
)

Variables = dict[str, tuple[Node, ua.VariantType]]
"""A robot's nodes by column of `plant_now`, each with its type."""


@asynccontextmanager
async def answering(asking: Asking, question: str, host: str, port: int) -> AsyncIterator[None]:
    """Answer on a port until the block ends, by a question of the columns of `plant_now`."""
    logging.getLogger("asyncua").setLevel(logging.CRITICAL)
    server = Server()
    await server.init()
    server.set_endpoint(f"opc.tcp://{host}:{port}")
    server.set_server_name("irtwin")
    server.set_security_policy([ua.SecurityPolicyType.NoSecurity])
    server.allow_remote_admin(False)
    async with server:
        following = asyncio.create_task(_Plant(server, asking, question).follow())
        following.add_done_callback(_tell_fault)
        yield
        following.cancel()
        await asyncio.gather(following, return_exceptions=True)


def _tell_fault(task: asyncio.Task[None]) -> None:
    if not task.cancelled() and (fault := task.exception()) is not None:
        _log.error("OPC UA clients see nothing new any more: %s", fault)


class _Plant:
    """The robots' nodes, as the graph has them."""

    def __init__(self, server: Server, asking: Asking, question: str) -> None:
        self._server, self._asking, self._question = server, asking, question
        self._robots: dict[str, tuple[Node, Variables]] = {}

    async def follow(self) -> None:
        """Look at the graph again and again."""
        self._ours, self._machinery, self._ecm = [
            await self._server.register_namespace(uri) for uri in (_OURS, _MACHINERY, _ECM)
        ]
        self._machines = await self._server.nodes.objects.add_folder(self._machinery, "Machines")
        while True:
            with suppress(Refusal):  # all workers are taken, or one was lost: the next look tells
                await self._show(await self._asking.rows(self._question))
            await asyncio.sleep(EVERY)

    async def _show(self, rows: tuple[Row, ...]) -> None:
        for name in self._robots.keys() - {row["robot"] for row in rows}:
            await self._server.delete_nodes([self._robots.pop(name)[0]], recursive=True)
        for row in rows:
            if row["robot"] not in self._robots:
                self._robots[row["robot"]] = await self._added(row["robot"])
            for column, (node, kind) in self._robots[row["robot"]][1].items():
                await self._server.write_attribute_value(node.nodeid, _value(row[column], kind))

    async def _added(self, robot: str) -> tuple[Node, Variables]:
        main = machine = await self._machines.add_object(self._ours, robot)
        variables: Variables = {}
        for name in _MAIN:
            main = await main.add_folder(self._machinery, name)
        for column, name, kind, number, unit in _MEASURED:
            node = await main.add_variable(self._ecm, name, 0.0, kind)
            await node.add_property(0, "EngineeringUnits", ua.EUInformation(_UNITS, number, ua.LocalizedText(unit)))
            variables[column] = node, kind
        for column, name, kind, blank in _SAID:
            variables[column] = await machine.add_variable(self._ours, name, blank, kind), kind
        return machine, variables


def _value(value: Any, kind: ua.VariantType) -> ua.DataValue:
    """Return a value with the time it was seen; what the graph does not know is no data."""
    now = datetime.now(UTC)
    if value is None:
        return ua.DataValue(
            StatusCode=ua.StatusCode(ua.StatusCodes.BadNoData), SourceTimestamp=now, ServerTimestamp=now
        )
    return ua.DataValue(ua.Variant(value, kind), SourceTimestamp=now, ServerTimestamp=now)
