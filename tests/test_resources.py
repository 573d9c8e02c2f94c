"""Files that ship, and those of a workspace that extend or replace them."""

from __future__ import annotations

from pathlib import Path

import pytest

from irtwin import resources
from irtwin.errors import InputError
from irtwin.resources import KINDS, resources_of, shipped
from tests.trusting import trust_all


def put(folder: Path, *names: str) -> None:
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).touch()


def test_every_kind_ships_something() -> None:
    assert all(shipped().of(kind) for kind in KINDS)
    assert not any(file.is_extension for file in shipped().files)
    assert [file.name for file in shipped().of("shapes")] == ["shapes.ttl"]


def test_a_file_of_the_same_name_replaces_and_any_other_is_added(tmp_path: Path) -> None:
    names = ["shapes/shapes.ttl", "questions/mine.rq", "reports/energy/mine.rq"]
    put(tmp_path, *names)
    aside = resources_of(tmp_path)
    assert aside.files == resources_of().files
    assert [file.asked for file in aside.left_aside] == names
    found = resources_of(trust_all(tmp_path))
    assert not found.left_aside
    assert {str(file): file.replaces for file in found.extensions} == {
        f"{name} of workspace": name == "shapes/shapes.ttl" for name in names
    }
    assert found.path("shapes", "shapes.ttl") == tmp_path / "shapes" / "shapes.ttl"
    assert len(found.of("questions")) == len(shipped().of("questions")) + 1


def test_pages_and_what_editors_leave_are_no_extensions(tmp_path: Path) -> None:
    put(tmp_path, "reports/KR6.html", "ontology/catalog-v001.xml")
    put(tmp_path / "rules", ".x.swp", "a_rules.ttl~", "README.md")
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
    put(tmp_path, name)
    with pytest.raises(InputError, match=said):
        resources_of(tmp_path)


def test_a_file_elsewhere_or_too_large_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    put(tmp_path, "outside.ttl", "place/ontology/a.ttl")
    place, file = tmp_path / "place", tmp_path / "place/ontology/a.ttl"
    for target in ("../../outside.ttl", "a.ttl"):
        file.unlink()
        file.symlink_to(target)
        with pytest.raises(InputError, match="leads outside"):
            resources_of(place)
    file.unlink()
    file.write_text("# more than four")
    for bound, most, said in (("MOST_BYTES", 4, "is larger than"), ("MOST_FILES", 0, "has more than 0 files")):
        with monkeypatch.context() as patch, pytest.raises(InputError, match=said):
            patch.setattr(resources, bound, most)
            resources_of(place)
