"""A robot behind an OPC UA server of asyncua: axes as OPC 40010 has them (A1 to A6), and plain nodes (B1 to B6)."""

from __future__ import annotations

import asyncio
import math
import socket
import threading
from collections.abc import Coroutine
from pathlib import Path
from typing import Any

from asyncua import Server, ua

DEGREE = ua.EUInformation("http://www.opcfoundation.org/UA/units/un/cefact", 17476, ua.LocalizedText("°"))


class ServedRobot:
    """Moves while it is started. values: by node id, put over what moves; still: nothing has a new time.

    stands: it does not move, and its values have new times; hung: how many joints' values have none, from the base on.
    """

    def __init__(self) -> None:
        self.values: dict[str, Any] = {}
        self.still = self.stands = False
        self.hung = 0
        with socket.socket() as it:
            it.bind(("127.0.0.1", 0))
            self.address = f"opc.tcp://127.0.0.1:{it.getsockname()[1]}"
        self._loop = asyncio.new_event_loop()
        threading.Thread(target=self._loop.run_forever, daemon=True).start()
        self._do(self._made())

    def start(self, certificates: tuple[Path, Path] | None = None) -> None:
        """Answer, and ask for certificates where one is given, with its key."""
        self.values, self.still, self.stands, self.hung = {}, False, False, 0
        self._do(self._start(certificates))

    def stop(self) -> None:
        """Answer no more."""
        self._do(self._server.stop())

    def _do(self, work: Coroutine[Any, Any, None]) -> None:
        asyncio.run_coroutine_threadsafe(work, self._loop).result(60.0)

    async def _made(self) -> None:
        self._server = server = Server()
        await server.init()
        server.set_endpoint(self.address)
        await server.register_namespace("urn:robot")
        di, robotics = [
            await server.register_namespace(f"http://opcfoundation.org/UA/{it}/") for it in ("DI", "Robotics")
        ]
        system = await (await server.nodes.objects.add_object(di, "DeviceSet")).add_object(2, "Cell")
        device = await (await system.add_object(robotics, "MotionDevices")).add_object(2, "KR6")
        axes = await device.add_object(robotics, "Axes")
        self._nodes = []
        for joint in range(1, 7):
            axis = await axes.add_object(2, f"Axis_{joint}")
            parameters = await axis.add_object(di, "ParameterSet")
            node = await parameters.add_variable(f"ns=2;s=A{joint}", f"{robotics}:ActualPosition", 0.0)
            await node.add_property(ua.NodeId(f"A{joint}.unit", 2), "0:EngineeringUnits", DEGREE)
            plain = await server.nodes.objects.add_variable(f"ns=2;s=B{joint}", f"2:B{joint}", 0.0)
            self._nodes.append((node, plain))
        for name, value in (("P", 0.5), ("T", "open")):
            await server.nodes.objects.add_variable(f"ns=2;s={name}", f"2:{name}", value)
        self._moves = asyncio.create_task(self._move())

    async def _start(self, certificates: tuple[Path, Path] | None) -> None:
        policy = ua.SecurityPolicyType.NoSecurity
        if certificates is not None:
            policy = ua.SecurityPolicyType.Basic256Sha256_SignAndEncrypt
            await self._server.load_certificate(str(certificates[0]))
            await self._server.load_private_key(str(certificates[1]))
        self._server._policies.clear()  # they would be added to those of the start before
        self._server.iserver.endpoints.clear()
        self._server.set_security_policy([policy])
        await self._server.start()

    async def _move(self) -> None:
        step = 0
        while True:
            step += not self.stands
            for joint, nodes in enumerate(self._nodes):
                for node in () if self.still or joint < self.hung else nodes:
                    await node.write_value(30.0 * math.sin(0.01 * step + joint))
            for name, value in list(self.values.items()):
                said = value if isinstance(value, ua.DataValue) else ua.DataValue(value)
                await self._server.write_attribute_value(ua.NodeId.from_string(name), said)
            await asyncio.sleep(0.01)
