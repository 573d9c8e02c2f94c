"""Processes that write rows and graph of one workspace at once, and one that is killed in the middle."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from sqlalchemy import text
from tests import rows
from tests.forks import FORKS
from tests.turn_takers import NAMES, hold, taken_in

from irtwin.errors import InputError
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_SOURCE
from irtwin.rewriting import map_rows, rewriting
from irtwin.storage import engine, turns
from irtwin.storage.database import Workspace
from irtwin.storage.schema import Base

pytestmark = pytest.mark.slow


def forked(work: Callable[..., None], *arguments: object) -> multiprocessing.process.BaseProcess:
    process = FORKS.Process(target=work, args=arguments)
    process.start()
    return process


def test_several_at_once_lose_nothing(tmp_path: Path, database_url: str | None) -> None:
    for process in [forked(taken_in, tmp_path, database_url, name) for name in NAMES]:
        process.join(100)
        assert process.exitcode == 0
    with Workspace(tmp_path, database_url) as place, KnowledgeGraph(place.graph_folder) as graph:
        found = graph.triples(GRAPH_SOURCE)
        for robot_id in (*NAMES, "shared"):
            assert place.read_series(f"{robot_id}.work").num_rows == rows.samples(1).num_rows
        named = {file.name for file in (tmp_path / "series").iterdir()}
        assert len(named) == 2  # what both wrote of their own robots is one and the same file, and the last's
        with KnowledgeGraph(workspace=tmp_path, base=place.base) as anew:
            place.mapped_rows.unlink()
            map_rows(place, anew)
            assert {str(one) for one in found if "version" not in str(one)} == {
                str(one) for one in anew.triples(GRAPH_SOURCE) if "version" not in str(one)
            }


@pytest.fixture
def held(tmp_path: Path, database_url: str | None) -> Iterator[multiprocessing.process.BaseProcess]:
    with Workspace(tmp_path, database_url) as place, rewriting(place) as graph:
        place.ingest(*rows.data_set())
        map_rows(place, graph)
    reading, ready = FORKS.Pipe(duplex=False)
    process = forked(hold, tmp_path, database_url, ready)
    assert reading.poll(60)
    yield process
    process.kill()
    process.join()


def test_one_that_waits_too_long_says_so_and_one_that_was_killed_holds_nothing(
    tmp_path: Path, database_url: str | None, held: multiprocessing.process.BaseProcess, monkeypatch: pytest.MonkeyPatch
) -> None:
    with Workspace(tmp_path, database_url) as place:
        monkeypatch.setattr(engine, "BUSY_TIMEOUT", 0.2)
        if database_url is None:
            place.engine.dispose()  # SQLite waits as long as it was told when the connection was made
            place.engine = engine.open_engine(place.engine.url)
        with pytest.raises(InputError, match=r"another process has been writing for 0\.2 s"):
            place.ingest(*rows.data_set())
        with (
            pytest.raises(InputError, match=r"rewriting the graph for 0\.2 s; try again later"),
            rewriting(place),
        ):
            pass
        held.kill()
        held.join()
        monkeypatch.setattr(engine, "BUSY_TIMEOUT", 20.0)
        with rewriting(place) as graph:
            map_rows(place, graph)
        assert place.ingest(*rows.data_set()) == "unchanged"


def test_the_turn_is_given_back(tmp_path: Path, database_url: str | None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engine, "BUSY_TIMEOUT", 0.1)
    with Workspace(tmp_path, database_url) as place:
        for _ in range(2):
            with turns.rewriting_alone(place.engine, place.folder):
                pass


def test_a_folder_that_cannot_be_written_is_said(tmp_path: Path) -> None:
    with Workspace(tmp_path / "place") as place:
        (tmp_path / "place/.graph.turn").mkdir()
        cannot = pytest.raises(InputError, match="place: cannot be written")
        with cannot, turns.rewriting_alone(place.engine, place.folder):
            pass


@pytest.mark.system
def test_what_those_who_run_the_server_can_mend_is_one_line(
    new_postgresql_database: Callable[[], str], tmp_path: Path
) -> None:
    url = new_postgresql_database()
    place = engine.open_engine(url)
    with engine.writing(place) as session:
        session.execute(text("CREATE ROLE visitor LOGIN PASSWORD 'do-not-tell'"))
        session.execute(text(f"GRANT USAGE ON SCHEMA {session.scalar(text('SELECT current_schema()'))} TO visitor"))
    guest = url.replace("postgres@", "visitor:do-not-tell@")
    with pytest.raises(InputError, match=r"visitor:\*\*\*@.*this user may not do that") as caught:
        Workspace(tmp_path / "guest", guest)
    assert "do-not-tell" not in str(caught.value)
    robots = Base.metadata.tables["robot"].select()
    end_all = text(
        "SELECT pg_terminate_backend(pid) FROM pg_stat_activity "
        "WHERE pid <> pg_backend_pid() AND datname = current_database()"
    )
    with Workspace(tmp_path / "own", url) as own, own.reading() as session:
        session.execute(robots)
        with place.connect() as other:
            other.execute(end_all)
        with pytest.raises(InputError, match="connection to the database was lost; do it again"):
            session.execute(robots)


def test_a_pipe_in_place_of_the_turn_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / ".graph.turn")
    assert not turns.is_rewritten(tmp_path)
    with (
        Workspace(tmp_path) as place,
        pytest.raises(InputError, match="cannot be written"),
        turns.rewriting_alone(place.engine, tmp_path),
    ):
        pass
