"""The base of individuals: what it may be, where it is said, and that it stays."""

from __future__ import annotations

from pathlib import Path

import pytest
from starlette.routing import Route
from tests.rows import data_set

from irtwin.errors import InputError
from irtwin.knowledge.vocabulary import ID
from irtwin.location import Location
from irtwin.serve.pool import Limits
from irtwin.serve.server import application
from irtwin.storage import base_iri
from irtwin.storage.database import Workspace

PLANT = "https://plant.example/energy/"


@pytest.mark.parametrize("base", [PLANT, ID, f"{ID}hall_1/", "http://127.0.0.1:7878/käfer/"])
def test_a_base(base: str) -> None:
    assert base_iri.checked(base, "x") == base


@pytest.mark.parametrize(
    ("base", "message"),
    [
        (5, "x: base_iri is an IRI, as https://plant.example/energy/, not 5"),
        ("https://plant.example/a b/", "is an IRI"),
        ("https://plant.example/energy/#", "is an IRI"),
        ("https://[plant/energy/", "cannot be read"),
        ("plant.example/energy/", "begins with http:// or https://"),
        ("urn:plant:energy/", "begins with http:// or https://"),
        ("https://plant.example/energy", "ends with /"),
        ("https://plant.example/", "names a host and a path"),
        ("https://plant.example//energy/", "has an empty part"),
        ("https://plant.example/../energy/", "has an empty part or dots"),
        ("https://plant.example/robot/", "`irtwin serve` has pages of its own at /robot"),
        ("https://w3id.org/irtwin/", "pages of its own at /irtwin"),
    ],
)
def test_what_no_individual_can_lie_below(base: object, message: str) -> None:
    with pytest.raises(InputError, match=message):
        base_iri.checked(base, "x")


def test_no_individual_lies_at_a_path_that_serve_has_for_itself(tmp_path: Path) -> None:
    routes = application(Location(tmp_path), "localhost", token=None, limits=Limits()).routes
    paths = {route.path.split("{")[0].split("/")[1] for route in routes if isinstance(route, Route)}
    assert paths - {""} == set(base_iri.SERVED)


def test_it_may_stand_in_a_file(tmp_path: Path) -> None:
    (tmp_path / "plant.toml").write_text(f'base_iri = "{PLANT}"\n', encoding="utf-8")
    with Workspace(tmp_path) as place:
        assert place.base == PLANT
    with pytest.raises(InputError, match=r"plant.toml: says base_iri = .* say the same or leave one out"):
        Workspace(tmp_path, base=ID)


def test_it_may_change_until_a_robot_is_there_and_is_kept(tmp_path: Path, database_url: str | None) -> None:
    with Workspace(tmp_path, database_url) as place:
        assert place.base == ID
    with Workspace(tmp_path, database_url, base=PLANT) as place:
        place.ingest(*data_set())
    for base in (ID, "https://plant.example/other/"):
        with pytest.raises(InputError, match=f"lie below {PLANT}.* cannot move to {base}"):
            Workspace(tmp_path, database_url, base=base)
    for said in (None, PLANT):
        with Workspace(tmp_path, database_url, base=said) as place:
            assert place.base == PLANT


def test_a_file_that_cannot_be_used_is_said(tmp_path: Path) -> None:
    (tmp_path / "plant.toml").write_text('base_iri = "energy"\n', encoding="utf-8")
    with pytest.raises(InputError, match=r"plant.toml: base_iri begins with http"):
        Workspace(tmp_path)
