"""The plant is no echo of the twin: it may import nothing of it, nor the library that the twin computes with."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PLANT = [*(ROOT / "src/irtwin/demo/plant").glob("*.py"), *(ROOT / "bench/plant").glob("*.py")]
ALLOWED = {"irtwin.demo.plant", "mujoco", "numpy", "plant", "pyarrow", "scipy"}
STANDARD = {"__future__", "argparse", "collections", "dataclasses", "datetime", "functools", "pathlib", "tomllib"}
STANDARD |= {"typing", "xml"}


@pytest.mark.parametrize("file", sorted(PLANT), ids=lambda file: file.stem)
def test_imports_only_what_it_may(file: Path) -> None:
    imported = set()
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            imported |= {root(alias.name) for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0
            imported.add(root(str(node.module)))
    assert imported <= ALLOWED | STANDARD


def root(module: str) -> str:
    """Return what is to be allowed of a module."""
    parts = module.split(".")
    return ".".join(parts[: 3 if parts[0] == "irtwin" else 1])
