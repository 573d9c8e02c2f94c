from __future__ import annotations

import ast
from pathlib import Path

import pytest

from irtwin.errors import InputError
from irtwin.storage import files


def test_a_file_is_written_whole(tmp_path: Path) -> None:
    file = tmp_path / "deep" / "twin.json"
    files.write(file, b"one")
    files.write(file, b"two")
    assert file.read_bytes() == b"two"
    assert list(file.parent.iterdir()) == [file]


def test_a_failure_leaves_nothing_behind(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError), files.temporary_beside(tmp_path) as temporary:
        temporary.write_bytes(b"half")
        raise RuntimeError
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("path", ["../x", "/etc/passwd", "a/../../x", "link/x", "circle", "a\0b"])
def test_a_path_that_leads_outside_is_refused(tmp_path: Path, path: str) -> None:
    workspace = tmp_path / "workspace"
    workspace.mkdir()
    (workspace / "link").symlink_to(tmp_path)
    (workspace / "circle").symlink_to("circle")
    with pytest.raises(InputError, match="leads outside the workspace; nothing was read or written"):
        files.inside(workspace, path)


def test_a_path_inside_is_that_of_the_file(tmp_path: Path) -> None:
    assert files.inside(tmp_path, "reports/x.html") == tmp_path / "reports" / "x.html"


def test_nobody_but_the_gate_makes_a_path_of_a_workspace() -> None:
    source = Path(files.__file__).parents[1]
    makers = [file.name for file in source.rglob("*.py") if "InsidePath(" in file.read_text(encoding="utf-8")]
    assert makers == ["files.py"]


@pytest.mark.slow
def test_a_path_of_a_workspace_is_made_of_names_that_stand_in_the_code() -> None:
    # A name that comes from a row, an archive or the graph goes through `Workspace.file` or `files.inside`.
    source = Path(files.__file__).parents[1]
    joined = [
        f"{file.name}, line {node.lineno}: {ast.unparse(node)}"
        for file in source.rglob("*.py")
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8")))
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Div) and _is_workspace(node.left)
        if not _is_written_out(node.right)
    ]
    assert {one.partition(",")[0] for one in joined} <= {"files.py"}, joined


def _is_workspace(node: ast.expr) -> bool:
    return ast.unparse(node) in ("workspace", "place.folder", "apart.folder", "source.folder", "target.folder")


def _is_written_out(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) or ast.unparse(node).split(".")[-1].strip("_").isupper()
