"""The tools of a workspace, called by the protocol's own client."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from subprocess import CompletedProcess

import pytest
from tests.endpoint import make_graph

from irtwin.location import Location
from irtwin.serve import tools
from irtwin.storage.database import Workspace

pytestmark = [pytest.mark.slow, pytest.mark.anyio]


async def test_tools_answer_and_refuse_as_commands_do(tmp_path: Path) -> None:
    from mcp import Client, StdioServerParameters, stdio_client  # seconds to import, for each process

    Workspace(tmp_path / "w").close()
    make_graph(tmp_path / "w")
    calls = [
        ("questions", {}),
        ("ask", {"question": "SELECT ?robot { ?robot a irt:Industrial_Robot }"}),
        ("ask", {"question": "DELETE WHERE { ?s ?p ?o }"}),
        ("diagnose", {"data_set": "../other"}),
        ("predict", {"twin": "twin.json", "motion": "motion.csv"}),
    ]
    arguments = ["-m", "irtwin", "serve", "--workspace", "w", "--timeout", "20", "--mcp"]
    server = StdioServerParameters(command=sys.executable, args=arguments, cwd=tmp_path)
    async with Client(stdio_client(server)) as client:
        assert all(one.annotations.read_only_hint for one in (await client.list_tools()).tools)
        found = [await client.call_tool(*call) for call in calls]
    assert [one.is_error for one in found] == [False, False, True, True, True]
    texts = [one.content[0].text for one in found]
    named, answered = map(json.loads, texts[:2])
    updated, outside, missing = texts[2:]
    assert {"name", "question", "theme", "of"} == set(named["answer"][0])
    assert len(answered["answer"]) == 2
    assert answered["by"].startswith("irtwin query --format json --workspace ")
    assert "Error" in updated
    assert "../other: outside" in outside
    assert "twin.json: cannot be read" in missing


def test_what_a_prediction_is_by_can_be_said_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def said(command: list[str], **_: object) -> CompletedProcess[str]:
        out = next(one for one in command if one.startswith("--out="))
        return CompletedProcess(command, 0, f"{out.removeprefix('--out=')}: 5 J\n", "")

    monkeypatch.setattr(tools.subprocess, "run", said)
    monkeypatch.chdir(tmp_path)
    told = tools._Calls(Location(tmp_path), 1.0).predict("twin.json", "motion.csv")
    again = f"irtwin predict --quiet --out=predicted.parquet -- {tmp_path}/twin.json {tmp_path}/motion.csv"
    assert (told["answer"], told["by"]) == ("5 J", again)
