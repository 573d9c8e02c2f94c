"""What any test may ask for: a private PostgreSQL server, a browser, a machine without Java."""

from __future__ import annotations

import fcntl
import gc
import itertools
import os
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings
from sqlalchemy import NullPool, create_engine, text

_CHROMIUM = (
    "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--enable-unsafe-swiftshader",
    "--disable-gpu",  # a card that is played takes longer for pages; pictures in 3-D are drawn without
)  # fmt: skip

# Many tests start irtwin anew: its modules are compiled once, even where the machine asks for no compiled files.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

MadeOnce = Callable[[str, Callable[[Path], object]], Path]

settings.register_profile("untimed", deadline=None)  # speed is measured in bench/
settings.load_profile("untimed")


@pytest.fixture(scope="session", autouse=True)
def own_settings(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Keep the word of tests' users in a folder of the tests."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CONFIG_HOME", str(tmp_path_factory.mktemp("config")))
        yield


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with the modules of most tests that take long: else one that began late is what all processes wait for."""
    long = Counter(item.path for item in items if {"slow", "system"} & {mark.name for mark in item.iter_markers()})
    items.sort(key=lambda item: -long[item.path])


def pytest_sessionstart() -> None:
    """Look for no garbage while tests are read."""
    gc.disable()


def pytest_collection_finish() -> None:
    """Look for garbage more seldom, and not in what was read with the tests: it is a tenth of the time."""
    gc.freeze()
    gc.enable()
    gc.set_threshold(20_000, 10, 10)


@pytest.fixture(scope="session")
def made_once(tmp_path_factory: pytest.TempPathFactory) -> MadeOnce:
    """Give a function that has a folder filled, and returns it: one process does so for all. Who writes, copies."""
    base = tmp_path_factory.getbasetemp()
    shared = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base

    def made(name: str, fill: Callable[[Path], object]) -> Path:
        with (shared / f"{name}.lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not (shared / name).exists():
                folder = Path(tempfile.mkdtemp(dir=base))
                fill(folder)
                folder.rename(shared / name)
        return shared / name

    return made


@pytest.fixture(scope="session")
def small_run(made_once: MadeOnce) -> Path:
    """The `data` of a robot "Arm" and the `workspace` that `irtwin run` made of it, in a folder; who writes, copies."""

    def fill(folder: Path) -> None:
        from tests.data_sets import irtwin  # which brings physics: few tests need it
        from tests.small_robots import data_set

        done = irtwin("run", data_set(folder / "data", "Arm"), "--workspace", folder / "workspace")
        assert done.status == 0, done.err

    return made_once("small_run", fill)


@pytest.fixture(scope="session")
def plant_place(made_once: MadeOnce) -> Path:
    """The workspace of `tests/plants.py`, with a tariff, concluded; who writes, copies."""

    def fill(folder: Path) -> None:
        from tests.plants import make_plant

        make_plant(folder)

    return made_once("plant", fill)


@pytest.fixture(scope="session")
def guide(made_once: MadeOnce) -> Path:
    """The guide, where `make guide` has it, so that a wheel built then holds it."""
    root = Path(__file__).parents[1]

    def build(folder: Path) -> None:
        command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet"]
        environment = os.environ | {"NO_MKDOCS_2_WARNING": "1"}
        built = subprocess.run(command, cwd=root, env=environment, capture_output=True, text=True, check=False)
        assert built.returncode == 0, built.stderr

    made_once("guide", build)
    return root / "build" / "guide"


def _server_programs() -> Path | None:
    found = sorted(Path("/usr/lib/postgresql").glob("*/bin/pg_ctl"))
    path = shutil.which("pg_ctl")
    return found[-1].parent if found else Path(path).parent if path else None


@pytest.fixture(autouse=True)
def keep_the_network(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave this process its sockets: a command that is run within it would take them for good."""
    monkeypatch.setattr("irtwin.knowledge.store.no_network.leave_network", lambda: True)


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """Headless Chromium, which asks nothing of the network by itself and draws in 3-D without a graphics card."""
    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    if chromium is None:
        pytest.skip("no Chromium on this machine")
    playwright = pytest.importorskip("playwright.sync_api")
    with playwright.sync_playwright() as session:
        started = session.chromium.launch(executable_path=chromium, args=_CHROMIUM)
        yield started
        started.close()


@pytest.fixture(params=["sqlite", pytest.param("postgresql", marks=pytest.mark.system)])
def database_url(request: pytest.FixtureRequest) -> str | None:
    """Where a workspace has its rows: None, for a file that it makes itself, or an empty PostgreSQL database."""
    return None if request.param == "sqlite" else request.getfixturevalue("new_postgresql_database")()


@pytest.fixture(scope="session")
def new_postgresql_database() -> Iterator[Callable[[], str]]:
    """Give a function that returns the URL of an empty database: a schema, for a database is 300 files to write."""
    programs = _server_programs()
    if programs is None:
        pytest.skip("no PostgreSQL server on this machine")
    # PostgreSQL refuses to run as root. Its socket's path must be short, and its own.
    as_server = ["runuser", "-u", "postgres", "--"] if os.geteuid() == 0 else []
    folder = Path(tempfile.mkdtemp(prefix="pg", dir="/tmp"))
    if as_server:
        shutil.chown(folder, "postgres")
    data, log = str(folder / "data"), str(folder / "log")

    def call(program: str, *arguments: str) -> None:
        subprocess.run(
            [*as_server, str(programs / program), *arguments],
            check=True,
            stdout=subprocess.DEVNULL,
            cwd="/",
        )

    call("initdb", "-D", data, "-A", "trust", "-U", "postgres", "-E", "UTF8", "--no-sync")
    call("pg_ctl", "-D", data, "-l", log, "-w", "-o", f"-k {folder} -c listen_addresses='' -c fsync=off", "start")
    numbers = itertools.count()
    url = f"postgresql+psycopg://postgres@/postgres?host={folder}"
    server = create_engine(url, isolation_level="AUTOCOMMIT", poolclass=NullPool)  # tests end connections

    def make() -> str:
        name = f"test_{next(numbers)}"
        with server.connect() as connection:
            connection.execute(text(f"CREATE SCHEMA {name}"))
        return f"postgresql+psycopg://postgres@/postgres?host={folder}&options=-csearch_path%3D{name}"

    try:
        yield make
    finally:
        server.dispose()
        call("pg_ctl", "-D", data, "-m", "immediate", "stop")
        shutil.rmtree(folder)
