"""How far rules look is kept beside the graph, and worked out again where that cannot be trusted."""

import json
from pathlib import Path

import pytest

from irtwin.knowledge import locality
from irtwin.knowledge.kept_reach import FILE, kept

QUERY = "CONSTRUCT { $this a irt:Idle } WHERE { $this irt:of_Run ?run . ?limits irt:Idle_Share_Limit ?limit }"


@pytest.fixture
def worked_out(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return the queries that are worked out from now on, with nothing known before."""
    found, work_out = list[str](), locality._of_query
    monkeypatch.setattr(locality, "KNOWN", {})
    monkeypatch.setattr(locality, "_of_query", lambda text: (found.append(text), work_out(text))[1])
    return found


def asked(folder: Path | None) -> locality.Reach:
    """Ask as a new process does."""
    locality.KNOWN.clear()
    with kept(folder):
        return locality.of_query(QUERY)


def test_a_query_is_worked_out_once(tmp_path: Path, worked_out: list[str]) -> None:
    first = asked(tmp_path)
    assert asked(tmp_path) == first and first.anywhere and first.predicates
    assert worked_out == [QUERY]
    assert [file.name for file in tmp_path.iterdir()] == [FILE]


@pytest.mark.parametrize("change", ["made_by", "digest", "queries", "cut"])
def test_what_was_altered_or_made_by_other_software_is_worked_out_again(
    tmp_path: Path, worked_out: list[str], change: str
) -> None:
    first, file = asked(tmp_path), tmp_path / FILE
    said = json.loads(file.read_text())
    if change == "queries":
        said["queries"][QUERY]["anywhere"] = []
    elif change != "cut":
        said[change] = "0"
    file.write_text(json.dumps(said)[: 40 if change == "cut" else None])
    assert asked(tmp_path) == first
    assert asked(tmp_path) == first
    assert worked_out == [QUERY] * 2


def test_a_graph_in_memory_and_a_folder_that_cannot_be_written_to_keep_nothing(
    tmp_path: Path, worked_out: list[str]
) -> None:
    assert asked(None) == asked(tmp_path / "missing")
    assert worked_out == [QUERY] * 2
