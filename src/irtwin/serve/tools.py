"""A workspace as tools of the Model Context Protocol: questions, explanations, diagnoses and predictions.

A call is a command in a process of its own, within a time. It reads, and writes nothing; what the command line refuses,
a call refuses in the same words.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable, Sequence
from functools import wraps
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated, Any

from irtwin.errors import InputError
from irtwin.location import Location

if TYPE_CHECKING:
    from mcp.server import MCPServer

_LONGER = 40  # times a query's limit, for a diagnosis
_ABOUT = (
    "Digital twins of industrial robots and their energy, in a knowledge graph. Call `questions` first: most of what "
    "people ask has a name. Units are in the names of columns and parameters. `explain` says where a number is from."
)
_Question = Annotated[str, "the name of a question, or a query in SPARQL 1.1 with the prefix irt:"]
_Triple = Annotated[str, "subject, predicate and object, as names with a prefix, IRIs or literals; ? is anything"]
_File = Annotated[str, "a path below the folder that the server was started in"]


def server(location: Location, seconds: float) -> MCPServer[Any]:
    """Return the server of a workspace's tools; a question may take some seconds. InputError without the package."""
    try:
        from mcp.server import MCPServer
        from mcp.server.mcpserver.exceptions import ToolError
        from mcp.types import ToolAnnotations
    except ModuleNotFoundError as error:
        raise InputError("--mcp needs the package mcp; install irtwin[mcp]") from error
    offered = MCPServer("irtwin", instructions=_ABOUT, version=version("irtwin"), log_level="WARNING")
    calls = _Calls(location, seconds)
    for tool in (calls.questions, calls.ask, calls.explain, calls.diagnose, calls.predict):
        reads = ToolAnnotations(read_only_hint=True, open_world_hint=False)
        offered.tool(annotations=reads)(_refusing(tool, ToolError))
    return offered


def _refusing(tool: Callable[..., Any], refusal: type[Exception]) -> Callable[..., Any]:
    """Return a tool that refuses a user's mistake in the protocol's way."""

    @wraps(tool)
    def called(*arguments: Any, **named: Any) -> Any:
        try:
            return tool(*arguments, **named)
        except InputError as error:
            raise refusal(str(error)) from None

    return called


class _Calls:
    """The tools. Their docstrings are what a client is told of them."""

    def __init__(self, location: Location, seconds: float) -> None:
        self._seconds = seconds
        self._at = ["--workspace", str(location.folder)]
        if location.graph_url is not None:
            self._at += ["--graph", location.graph_url]
        self._folder = Path.cwd().resolve()

    def questions(self) -> dict[str, Any]:
        """List the questions that have a name, by theme; `of` says which can be asked of one robot."""
        return self._answer(["query", "--format", "json", *self._at])

    def ask(self, question: _Question, robot: str | None = None) -> dict[str, Any]:
        """Answer a question from the graph, of all robots or of one by its name."""
        of = [] if robot is None else [f"--robot={robot}"]
        return self._answer(["query", "--format", "json", *of, *self._at, "--", question])

    def explain(self, triple: _Triple) -> dict[str, Any]:
        """Explain where triples of the graph come from: rules, mappings, runs, files and their checksums."""
        return self._answer(["explain", "--json", *self._at, "--", triple])

    def diagnose(self, data_set: _File, simulator: _File | None = None) -> dict[str, Any]:
        """Say where a robot differs from its twin, or from a simulator's model (MJCF), and why. Takes minutes."""
        with TemporaryDirectory() as folder:
            out = Path(folder) / "diagnosis.json"
            beside = [] if simulator is None else [f"--simulator={self._inside(simulator)}"]
            command = ["diagnose", "--quiet", f"--json={out}", *beside, "--", str(self._inside(data_set))]
            notes = self._said(command, self._seconds * _LONGER).stderr
            again = [argument.replace(str(out), out.name) for argument in command]
            return self._told(json.loads(out.read_text(encoding="utf-8")), again, notes)

    def predict(self, twin: _File, motion: _File) -> dict[str, Any]:
        """Say what energy a motion will take, by a twin that `irtwin diagnose --save-twin` wrote."""
        with TemporaryDirectory() as folder:
            out = Path(folder) / "predicted.parquet"
            command = ["predict", "--quiet", f"--out={out}", "--", str(self._inside(twin)), str(self._inside(motion))]
            done = self._said(command, self._seconds * _LONGER)
        again = [argument.replace(str(out), out.name) for argument in command]
        return self._told(done.stdout.removeprefix(f"{out}: ").strip(), again, done.stderr)

    def _inside(self, path: str) -> Path:
        file = (self._folder / path).resolve()
        if not file.is_relative_to(self._folder):
            raise InputError(f"{path}: outside {self._folder}; give a path below the folder that the server runs in")
        return file

    def _answer(self, command: Sequence[str]) -> dict[str, Any]:
        done = self._said(command, self._seconds)
        return self._told(json.loads(done.stdout), command, done.stderr)

    def _said(self, command: Sequence[str], seconds: float) -> subprocess.CompletedProcess[str]:
        """Return what a command said; InputError with what it refused, or where it takes too long."""
        try:
            done = subprocess.run(
                [sys.executable, "-m", "irtwin", *command],
                stdin=subprocess.DEVNULL,
                capture_output=True,
                text=True,
                timeout=seconds,
                cwd=self._folder,
            )
        except subprocess.TimeoutExpired as error:
            raise InputError(f"not answered within {seconds:g} s; ask for less, or give --timeout") from error
        if done.returncode:
            raise InputError(done.stderr.strip() or f"ended with status {done.returncode}")
        return done

    def _told(self, answer: object, command: Sequence[str], notes: str) -> dict[str, Any]:
        """Return an answer with what it is from: the command that gives it again, and what was said beside it."""
        return {
            "answer": answer,
            "by": " ".join(["irtwin", *command]),
            "version": version("irtwin"),
            "notes": notes.strip(),
        }
