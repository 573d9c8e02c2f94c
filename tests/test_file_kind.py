"""What a file is to irtwin, and the commands that take it."""

from __future__ import annotations

from pathlib import Path

import pytest

from irtwin.errors import InputError
from irtwin.file_kind import file_kind
from tests.data_sets import irtwin

DATA_SET = '[robot]\nname = "Arm"\n[[run]]\nfile = "a.csv"\nrole = "reference"\n[[run]]\nfile = "b.csv"\n'


@pytest.mark.parametrize(
    ("name", "content", "what", "command"),
    [
        ("log.CSV", "time,q", "a log", "irtwin import "),
        ("log.csv", "t,power,q_1", "a log", "irtwin import "),
        ("meter.csv", "Zeit;Wirkleistung [kW]", "a meter's log: power or energy, and no joint", "irtwin import "),
        ("meter.csv", "time,energy_kWh", "a meter's log: power or energy, and no joint", "irtwin import "),
        ("arm.urdf", "<robot/>", "a robot's description", "irtwin import LOG --robot "),
        ("arm.xml", "<robot/>", "a robot's description", "irtwin import LOG --robot "),
        ("model.xml", "<!-- x --><mujoco/>", "a model of MuJoCo", "irtwin diagnose DATASET --simulator "),
        ("twin.json", "{}", "a twin, if `--save-twin` wrote it", "irtwin predict "),
        ("kept.zip", "", "an archive, if `irtwin workspace backup` wrote it", "irtwin workspace restore "),
        ("robot.ttl", "", "a graph", "irtwin workspace reason "),
        ("set/dataset.toml", DATA_SET, "a data set of Arm, 2 runs (1 reference, 1 observed)", "irtwin check "),
        ("set/dataset.toml", "run = 1", "a data set of a robot, 0 runs", "irtwin check "),
        ("set/irtwin.db", "", "a workspace", "irtwin workspace status --workspace "),
        ("set/monday.bag", "", "a folder with 1 log", "irtwin import "),
        ("set/kr6/dataset.toml", "", "a folder with 1 data set", "irtwin run "),
    ],
)
def test_each_kind_is_told_with_what_takes_it(tmp_path: Path, name: str, content: str, what: str, command: str) -> None:
    file = tmp_path / name
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(content)
    kind = file_kind(tmp_path / Path(name).parts[0])
    assert kind.what == what
    first, _ = kind.commands[0]
    assert first.startswith(command)
    assert str(tmp_path) in first


def test_what_it_does_not_take_is_told(tmp_path: Path) -> None:
    (tmp_path / "letter.doc").touch()
    with pytest.raises(InputError, match=r"letter\.doc: neither a data set, .* `irtwin --help` lists"):
        file_kind(tmp_path / "letter.doc")
    with pytest.raises(InputError, match="a folder without dataset"):
        file_kind(tmp_path)


def test_a_file_stands_in_a_commands_place(tmp_path: Path) -> None:
    (tmp_path / "my log.csv").touch()
    said = irtwin(tmp_path / "my log.csv")
    assert said.status == 0
    assert f"irtwin import '{tmp_path}/my log.csv' --robot ROBOT.urdf --out FOLDER" in said.out
    assert irtwin(tmp_path / "none.csv").status == 2
