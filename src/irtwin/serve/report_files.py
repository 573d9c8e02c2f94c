"""/reports/NAME: the HTML files in a workspace's `reports` folder, each kept apart from this server's other pages."""

from __future__ import annotations

import asyncio
from pathlib import Path

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from irtwin.errors import InputError
from irtwin.serve.protocol import Refusal
from irtwin.storage.files import inside

# A report has scripts, and a policy of its own in its head that names them. Whatever the file is, it cannot act here.
POLICY = "sandbox allow-scripts allow-downloads; frame-ancestors 'none'"
_FOLDER = "reports"


class ReportFiles:
    """The reports of a workspace."""

    def __init__(self, workspace: Path) -> None:
        self._workspace = workspace

    def names(self) -> list[str]:
        """Return the reports that are there."""
        folder = self._workspace / _FOLDER
        return sorted(file.name for file in folder.glob("*.html") if file.is_file()) if folder.is_dir() else []

    def of_robot(self, robot_id: str) -> dict[str, str | None]:
        """Return the names of a robot's reports: `report` of its energy and `gap_report`, or None."""
        names = {"report": f"{robot_id}.html", "gap_report": f"{robot_id}.gap.html"}
        return {which: name if name in self.names() else None for which, name in names.items()}

    def routes(self) -> list[Route]:
        """Return where they are."""
        return [Route("/reports/{name}", self._report, methods=["GET"])]

    async def _report(self, request: Request) -> Response:
        name = request.path_params["name"]
        headers = {"Content-Security-Policy": POLICY, "Cache-Control": "no-cache"}
        return Response(await asyncio.to_thread(self._read, name), media_type="text/html", headers=headers)

    def _read(self, name: str) -> bytes:
        if name not in self.names():
            raise Refusal(404, "no such report")
        try:
            return inside(self._workspace, f"{_FOLDER}/{name}").read_bytes()
        except (InputError, OSError):  # a link that leads outside, or a file that has just gone
            raise Refusal(404, "no such report") from None
