"""`docs/LOG_FORMAT.md` says what the code does."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest
from tests.synthetic import arm, as_run, measure, swing

import irtwin
from irtwin.effects.catalogue import BASELINE
from irtwin.live.joint_stream import StateReader
from irtwin.signals import dh_table, log
from irtwin.signals.channels import CHANNELS, Channel, columns_of

DOCUMENT = (Path(__file__).parents[2] / "docs" / "LOG_FORMAT.md").read_text(encoding="utf-8")
ROBOT = arm(2)


def section(title: str) -> str:
    """The text below a heading, up to the next of its rank or a higher one."""
    rank = title.partition(" ")[0]
    return re.split(rf"\n{title}\n", DOCUMENT)[1].split(f"\n{rank} ")[0]


def rows(text: str) -> list[str]:
    return [line for line in text.splitlines() if line.startswith("| ")][2:]


def column(channel: Channel) -> str:
    return f"`{channel.column('JOINT')}`"


def test_the_channels_are_those_of_the_code() -> None:
    said = [
        f"| {column(one)} | {one.unit}{f' ({one.sliding})' if one.sliding else ''} | {one.label} | {one.greatest:.0e} |"
        for one in CHANNELS.values()
    ]
    assert rows(section("## A run")) == said


def test_the_keys_of_a_live_stream_are_those_of_the_code() -> None:
    streamed = [f"| `{one.streamed}` | {column(one)} |" for one in CHANNELS.values() if one.streamed]
    assert rows(section("## A live stream")) == streamed


@pytest.mark.parametrize(
    ("title", "known"),
    [
        (r"### `\[robot\]`", log.ROBOT_KEYS),
        (r"### `\[robot\.joint\.NAME\]`", log.SHEET_KEYS),
        (r"### `\[\[run\]\]`", log.RUN_KEYS),
        (r"### `\[twin\]`", log.TWIN_KEYS),
        (r"### `\[robot\.dh\]`", dh_table.DH_KEYS),
        (r"### `\[\[robot\.dh\.row\]\]`", dh_table.ROW_KEYS),
    ],
)
def test_the_keys_are_those_of_the_code(title: str, known: tuple[str, ...]) -> None:
    named = [key for line in rows(section(title)) for key in re.findall(r"`(\w+)`", line.split("|")[1])]
    assert sorted(named) == sorted(known)


def test_the_example_is_a_data_set(tmp_path: Path) -> None:
    example = re.search(r"```toml\n(.*?)```", DOCUMENT, re.DOTALL)
    (tmp_path / "dataset.toml").write_text(example[1], encoding="utf-8")
    (tmp_path / "robot.urdf").write_text(ROBOT.urdf, encoding="utf-8")
    (tmp_path / "runs").mkdir()
    for place, name in enumerate(("monday", "monday_again")):
        run = as_run(measure(ROBOT, swing(ROBOT, place, seconds=2.0)))
        columns = columns_of(replace(run.signals, current=None), ROBOT.joint_names)
        lines = [
            ",".join(columns),
            *(",".join(map(repr, map(float, row))) for row in zip(*columns.values(), strict=True)),
        ]
        (tmp_path / "runs" / f"{name}.csv").write_text("\n".join(lines), encoding="utf-8")
    data_set = irtwin.read_data_set(tmp_path)
    assert data_set.repairs == ()
    assert data_set.notes["supply"] == "400 V"
    assert [run.repeat_of for run in data_set.runs] == [None, "monday"]
    assert set(data_set.effects or ()) < set(BASELINE)


def test_the_example_of_a_table_is_a_robot(tmp_path: Path) -> None:
    example = re.search(r"```toml\n(\[robot\.dh\].*?)```", DOCUMENT, re.DOTALL)
    (tmp_path / "dataset.toml").write_text(f'[robot]\nname = "a"\n{example[1]}', encoding="utf-8")
    assert log.read_robot(tmp_path).joint_names == ("joint_1", "slide")


def test_the_line_of_a_live_stream_is_understood() -> None:
    example = re.search(r"```json\n(.*?)```", DOCUMENT, re.DOTALL)
    state = StateReader({"Two_Axes": ROBOT.joint_names}).read(example[1].strip().encode())
    assert list(state.of("torque")) == json.loads(example[1])["effort"]
