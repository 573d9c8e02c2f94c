"""The tools of a workspace, called by the protocol's own client."""

from __future__ import annotations

import asyncio
import json
import sys
from pathlib import Path
from typing import Any

import pytest
from tests.endpoint import make_graph

from irtwin.storage.database import Workspace


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("tools")
    Workspace(folder / "w").close()
    make_graph(folder / "w")
    return folder


def called(folder: Path, *calls: tuple[str, dict[str, Any]]) -> list[Any]:
    """Return what tools answer: the document, or the text of a refusal."""
    from mcp import Client, StdioServerParameters, stdio_client  # seconds to import, for each process

    async def ask() -> list[Any]:
        arguments = ["-m", "irtwin", "serve", "--workspace", "w", "--timeout", "20", "--mcp"]
        async with Client(
            stdio_client(StdioServerParameters(command=sys.executable, args=arguments, cwd=folder))
        ) as to:
            assert all(one.annotations.read_only_hint for one in (await to.list_tools()).tools)
            found = [await to.call_tool(*call) for call in calls]
            return [one.content[0].text if one.is_error else json.loads(one.content[0].text) for one in found]

    return asyncio.run(ask())


@pytest.mark.slow
def test_tools_answer_and_refuse_as_commands_do(folder: Path) -> None:
    robots = "SELECT ?robot { ?robot a irt:Industrial_Robot }"
    named, answered, updated, outside, missing = called(
        folder,
        ("questions", {}),
        ("ask", {"question": robots}),
        ("ask", {"question": "DELETE WHERE { ?s ?p ?o }"}),
        ("diagnose", {"data_set": "../other"}),
        ("predict", {"twin": "twin.json", "motion": "motion.csv"}),
    )
    assert {"name", "question", "theme", "of"} == set(named["answer"][0])
    assert len(answered["answer"]) == 2
    assert answered["by"].startswith("irtwin query --format json --workspace ")
    assert "Error" in updated
    assert "../other: outside" in outside
    assert "twin.json: cannot be read" in missing
