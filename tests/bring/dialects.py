"""One run of the demo in the forms and units of others."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from pathlib import Path

import numpy as np
import pyarrow.parquet

from irtwin import resources
from irtwin.robot.description import Robot
from irtwin.robot.urdf import read_urdf
from irtwin.signals.channels import Signals, from_columns
from irtwin.signals.log import DataSet

NAME = "kuka_kr6_r700"
N = 400  # samples: 4.8 s of exciting motion; of 330 the checks tell less


@cache
def robot() -> Robot:
    return read_urdf(resources.folder("ontology") / "robots" / f"{NAME}.urdf")


@cache
def good() -> dict[str, np.ndarray]:
    """The columns of the demo's run, SI units, with speeds as a controller logs them."""
    file = resources.folder("demo") / NAME / "runs" / "exciting_1.parquet"
    table = pyarrow.parquet.read_table(file).slice(0, N)
    columns = {name: table[name].to_numpy().astype(float) for name in table.column_names}
    q = np.column_stack([columns[f"q_{joint}"] for joint in robot().joint_names])
    speeds = np.gradient(q, columns["time"], axis=0)
    return columns | {f"dq_{joint}": speeds[:, k] for k, joint in enumerate(robot().joint_names)}


def signals(columns: Mapping[str, np.ndarray]) -> Signals:
    return from_columns(columns, robot().joint_names)


def per_joint(prefix: str, name: str, start: int = 1, factor: float = 1.0) -> dict[str, np.ndarray]:
    """Columns of a channel under another name, {} the joint's number, multiplied."""
    return {
        name.format(number): factor * good()[f"{prefix}_{joint}"]
        for number, joint in enumerate(robot().joint_names, start=start)
    }


def write_text(
    path: Path,
    columns: Mapping[str, np.ndarray | Sequence[str]],
    delimiter: str = ",",
    decimal: str = ".",
    head: Iterable[str] = (),
    units: Sequence[str] | None = None,
) -> Path:
    """Write columns as text: numbers to the last digit, NaN as nothing."""

    def cell(value: object) -> str:
        if isinstance(value, str):
            return value
        number = float(value)  # type: ignore[arg-type]
        return "" if np.isnan(number) else repr(number).replace(".", decimal)

    rows = [delimiter.join(map(cell, row)) for row in zip(*columns.values(), strict=True)]
    lines = [*head, delimiter.join(columns), *([delimiter.join(units)] if units else []), *rows]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def assert_same(data_set: DataSet, fields: str = "time q torque power", tolerance: float = 1e-12) -> None:
    """Hold a data set's run to the demo's."""
    found, true = data_set.runs[0].signals, signals(good())
    for field in fields.split():
        np.testing.assert_allclose(
            getattr(found, field), getattr(true, field), rtol=tolerance, atol=tolerance, err_msg=field
        )
