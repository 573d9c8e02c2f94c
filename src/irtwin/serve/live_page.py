"""/live and /live/ROBOT: robots as they move. Numbers come from /sparql, samples as events, shapes from the graph."""

from __future__ import annotations

import asyncio
import json
from typing import Any

import numpy as np
from starlette.requests import Request
from starlette.responses import Response, StreamingResponse
from starlette.routing import Route
from starlette.types import Receive, Scope, Send

from irtwin.asking import reading
from irtwin.errors import InputError
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.sparql_server import ServerFault
from irtwin.location import Location
from irtwin.providers.mesh_files import meshes_of_graph
from irtwin.providers.names import robot_iri
from irtwin.providers.robot_of_graph import robot_of_graph
from irtwin.serve.page import FOLDER, POLICY
from irtwin.serve.protocol import SERVER_FAILS, Refusal
from irtwin.serve.samples import Page, Samples
from irtwin.serve.shares import client
from irtwin.virtual.robot_data import robot_data

_MOST_ROBOTS = 64  # that are remembered as drawn
_POSES = """SELECT ?run ?name ?q {
  { SELECT ?run ?start { ?run irt:run_of ?arm ; irt:Start_Time ?start . ?any irt:state_of ?run } GROUP BY ?run ?start
    ORDER BY DESC(?start) LIMIT 60 }
  ?state irt:state_of ?run ; irt:of_Joint / irt:Joint_Name ?name ; irt:Joint_Position ?q }
  ORDER BY DESC(?start)"""


class LivePages:
    """The pages of a workspace."""

    def __init__(self, location: Location) -> None:
        self._location = location
        self.samples = Samples(location.folder)
        self._robots: dict[str, bytes] = {}
        self._drawing = asyncio.Lock()

    def routes(self) -> list[Route]:
        """Return where they are."""
        return [
            Route("/live", lambda request: _page("live_list.html"), methods=["GET"]),
            Route("/live/{robot}", lambda request: _page("live.html"), methods=["GET"]),
            Route("/live/{robot}/robot.json", self._robot, methods=["GET"]),
            Route("/live/{robot}/events", self._events, methods=["GET"]),
        ]

    async def _events(self, request: Request) -> Response:
        return _Events(self.samples, self.samples.page(request.path_params["robot"], client(request)))

    async def _robot(self, request: Request) -> Response:
        robot_id = request.path_params["robot"]
        async with self._drawing:  # one at a time: it takes a moment of the processor
            if robot_id not in self._robots:
                if len(self._robots) >= _MOST_ROBOTS:
                    self._robots.clear()
                try:
                    self._robots[robot_id] = await asyncio.to_thread(_drawn, self._location, robot_id)
                except ServerFault:
                    raise Refusal(502, SERVER_FAILS) from None
                except InputError as error:
                    raise Refusal(404, str(error)) from None
        return Response(self._robots[robot_id], media_type="application/json", headers={"Cache-Control": "no-cache"})


class _Events(StreamingResponse):
    """Server-sent events for one page, which is let go when its client is."""

    def __init__(self, samples: Samples, page: Page) -> None:
        headers = {"Cache-Control": "no-store", "X-Accel-Buffering": "no"}
        super().__init__(page.events(), media_type="text/event-stream", headers=headers)
        self._samples, self._page = samples, page

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        try:
            await super().__call__(scope, receive, send)
        finally:
            self._samples.leave(self._page)


def _page(name: str) -> Response:
    return Response((FOLDER / name).read_bytes(), media_type="text/html", headers={"Content-Security-Policy": POLICY})


def _drawn(location: Location, robot_id: str) -> bytes:
    """Return what robot.js builds a robot of, made of what the graph says of it, as JSON. Raises InputError."""
    with reading(location) as current:
        graph = current(False)
        iri = graph.iri(robot_iri(robot_id))
        if any(sign in iri for sign in '<>"{}|\\^` '):
            raise InputError(f"no robot {robot_id!r} here")
        robot = robot_of_graph(graph, iri)
        meshes = meshes_of_graph(graph, iri, location.folder)
        poses = _poses(graph, iri, robot.joint_names)
    named = {"name": robot.name, "stood": poses[0].tolist()}
    return json.dumps(robot_data(robot, poses, meshes) | named, allow_nan=False).encode()


def _poses(graph: KnowledgeGraph, iri: str, joints: tuple[str, ...]) -> np.ndarray:
    """Return poses in which runs left the robot, the newest first, (N, n) rad or m: what a camera should see."""
    ends: dict[Any, dict[str, float]] = {}
    for row in graph.query(_POSES, {"arm": iri}).rows:
        ends.setdefault(row["run"], {})[row["name"]] = row["q"]
    poses = [[end[joint] for joint in joints] for end in ends.values() if end.keys() >= set(joints)]
    return np.array(poses or [[0.0] * len(joints)], dtype=float)
