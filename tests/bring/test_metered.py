"""A meter's log, which has no joints, becomes a data set: power in W, energy as power, and what is neither is said."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from irtwin.bring.bring import Options, bring, found_in
from irtwin.bring.metered import is_metered
from irtwin.errors import InputError
from irtwin.signals.log import DataSet, read_data_set

COUNT = 60


def brought(folder: Path, header: str, values: np.ndarray, options: Options | None = None) -> DataSet:
    """Bring a log of one reading a minute."""
    lines = [header, *(f"2026-03-02T08:{k:02}:00,{value:.6f}" for k, value in enumerate(values))]
    (folder / "meter.csv").write_text("\n".join([*lines, ""]))
    bring([folder / "meter.csv"], folder / "set", None, options or Options())
    return read_data_set(folder / "set")


@pytest.mark.parametrize(
    ("header", "values"),
    [
        ("time,power_kW", np.full(COUNT, 0.3)),
        ("Zeit,Wirkleistung [W]", np.full(COUNT, 300.0)),
        ("timestamp,energy_kWh", 1234.0 + 0.3 / 60 * np.arange(COUNT)),  # a counter
        ("timestamp,consumption (Wh)", 300.0 / 60 + 1e-6 * (-1.0) ** np.arange(COUNT)),  # of each minute
    ],
)
def test_power_and_energy_become_power(tmp_path: Path, header: str, values: np.ndarray) -> None:
    data_set = brought(tmp_path, header, values)
    (run,) = data_set.runs
    assert run.signals.power == pytest.approx(np.full(COUNT, 300.0), rel=1e-3)
    assert (data_set.robot.joints, run.signals.q.shape, data_set.power_at) == ((), (COUNT, 0), "mains")
    assert run.started is not None and run.started.isoformat() == "2026-03-02T08:00:00+00:00"
    assert data_set.robot.name == "meter"
    assert found_in(tmp_path / "set") == ((), f"irtwin run {tmp_path / 'set'}")


@pytest.mark.parametrize(
    ("header", "moment"),
    [
        ("Datum/Uhrzeit;Wirkleistung [kW]", "{day}.03.2026 {hour:02}:{minute:02}"),
        ("Datum;Uhrzeit;Leistung kW", "{day:02}.03.2026;{hour:02}:{minute:02}:00"),
        ("date;time;power kW", "2026-03-{day:02};{hour:02}:{minute:02}"),
    ],
)
def test_dates_as_meters_write_them(tmp_path: Path, header: str, moment: str) -> None:
    quarters = [divmod(15 * k, 60) for k in range(192)]
    times = [moment.format(day=2 + hour // 24, hour=hour % 24, minute=minute) for hour, minute in quarters]
    rows = [f"{time};{('2,0', '2,5', '3,0')[k % 3]}" for k, time in enumerate(times)]
    (tmp_path / "meter.csv").write_text("\n".join([header, *rows, ""]))
    bring([tmp_path / "meter.csv"], tmp_path / "set", None, Options())
    (run,) = read_data_set(tmp_path / "set").runs
    assert run.started is not None and run.started.isoformat() == "2026-03-02T00:00:00+00:00"
    assert run.signals.time[-1] == pytest.approx(191 * 900.0)
    assert run.signals.power[:3] == pytest.approx([2000.0, 2500.0, 3000.0])


def test_what_is_no_power_is_said(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no column was taken for power or energy; say which it is: --map COLUMN=pow"):
        brought(tmp_path, "time,value", np.full(COUNT, 300.0))
    named = Options(name="Cell 3", maps=("value=power:kW",))
    assert brought(tmp_path, "time,value", np.full(COUNT, 3.0), named).robot.name == "Cell 3"


def test_names_tell_a_meter() -> None:
    assert is_metered(["time", "P_kW", "power"])
    assert is_metered(["ts", "Zaehlerstand [kWh]"])
    assert not is_metered(["time", "power", "q_joint_1"])
    assert not is_metered(["time", "kinetic_J"])


@pytest.mark.parametrize(
    ("robot", "said"),
    [
        ('joints = ["a"]', r"\[robot\] joints = \['a'\]: joints = \[\] alone says that no joint was logged"),
        ('joints = []\nurdf = "r.urdf"', r"\[robot\] joints and urdf: joints = \[\] alone says"),
    ],
)
def test_joints_are_said_or_not(tmp_path: Path, robot: str, said: str) -> None:
    (tmp_path / "dataset.toml").write_text(f'[robot]\nname = "a"\n{robot}\n[[run]]\nfile = "x.csv"\n')
    with pytest.raises(InputError, match=said):
        read_data_set(tmp_path)
