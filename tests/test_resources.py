"""Files that ship, and those of a workspace that extend or replace them."""

from __future__ import annotations

from pathlib import Path

import pytest

from irtwin import resources
from irtwin.errors import InputError
from irtwin.resources import KINDS, resources_of, shipped
from tests.trusting import trust_all


def test_every_kind_ships_something() -> None:
    assert all(shipped().of(kind) for kind in KINDS)
    assert not any(file.is_extension for file in shipped().files)
    assert [file.name for file in shipped().of("shapes")] == ["shapes.ttl"]


def test_a_file_of_the_same_name_replaces_and_any_other_is_added(tmp_path: Path) -> None:
    for name in ("shapes/shapes.ttl", "questions/mine.rq", "reports/energy/mine.rq"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("")
    aside = resources_of(tmp_path)
    assert aside.files == resources_of().files
    assert [file.asked for file in aside.left_aside] == [
        "shapes/shapes.ttl",
        "questions/mine.rq",
        "reports/energy/mine.rq",
    ]
    found = resources_of(trust_all(tmp_path))
    assert not found.left_aside
    assert {str(file): file.replaces for file in found.extensions} == {
        "shapes/shapes.ttl of workspace": True,
        "questions/mine.rq of workspace": False,
        "reports/energy/mine.rq of workspace": False,
    }
    assert found.path("shapes", "shapes.ttl") == tmp_path / "shapes" / "shapes.ttl"
    assert len(found.of("questions")) == len(shipped().of("questions")) + 1


def test_pages_and_what_editors_leave_are_no_extensions(tmp_path: Path) -> None:
    for name in (
        "reports/KR6.html",
        "rules/.x.swp",
        "rules/a_rules.ttl~",
        "ontology/catalog-v001.xml",
        "rules/README.md",
    ):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("")
    assert resources_of(tmp_path) == resources_of()


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("rules/mine.ttl", "rules/ takes files called NAMErules.ttl or NAME.swrl.ttl"),
        ("rules/owl2_rl.rq", "rules/ takes files"),
        ("ontology/mine.owl", "ontology/ takes files called NAME.ttl"),
        ("questions/a b.rq", "questions/ takes files"),
        ("reports/energy/mine.js", "reports/ takes files"),
    ],
)
def test_a_file_that_no_folder_takes_is_refused(name: str, said: str, tmp_path: Path) -> None:
    (tmp_path / name).parent.mkdir(parents=True)
    (tmp_path / name).write_text("")
    with pytest.raises(InputError, match=said):
        resources_of(tmp_path)


def test_a_file_elsewhere_or_too_large_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    place = tmp_path / "place"
    (place / "ontology").mkdir(parents=True)
    (tmp_path / "outside.ttl").write_text("")
    (place / "ontology" / "a.ttl").symlink_to(tmp_path / "outside.ttl")
    with pytest.raises(InputError, match="leads outside"):
        resources_of(place)
    (place / "ontology" / "a.ttl").unlink()
    (place / "ontology" / "a.ttl").symlink_to("a.ttl")
    with pytest.raises(InputError, match="leads outside"):
        resources_of(place)
    (place / "ontology" / "a.ttl").unlink()
    (place / "ontology" / "a.ttl").write_text("# more than four")
    monkeypatch.setattr(resources, "MOST_BYTES", 4)
    with pytest.raises(InputError, match="is larger than"):
        resources_of(place)
    monkeypatch.setattr(resources, "MOST_BYTES", 400)
    monkeypatch.setattr(resources, "MOST_FILES", 0)
    with pytest.raises(InputError, match="has more than 0 files"):
        resources_of(place)
