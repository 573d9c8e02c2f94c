"""`irtwin docs` opens the guide, or says how a checkout builds it. Pages that it writes are tried in tests/report."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.data_sets import irtwin

from irtwin import resources
from irtwin.cli import docs


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A package that is in no wheel, and has no guide yet."""
    package = tmp_path / "src" / "irtwin"
    monkeypatch.setattr(resources, "_PACKAGE", package)
    return package


@pytest.mark.parametrize("place", ["src/irtwin/guide", "build/guide"])
def test_the_guide_is_opened_and_its_place_told(
    package: Path, place: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown: list[Path] = []
    monkeypatch.setattr(docs, "show_page", shown.append)
    page = tmp_path / place / "index.html"
    page.parent.mkdir(parents=True)
    page.touch()
    assert [irtwin("docs").out, irtwin("docs", "--no-open").out] == [f"{page}\n"] * 2
    assert shown == [page]


def test_a_checkout_without_a_guide_says_how_to_build_it(package: Path) -> None:
    done = irtwin("docs")
    assert (done.status, "`make guide` builds the guide" in done.err) == (2, True)
