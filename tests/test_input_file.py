"""Files that a user names: bounded, and text that is not UTF-8 is said in one line, wherever it is read."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from irtwin.alarms.follow import ToldAlarms
from irtwin.errors import InputError
from irtwin.fleet.fleet import find_data_sets
from irtwin.input_file import read_text
from irtwin.knowledge.questions.queries import read_question
from irtwin.knowledge.store.rdf_input import read_turtle
from irtwin.report import extensions
from irtwin.resources import resources_of
from irtwin.robot.urdf import read_urdf
from irtwin.ros.ros_package import write_package
from irtwin.serve.server import read_token
from irtwin.signals.log import read_data_set
from irtwin.storage import base_iri
from irtwin.storage.tariff import read_tariff
from irtwin.twin.files import load
from tests.data_sets import refused
from tests.synthetic import arm
from tests.trusting import trust_all

Reader = Callable[[Path], object]
LATIN = "# title: a\ntitle = é\n".encode("latin-1")


def of_workspace(file: Path) -> object:
    trust_all(file.parents[2])
    return extensions.check(resources_of(file.parents[2]))


READERS: dict[str, Reader] = {
    "data/dataset.toml": lambda file: read_data_set(file.parent),
    "plant.toml": lambda file: read_tariff(file.parent),
    "workspace/plant.toml": base_iri.said,
    "robot.urdf": read_urdf,
    "twin.json": load,
    "sets.txt": lambda file: find_data_sets(file),
    "token": read_token,
    "told.json": ToldAlarms,
    "package.xml": lambda file: write_package(arm(1), file.parent),
    "mine.rq": read_question,
    "reports/energy/mine.rq": of_workspace,
    "reports/energy/page.html.jinja": of_workspace,
    "reports/layout/style.css": of_workspace,
}


def put(file: Path, content: bytes) -> Path:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_bytes(content)
    return file


@pytest.mark.parametrize("name", READERS)
def test_text_that_is_not_utf8_is_said_with_line_and_byte(name: str, tmp_path: Path) -> None:
    file = put(tmp_path / name, LATIN)
    with pytest.raises(InputError) as refused:
        READERS[name](file)
    remedy = "name a twin that irtwin saved" if name == "twin.json" else "save it as UTF-8"
    assert str(refused.value) == f"{file}, line 2: not UTF-8 text (byte 9); {remedy}"


def test_a_module_of_the_ontology_is_said_by_its_parser(tmp_path: Path) -> None:
    file = put(tmp_path / "ontology/mine.ttl", b"<urn:a> <urn:b>\n <urn:c\xe9> .\n")
    with pytest.raises(InputError, match=r"mine\.ttl, line 2: .*[Ii]nvalid UTF-8"):
        list(read_turtle(file))


def test_a_command_ends_in_one_line(tmp_path: Path) -> None:
    file = put(tmp_path / "listed.txt", LATIN)
    assert f"{file}, line 2: not UTF-8 text" in refused("run", file, "--out", file.parent / "out")


def test_a_byte_order_mark_is_no_part_of_the_text(tmp_path: Path) -> None:
    assert read_text(put(tmp_path / "a", b"\xef\xbb\xbfa = 1"), 9) == "a = 1"


def test_what_is_too_large_or_no_file_is_not_read(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="larger than the 0 MB limit"):
        read_text(put(tmp_path / "a", b"12345"), 4)
    os.mkfifo(tmp_path / "pipe")
    for name, said in (("pipe", "is not a file"), (".", "is not a file"), ("none", "cannot be read")):
        with pytest.raises(InputError, match=said):
            read_text(tmp_path / name, 9)
