"""Sources: found by the end of a file's name, and all that one has to say of itself."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pyarrow as pa
import pyarrow.feather
import pytest
from tests.signals.test_log import ROBOT, columns

from irtwin.errors import InputError, first_line
from irtwin.input_file import check_file
from irtwin.signals.samples import read_signals
from irtwin.signals.sources import catalogue
from irtwin.signals.sources.bag_source import BagSource
from irtwin.signals.sources.csv_source import CsvSource
from irtwin.signals.sources.parquet_file import ParquetSource
from irtwin.signals.sources.source import MOST_VALUES, Source

CONTRIBUTING = Path(__file__).parents[2] / "CONTRIBUTING.md"


def feather() -> type[Source]:
    """The worked example of CONTRIBUTING.md."""
    text = CONTRIBUTING.read_text(encoding="utf-8")
    code = re.search(r"## Add a log source.*?```python\n(.*?)```", text, re.DOTALL)
    known = (Source, ClassVar, Sequence, cached_property, InputError, check_file, first_line)
    names: dict[str, Any] = {one.__name__: one for one in known} | {"pa": pa, "pyarrow": pyarrow}
    exec(code[1], names)
    kind = names["FeatherSource"]
    assert isinstance(kind, type)
    return kind


class Numbered(Source):
    """Joints by number, as some controllers log them; a line of JSON would do as well as this text."""

    suffixes: ClassVar[tuple[str, ...]] = (".numbered",)
    counted: ClassVar[str] = "record"
    first: ClassVar[int] = 1

    def columns(self) -> Sequence[str]:
        """Return the columns, by the joints' names."""
        names = self.robot.joint_names
        return ["time", *(f"{prefix}_{name}" for prefix in ("q", "tau") for name in names), "note"]

    def read(self, columns: Sequence[str], *, repair: bool) -> tuple[pa.Table, list[str]]:
        """Return the columns."""
        table = np.loadtxt(self.path)
        self.check_size(len(table), len(columns))
        values = dict(zip(self.columns(), table.T, strict=False))
        return pa.table({name: values[name] for name in columns if name in values}), ["read by a package"]


@pytest.fixture
def registered(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two formats of another package."""
    monkeypatch.setattr(catalogue, "_registered", lambda: (feather(), Numbered))


def test_the_formats_that_ship() -> None:
    bags = {end: BagSource for end in (".bag", ".mcap", ".db3", "/")}
    assert catalogue.sources() == {".csv": CsvSource, ".parquet": ParquetSource} | bags
    assert isinstance(catalogue.source_of(Path("runs/one.CSV"), ROBOT), CsvSource)


def test_another_format_is_refused(tmp_path: Path) -> None:
    ends = r"\.csv or \.parquet or \.bag or \.mcap or \.db3 file, or a ROS 2 bag's folder; convert it to one of these"
    with pytest.raises(InputError, match=rf"run\.xlsx: a run is a {ends}"):
        read_signals(tmp_path / "run.xlsx", ROBOT)


@pytest.mark.usefixtures("registered")
def test_a_package_brings_a_format(tmp_path: Path) -> None:
    path = tmp_path / "run.feather"
    pyarrow.feather.write_feather(pa.table(columns()), path)
    signals, said = read_signals(path, ROBOT)
    assert said == []
    assert np.array_equal(signals.torque[:, 1], columns()["tau_b"])
    path.write_bytes(path.read_bytes()[:100])
    with pytest.raises(InputError, match="not a readable Feather file"):
        read_signals(path, ROBOT)


@pytest.mark.usefixtures("registered")
def test_a_format_may_number_the_joints_and_count_its_samples(tmp_path: Path) -> None:
    path = tmp_path / "run.numbered"
    table = np.column_stack([values for name, values in columns().items() if name not in ("power", "mood")])
    np.savetxt(path, table)
    signals, _ = read_signals(path, ROBOT)
    assert np.allclose(signals.q[:, 1], columns()["q_b"])
    table[3, 4] = np.nan
    np.savetxt(path, table)
    with pytest.raises(InputError, match=r"run\.numbered, record 4, column tau_b: is not a finite number"):
        read_signals(path, ROBOT)


def test_two_formats_of_the_same_files_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    class Again(CsvSource):
        """Takes what another takes."""

    monkeypatch.setattr(catalogue, "_registered", lambda: (Again,))
    with pytest.raises(ValueError, match=r"two sources take \.csv files"):
        catalogue.sources()


def test_sizes_are_bounded() -> None:
    source = CsvSource(Path("run.csv"), ROBOT)
    source.check_size(MOST_VALUES, 1)
    with pytest.raises(InputError, match="has no sample"):
        source.check_size(0, 3)
    with pytest.raises(InputError, match="a run may have 125,000,000 values: cut it into several"):
        source.check_size(MOST_VALUES, 2)
