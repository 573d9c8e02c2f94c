"""What a workspace's files may do: nothing that its user has not allowed by name, at its place."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from irtwin.errors import InputError
from irtwin.resources import resources_of
from irtwin.trust import trust, trusted, withdraw
from tests.data_sets import irtwin


@pytest.fixture(autouse=True)
def config(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    return tmp_path / "config" / "irtwin" / "trust.json"


@pytest.fixture
def workspace(tmp_path: Path) -> Path:
    (tmp_path / "workspace" / "questions").mkdir(parents=True)
    (tmp_path / "workspace" / "questions" / "mine.rq").write_text("")
    return tmp_path / "workspace"


def test_what_is_allowed_is_remembered_by_name_and_place(workspace: Path, config: Path) -> None:
    assert trusted(workspace) == frozenset()
    assert not config.exists()
    trust(workspace, ["rules/a_rules.ttl"])
    trust(workspace, ["rules/b_rules.ttl"])
    assert trusted(workspace) == {"rules/a_rules.ttl", "rules/b_rules.ttl"}
    assert trusted(workspace / "." / ".." / "workspace") == trusted(workspace)
    assert trusted(workspace.parent) == frozenset()
    withdraw(workspace)
    assert trusted(workspace) == frozenset()


def test_a_folder_made_anew_at_a_place_is_another(workspace: Path) -> None:
    trust(workspace, ["rules/a_rules.ttl"])
    moved = workspace.rename(workspace.with_name("moved"))
    workspace.mkdir()
    assert trusted(workspace) == trusted(moved) == frozenset()


@pytest.mark.parametrize("text", ["", "[]", "{", '{"a": 1}', "[" * 100_000, "\udcff"])
def test_a_damaged_list_is_told(workspace: Path, config: Path, text: str) -> None:
    config.parent.mkdir(parents=True)
    config.write_bytes(text.encode(errors="surrogateescape"))
    with pytest.raises(InputError, match="cannot be read; remove it, and trust your workspaces again"):
        trusted(workspace)


def test_a_command_lists_what_is_left_aside_until_it_is_allowed(workspace: Path) -> None:
    said = irtwin("query", "ASK {}", "--workspace", workspace)
    assert f"left aside, as nobody trusts it: questions/mine.rq; `irtwin workspace trust {workspace}` lists" in said.err
    assert [file.asked for file in resources_of(workspace).left_aside] == ["questions/mine.rq"]
    (workspace / "alarms.toml").write_text('[[mqtt]]\nhost = "a.example"\ntopic = "t"\n')
    allowed = irtwin("workspace", "trust", workspace)
    assert allowed.out.splitlines() == [
        "questions/mine.rq",
        "alarms.toml: mqtt at a.example:1883, topic t",
        f"{workspace}: allowed",
    ]
    assert "left aside" not in irtwin("query", "ASK {}", "--workspace", workspace).err
    (workspace / "questions" / "later.rq").write_text("")
    assert "nobody trusts it: questions/later.rq" in irtwin("query", "ASK {}", "--workspace", workspace).err
    assert irtwin("workspace", "trust", workspace, "--withdraw").out == f"{workspace}: nothing is allowed\n"
    assert len(resources_of(workspace).left_aside) == 2


def test_a_workspace_that_asks_for_nothing(tmp_path: Path, config: Path) -> None:
    assert irtwin("workspace", "trust", tmp_path).out == f"{tmp_path}: asks for nothing\n"
    assert not config.exists()
    assert irtwin("workspace", "trust", tmp_path / "none").status == 2


def test_a_copy_of_a_workspace_is_asked_for_anew(workspace: Path, tmp_path: Path) -> None:
    irtwin("workspace", "trust", workspace)
    shutil.copytree(workspace, tmp_path / "copy")
    assert len(resources_of(tmp_path / "copy").left_aside) == 1


def test_the_list_names_places_and_holds_no_secret(workspace: Path, config: Path) -> None:
    (workspace / "alarms.toml").write_text('[[mqtt]]\nhost = "a.example"\ntopic = "t"\n')
    irtwin("workspace", "trust", workspace)
    given = json.loads(config.read_text())
    assert list(given) == [str(workspace.resolve())]
    assert "secret" not in config.read_text()
