"""The tables of a store: those that its manifest names, and no other."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from irtwin.knowledge.store import store_files
from irtwin.knowledge.store.graph import KnowledgeGraph

pytestmark = pytest.mark.slow


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for _ in range(3):
        with KnowledgeGraph(tmp_path / "graph") as graph:
            graph.load_ontology()
            graph.update("INSERT DATA { <urn:a> <urn:b> 1 } ; DELETE DATA { <urn:a> <urn:b> 1 }")
    return tmp_path / "graph"


def test_the_manifest_names_the_tables_that_are_there(folder: Path) -> None:
    named = store_files._tables(folder)
    assert named == {file.name: file.stat().st_size for file in folder.glob("*.sst")}
    assert store_files.fault(folder) is None
    assert not list(folder.glob("LOG.old.*"))


def test_a_table_that_differs_is_named(folder: Path) -> None:
    file = max(folder.glob("*.sst"), key=lambda file: file.stat().st_size)
    content = file.read_bytes()
    for changed, fault in ((content[:-1], "has another size"), (bytes(len(content)), "was altered")):
        file.write_bytes(changed)
        assert store_files.fault(folder) == f"{file.name} {fault}"
    file.unlink()
    assert store_files.fault(folder) == f"{file.name} is missing"


def test_a_manifest_that_makes_no_sense_is_left_to_the_store(folder: Path) -> None:
    (manifest,) = folder.glob("MANIFEST-*")
    draw = random.Random(5)
    for size in (1, 7, 100, 40_000, 100_000):
        manifest.write_bytes(draw.randbytes(size))
        store_files.fault(folder)  # raises nothing, and ends
    manifest.unlink()
    assert store_files.fault(folder) == "the manifest that CURRENT names is missing"
