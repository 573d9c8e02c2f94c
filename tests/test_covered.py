"""Each module has a test file of its name in the room of its name, or a line in COVERED_BY.toml that says where."""

from __future__ import annotations

import ast
import tomllib
from collections.abc import Iterator
from functools import cache
from importlib.metadata import entry_points
from pathlib import Path

TESTS = Path(__file__).parent
SOURCE = TESTS.parent / "src"
COVERED_BY = tomllib.loads((TESTS / "COVERED_BY.toml").read_text(encoding="utf-8"))


def has_code(file: Path) -> bool:
    if file.name != "__init__.py":
        return True
    return any(not isinstance(part, ast.Expr) for part in ast.parse(file.read_text(encoding="utf-8")).body)


@cache
def modules() -> dict[str, Path]:
    """The modules of irtwin that have code, by their names without `irtwin.`."""
    files = {
        ".".join(file.relative_to(SOURCE / "irtwin").with_suffix("").parts): file
        for file in sorted((SOURCE / "irtwin").rglob("*.py"))
    }
    return {name: file for name, file in files.items() if has_code(file)}


PROVIDERS = [entry.module.removeprefix("irtwin.") for entry in entry_points(group="irtwin.providers")]


def own_test(name: str) -> Path:
    """Where the test file of a module's name would be: in the folder of its outermost room."""
    *rooms, last = name.split(".")
    return TESTS.joinpath(*rooms[:1], f"test_{last}.py")


def statements(block: list[ast.stmt]) -> Iterator[ast.stmt]:
    """Yield the statements of a block, those within others too."""
    for part in block:
        yield part
        for name in ("body", "orelse", "finalbody", "handlers", "cases"):
            yield from statements(getattr(part, name, []))


@cache
def imported(file: Path) -> frozenset[str]:
    """Return the modules of irtwin that a file imports anywhere, those of helpers too, and what a command runs."""
    text = file.read_text(encoding="utf-8")
    found = {"cli.__init__", "__main__"} if '"-m", "irtwin"' in text else set()
    found |= {"fleet.__main__"} if '"-m", "irtwin.fleet"' in text else set()
    for part in statements(ast.parse(text).body):
        names = []
        if isinstance(part, ast.ImportFrom) and part.module:
            names = [part.module, *(f"{part.module}.{one.name}" for one in part.names)]
        elif isinstance(part, ast.Import):
            names = [one.name for one in part.names]
        for name in names:
            place = TESTS.parent.joinpath(*name.split(".")).with_suffix(".py")
            if name.split(".")[0] == "irtwin":
                found |= {name.removeprefix("irtwin."), f"{name}.__init__".removeprefix("irtwin.")}
            elif name.startswith("tests.") and place.is_file():
                found |= imported(place)
    return frozenset(found & modules().keys())


def reached(file: Path) -> set[str]:
    """Return the modules that a test file imports, and those that these import."""
    fixtures = [place / "conftest.py" for place in (TESTS, file.parent) if (place / "conftest.py").is_file()]
    todo = [name for one in (file, *fixtures) for name in imported(one)]
    found: set[str] = set()
    while todo:
        name = todo.pop()
        if name not in found:
            found.add(name)
            todo += [*imported(modules()[name]), *(PROVIDERS if name == "providers.planner" else ())]
    return found


def fault(name: str) -> str | None:
    """What is wrong with where a module is tested."""
    if own_test(name).is_file():
        return f"{own_test(name)} is there: take the line out of COVERED_BY.toml" if name in COVERED_BY else None
    if name not in COVERED_BY:
        return f"write {own_test(name)}, or say in COVERED_BY.toml which test holds it"
    file = TESTS / f"{COVERED_BY[name]}.py"
    return None if file.is_file() and name in reached(file) else f"{file} does not come to it"


def test_each_module_has_its_test() -> None:
    assert {name: said for name in modules() if (said := fault(name))} == {}


def test_no_line_is_of_a_module_that_is_gone() -> None:
    assert COVERED_BY.keys() - modules().keys() == set()
