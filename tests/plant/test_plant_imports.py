"""The plant is no echo of the twin: it may import nothing of it, nor the library that the twin computes with."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

PLANT = Path(__file__).parents[2] / "bench" / "plant"
ALLOWED = {"mujoco", "numpy", "plant", "pyarrow"}
STANDARD = {"__future__", "argparse", "collections", "dataclasses", "datetime", "functools", "pathlib", "tomllib"}
STANDARD |= {"typing", "xml"}


@pytest.mark.parametrize("file", sorted(PLANT.glob("*.py")), ids=lambda file: file.stem)
def test_imports_only_what_it_may(file: Path) -> None:
    imported = set()
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            imported |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0
            imported.add(str(node.module).split(".")[0])
    assert imported <= ALLOWED | STANDARD
