"""The tables of a store: those that were noted when it was closed."""

from __future__ import annotations

import json
import os
import random
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from irtwin.knowledge.store import store_files
from irtwin.knowledge.store.graph import KnowledgeGraph

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("written") / "graph"
    for _ in range(3):
        with KnowledgeGraph(folder) as graph:
            graph.load_ontology()
            graph.update("INSERT DATA { <urn:a> <urn:b> 1 } ; DELETE DATA { <urn:a> <urn:b> 1 }")
    return folder


@pytest.fixture
def folder(written: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(written, tmp_path / "graph"))


def test_what_was_closed_is_as_noted(folder: Path) -> None:
    noted = json.loads((folder / "irtwin-sums.json").read_text())["read"]
    assert noted.keys() == {file.name for file in folder.glob("*.sst")}
    assert store_files.fault(folder) is None
    assert not list(folder.glob("LOG.old.*"))


def test_a_table_that_differs_is_named(folder: Path) -> None:
    file = max(folder.glob("*.sst"), key=lambda file: file.stat().st_size)
    content = file.read_bytes()
    for changed in (content[:-1], bytes(len(content))):
        file.write_bytes(changed)
        assert store_files.fault(folder) == f"{file.name} was altered"
    file.unlink()
    assert store_files.fault(folder) == f"{file.name} is missing"


def test_a_table_is_read_again_only_where_its_time_is_another(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    read = list[Path]()
    crc = store_files._crc
    monkeypatch.setattr(store_files, "_crc", lambda file: read.append(file) or crc(file))
    assert store_files.fault(folder) is None
    assert not read
    noted = json.loads((folder / "irtwin-sums.json").read_text())["read"]
    file = folder / max(noted)
    os.utime(file, ns=(0, 0))  # as where it was put back from a copy
    assert store_files.fault(folder) is None
    assert read == [file]
    with KnowledgeGraph(folder):
        pass  # notes the time that it has now
    read.clear()
    assert store_files.fault(folder) is None
    assert not read


def test_a_table_altered_while_the_graph_is_open_is_named_when_it_is_opened_next(folder: Path) -> None:
    noted = json.loads((folder / "irtwin-sums.json").read_text())["read"]
    file = folder / max(noted)
    content = file.read_bytes()
    file.write_bytes(content[:10] + bytes([content[10] ^ 255]) + content[11:])
    store_files.note_sums(folder)  # as closing the graph does
    assert store_files.fault(folder) == f"{file.name} was altered"


def test_a_manifest_cut_anywhere_is_told(folder: Path) -> None:
    (manifest,) = folder.glob("MANIFEST-*")
    content = manifest.read_bytes()
    _, noted, _ = json.loads((folder / "irtwin-sums.json").read_text())["manifest"]
    assert noted > len(content) / 2  # the rest is what closing the store made of it
    for size in range(1, noted, 7):  # between two records, too, where the store would show an older state
        manifest.write_bytes(content[:size])
        assert store_files.fault(folder) == "the manifest was altered"
    manifest.write_bytes(content)
    assert store_files.fault(folder) is None


def test_a_writer_that_was_killed_is_no_damage(folder: Path) -> None:
    code = f"""
import os
from pathlib import Path
from irtwin.knowledge.store.graph import KnowledgeGraph
graph = KnowledgeGraph(Path({str(folder)!r}))
graph.update("INSERT DATA {{ <urn:c> <urn:b> 1 }}")
os._exit(0)
"""
    subprocess.run([sys.executable, "-c", code], check=True)
    assert store_files.fault(folder) is None
    with KnowledgeGraph(folder) as graph:
        assert graph.query("ASK { <urn:c> <urn:b> 1 }")[0]["answer"]


def test_a_manifest_that_makes_no_sense_is_left_to_the_store(folder: Path) -> None:
    (manifest,) = folder.glob("MANIFEST-*")
    draw = random.Random(5)
    for size in (1, 7, 100, 40_000, 100_000):
        manifest.write_bytes(draw.randbytes(size))
        store_files.fault(folder)  # raises nothing, and ends
    manifest.unlink()
    assert store_files.fault(folder) == "the manifest that CURRENT names is missing"
