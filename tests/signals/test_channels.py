"""The table of channels: what follows from a line of it."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.synthetic import arm

import irtwin
from irtwin.robot.description import Robot
from irtwin.signals.channels import CHANNELS, REQUIRED, Signals, by_column, columns_of, from_columns

ROOT = Path(__file__).parents[2]
JOINTS = ("a", "b")


def test_no_two_channels_share_a_column_or_a_key() -> None:
    columns = [column for channel in CHANNELS.values() for column in channel.columns(JOINTS)]
    assert len(columns) == len(set(columns)) == len(by_column(JOINTS))
    keys = [channel.streamed for channel in CHANNELS.values() if channel.streamed]
    assert len(keys) == len(set(keys))


def test_nothing_else_names_columns() -> None:
    prefixes = "|".join(re.escape(channel.prefix) for channel in CHANNELS.values() if channel.per_joint)
    named = re.compile(rf"""f?["']({prefixes})_(["']|{{)""")
    package = Path(irtwin.__file__).parent
    found = [
        f"{file}: {line}"
        for file in package.rglob("*.py")
        for line in file.read_text().splitlines()
        if named.search(line)
    ]
    assert found == []


def test_columns_are_those_of_the_log_format() -> None:
    assert CHANNELS["torque"].columns(JOINTS) == ("tau_a", "tau_b")
    assert CHANNELS["meter_current"].columns(JOINTS) == ("current",)
    assert CHANNELS["current"].columns(JOINTS) == ("i_a", "i_b")


def test_a_joint_that_slides_has_units_of_its_own() -> None:
    robot: Robot = arm(2, slides=(1,))
    of = {name: [channel.unit_of(joint.kind) for joint in robot.joints] for name, channel in CHANNELS.items()}
    assert of["q"] == ["rad", "m"]
    assert of["torque"] == ["N m", "N"]
    assert of["temperature"] == ["degC", "degC"]


@given(logged=st.sets(st.sampled_from([name for name in CHANNELS if name not in REQUIRED])), seed=st.integers(0, 99))
def test_signals_come_back_from_their_columns(logged: set[str], seed: int) -> None:
    rng = np.random.default_rng(seed)
    shapes = {name: (30, 2) if channel.per_joint else (30,) for name, channel in CHANNELS.items()}
    signals = Signals(**{name: rng.normal(size=shapes[name]) for name in (*REQUIRED, *logged)})
    columns = columns_of(signals, JOINTS)
    again = from_columns(columns, JOINTS)
    assert set(again.logged()) == {*REQUIRED, *logged}
    assert all(np.array_equal(getattr(again, name), values) for name, values in signals.logged().items())
    assert [*columns] == [name for name in by_column(JOINTS) if name in columns]


def test_a_channel_of_some_joints_is_refused() -> None:
    with pytest.raises(KeyError, match="tau_b"):
        from_columns({"time": np.arange(3.0), "q_a": np.zeros(3), "q_b": np.zeros(3), "tau_a": np.zeros(3)}, JOINTS)


@pytest.mark.slow
def test_a_line_of_the_table_is_all_that_a_new_channel_takes(tmp_path: Path) -> None:
    """The line is the one in CONTRIBUTING.md; `added_channel.py` uses the package that has it."""
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    line = re.search(r"## Add a sensor channel.*?```python\n(.*?)```", text, re.DOTALL)
    package = tmp_path / "irtwin"
    shutil.copytree(
        Path(irtwin.__file__).parent, package, ignore=shutil.ignore_patterns("__pycache__", "demo", "assets")
    )
    table = package / "signals" / "channels.py"
    before = "    power: Annotated"
    assert table.read_text().count(before) == 1
    table.write_text(table.read_text().replace(before, line[1] + before))
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(tmp_path), str(ROOT)])}
    command = [sys.executable, "-m", "tests.signals.added_channel", str(tmp_path / "work")]
    done = subprocess.run(command, env=environment, cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ["csv", "parquet", "checked", "conditioned", "stored", "asked", "streamed"]
