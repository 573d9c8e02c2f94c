"""A workspace whose series are in object storage."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from tests import rows
from tests.memory_s3 import MemoryS3, memory_s3
from tests.storage.test_database import WORK, populate
from tests.trusting import trust_all

from irtwin.errors import InputError
from irtwin.knowledge.explain.explanation import Explanation
from irtwin.knowledge.explain.verify import CHANGED, MISSING, WHOLE, verify
from irtwin.storage import staging
from irtwin.storage.database import Workspace
from irtwin.storage.schema import Series
from irtwin.storage.series_place import FILE, check, choose, elsewhere
from irtwin.storage.staging import staged
from irtwin.storage.windows import open_series
from irtwin.trust import withdraw
from irtwin.upkeep import lost_files

pytestmark = pytest.mark.slow

URL = "s3://plant/Halle 1/Röbots"


@pytest.fixture
def objects(monkeypatch: pytest.MonkeyPatch) -> Iterator[MemoryS3]:
    with memory_s3(monkeypatch) as made:
        yield made


@pytest.fixture
def workspace(objects: MemoryS3, tmp_path: Path) -> Iterator[Workspace]:
    with Workspace(tmp_path / "workspace", series_url=URL) as opened:
        yield opened


@pytest.fixture(params=["sqlite", pytest.param("postgresql", marks=pytest.mark.system)])
def either(request: pytest.FixtureRequest, objects: MemoryS3, tmp_path: Path) -> Iterator[Workspace]:
    """A workspace as above, its rows in either database."""
    url = None if request.param == "sqlite" else request.getfixturevalue("new_postgresql_database")()
    with Workspace(tmp_path / "workspace", url, series_url=URL) as opened:
        yield opened


def named(place: Workspace) -> set[str]:
    with place.reading() as session:
        return {row.path for row in session.query(Series)}


def stored(objects: MemoryS3, url: str = URL) -> set[str]:
    root = url.removeprefix("s3://")
    return {path.removeprefix(f"{root}/") for path in objects.find(f"{root}/series")}


def test_series_are_objects_and_no_files(workspace: Workspace, objects: MemoryS3) -> None:
    populate(workspace)
    assert stored(objects) == named(workspace) != set()
    assert not (workspace.folder / "series").exists()
    assert workspace.read_series(WORK).equals(rows.samples(1))
    assert workspace.read_series(WORK, columns=["power"]).column_names == ["power"]
    assert not lost_files(workspace)


def test_the_place_is_remembered(workspace: Workspace, objects: MemoryS3) -> None:
    populate(workspace)
    with Workspace.existing(workspace.folder) as again:
        assert again.read_series(WORK).equals(rows.samples(1))
    Workspace(workspace.folder, series_url=f"{URL}/").close()
    with pytest.raises(InputError, match=r"its series are in s3://plant/Halle 1/Röbots, not in s3://plant/other"):
        Workspace(workspace.folder, series_url="s3://plant/other")


def test_series_of_a_folder_stay_there(objects: MemoryS3, tmp_path: Path) -> None:
    with Workspace(tmp_path) as place:
        populate(place)
    with pytest.raises(InputError, match="its series are in its folder already; `irtwin workspace backup FILE`, then"):
        Workspace(tmp_path, series_url=URL)
    assert not objects.store


def test_two_workspaces_do_not_share_a_prefix(objects: MemoryS3, tmp_path: Path) -> None:
    for name in ("one", "other"):
        (tmp_path / name).mkdir()
    choose(tmp_path / "one", URL, has_series=False)
    with pytest.raises(InputError, match="holds the series of another workspace"):
        choose(tmp_path / "other", URL, has_series=False)
    assert not (tmp_path / "other" / FILE).exists()


def test_a_prefix_that_became_anothers_is_said(objects: MemoryS3, tmp_path: Path) -> None:
    choose(tmp_path, URL, has_series=False)
    check(tmp_path)
    objects.pipe_file(f"{URL}/irtwin-workspace", b"another")
    with pytest.raises(InputError, match="holds the series of another workspace"):
        check(tmp_path)


@pytest.mark.parametrize("text", ["url = ", 'url = "s3://plant"', 'url = "/etc"\nworkspace = "x"'])
def test_a_damaged_setting_is_said(objects: MemoryS3, tmp_path: Path, text: str) -> None:
    (tmp_path / FILE).write_text(text)
    with pytest.raises(InputError, match=r"series\.toml: damaged"):
        elsewhere(tmp_path)


def test_a_lost_database_is_not_begun_anew(workspace: Workspace) -> None:
    (workspace.folder / "irtwin.db").unlink()
    with pytest.raises(InputError, match=r"irtwin\.db is missing, though series\.toml names series"):
        Workspace(workspace.folder)


def test_a_robot_is_worked_on_apart(workspace: Workspace, objects: MemoryS3, monkeypatch: pytest.MonkeyPatch) -> None:
    with staged(workspace, rows.ROBOT) as apart:
        populate(apart)
        assert not stored(objects)
        assert (apart.folder / "series").is_dir()
    assert stored(objects) == named(workspace)
    puts: list[object] = []
    monkeypatch.setattr(objects, "put", lambda *files, **_: puts.append(files))
    with staged(workspace, rows.ROBOT) as apart:
        assert apart.read_series(WORK).equals(rows.samples(1))
        assert apart.ingest(*rows.data_set()) == "unchanged"
    assert not puts


def test_what_was_written_before_a_crash_is_removed_with_the_next_change(
    either: Workspace, objects: MemoryS3, monkeypatch: pytest.MonkeyPatch
) -> None:
    def crash(*_: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as broken, pytest.raises(KeyboardInterrupt):  # noqa: SIM117
        with staged(either, rows.ROBOT) as apart:
            populate(apart)
            broken.setattr(staging, "insert_values", crash)
    assert stored(objects)
    assert not named(either)
    either.remove_orphans()
    assert not stored(objects)


def test_a_damaged_object_is_found_and_mended(workspace: Workspace, objects: MemoryS3) -> None:
    workspace.ingest(*rows.data_set())
    with workspace.reading() as session:
        series = session.query(Series).filter_by(run_id=WORK).one()
    explained = Explanation("", "", file=series.path, checksum=series.series_id)
    assert [each.state for each in verify([explained], workspace.folder)] == [WHOLE]
    objects.pipe_file(f"{URL}/{series.path}", b"PAR1")
    (verdict,) = verify([explained], workspace.folder)
    assert (verdict.state, verdict.file) == (CHANGED, f"{URL}/{series.path}")
    assert lost_files(workspace) == [f"{series.path} of {rows.ROBOT} is missing or altered"]
    with pytest.raises(InputError, match=r"s3://plant/Halle 1/Röbots/series/\w+\.parquet: the series was altered"):
        workspace.read_series(WORK)
    objects.rm_file(f"{URL}/{series.path}")
    assert [each.state for each in verify([explained], workspace.folder)] == [MISSING]
    with pytest.raises(InputError, match="the series is missing"):
        workspace.read_series(WORK)
    with staged(workspace, rows.ROBOT) as apart:
        apart.ingest(*rows.data_set())
    assert workspace.read_series(WORK).equals(rows.samples(1))


def test_windows_are_read_from_objects(workspace: Workspace, objects: MemoryS3) -> None:
    workspace.ingest(*rows.data_set())
    with workspace.reading() as session:
        path = session.query(Series).filter_by(run_id=WORK).one().path
    power = rows.samples(1)["power"].to_pylist()
    assert open_series(workspace.folder, path).mean("power", 0.0, 1e9) == pytest.approx(sum(power) / len(power))
    with pytest.raises(InputError, match="the series is missing"):
        open_series(workspace.folder, "series/none.parquet")
    with pytest.raises(InputError, match="leads outside"):
        open_series(workspace.folder, "series/../../none.parquet")


def test_storage_that_a_workspace_from_elsewhere_names_is_not_opened(workspace: Workspace, objects: MemoryS3) -> None:
    populate(workspace)
    there = set(objects.find("plant"))
    withdraw(workspace.folder)
    with pytest.raises(
        InputError, match=r"series\.toml: names s3://plant/.*nothing is read from .* `irtwin workspace trust"
    ):
        workspace.remove_orphans()
    with pytest.raises(InputError, match="`irtwin workspace trust "):
        Workspace.existing(workspace.folder).read_series(f"{rows.ROBOT}.work")
    assert set(objects.find("plant")) == there
    trust_all(workspace.folder)
    assert workspace.read_series(f"{rows.ROBOT}.work").equals(rows.samples(1))
