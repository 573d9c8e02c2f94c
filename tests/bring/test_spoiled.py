"""One good log in twelve spoiled versions: `import` and `check` mend each, or stop, and say so."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
from tests.bring.dialects import NAME, good, robot, signals, write_text
from tests.data_sets import irtwin, irtwin_does

from irtwin.signals.log import read_data_set

Columns = Mapping[str, np.ndarray]
_USED = ("time", "q_", "tau_", "power")


@dataclass(frozen=True)
class Spoiled:
    """A fault, and what `import` and `check` say of it; None: the numbers come back right, with a word of it."""

    change: Callable[[dict[str, np.ndarray]], Columns]
    imported: str
    checked: str
    mended: bool = False  # by import: the numbers are those of the good log
    stops: bool = True  # check ends with 2
    text: Mapping[str, str] = field(default_factory=dict)
    urdf: Callable[[str], str] = str
    options: tuple[object, ...] = ()
    toml: str = ""


def scaled(prefix: str, factor: float) -> Callable[[dict[str, np.ndarray]], Columns]:
    return lambda columns: {
        name: values * factor if name.startswith(prefix) else values for name, values in columns.items()
    }


def repeated_stamp(columns: dict[str, np.ndarray]) -> Columns:
    time = columns["time"].copy()
    time[100] = time[99]
    return columns | {"time": time}


def exchanged(columns: dict[str, np.ndarray]) -> Columns:
    return columns | {"tau_joint_a2": columns["tau_joint_a3"], "tau_joint_a3": columns["tau_joint_a2"]}


def dead(columns: dict[str, np.ndarray]) -> Columns:
    return columns | {"tau_joint_a2": np.zeros(len(columns["time"]))}


def same(columns: dict[str, np.ndarray]) -> Columns:
    return columns


def without_middle(columns: dict[str, np.ndarray]) -> Columns:
    return {name: np.delete(values, np.s_[150:250]) for name, values in columns.items()}


def in_millimetres(urdf: str) -> str:
    return re.sub(
        r'xyz="([^"]*)"', lambda found: f'xyz="{" ".join(str(1000 * float(one)) for one in found[1].split())}"', urdf
    )


TWELVE = {
    "time in ms": Spoiled(scaled("time", 1000.0), "ms by its numbers", "time looks like ms", mended=True),
    "power in kW": Spoiled(scaled("power", 1e-3), "kW by a check", "it looks like kW", mended=True),
    "positions in deg": Spoiled(scaled("q_", 180 / np.pi), "deg by its numbers", "looks like degrees", mended=True),
    "URDF in mm": Spoiled(same, "it looks like millimetres", "it looks like millimetres", urdf=in_millimetres),
    "payload in g": Spoiled(
        same, "unit (cure first): payload_mass = 3000 is more", "payload_mass = 3000 is more",
        options=("--payload-mass", 3000), toml="payload_mass = 3000.0",
    ),
    "time of the wrong sign": Spoiled(scaled("time", -1.0), "line 3, column time: time falls", "time: does not rise"),
    "a stamp twice": Spoiled(repeated_stamp, "line 102, column time: time does not rise (1 such", "does not rise"),
    "a hole": Spoiled(without_middle, "hole (mended when it is read): ", "hole (mended)", stops=False),
    "a dead channel": Spoiled(
        dead, "dead (cure first): tau_joint_a2 is 0 throughout", "tau_joint_a2 is 0 throughout"
    ),
    "another delimiter": Spoiled(
        same,
        "semicolons, decimal commas",
        "line 1: columns are separated by semicolons; separate them by commas", mended=True,
        text={"delimiter": ";", "decimal": ","},
    ),
    "columns exchanged": Spoiled(
        exchanged, "swap (cure first): tau_joint_a2 <-> tau_joint_a3", "tau_joint_a2 <-> tau_joint_a3 stand in each"
    ),
    "a misspelt key": Spoiled(
        same, "", "payload_mas is not known; did you mean payload_mass?", toml="payload_mas = 3.0"
    ),
}  # fmt: skip


def written(folder: Path, spoiled: Spoiled) -> tuple[Path, Path]:
    """Write the spoiled log as CSV, and a data set of it; return both."""
    columns = spoiled.change({name: values for name, values in good().items() if name.startswith(_USED)})
    log = write_text(folder / "log.csv", columns, **spoiled.text)  # type: ignore[arg-type]
    data_set = folder / "data_set"
    (data_set / "runs").mkdir(parents=True)
    (data_set / "runs" / "log.csv").write_bytes(log.read_bytes())
    (data_set / "robot.urdf").write_text(spoiled.urdf(robot().urdf))
    (data_set / "dataset.toml").write_text(
        f'[robot]\nname = "{NAME}"\nurdf = "robot.urdf"\n[[run]]\nfile = "runs/log.csv"\n{spoiled.toml}\n'
    )
    return log, data_set


@pytest.mark.parametrize("fault", TWELVE)
def test_check_says_what_is_wrong(tmp_path: Path, fault: str) -> None:
    spoiled = TWELVE[fault]
    said = irtwin("check", written(tmp_path, spoiled)[1])
    assert spoiled.checked in said.err
    assert said.status == (2 if spoiled.stops else 0)


def test_check_says_which_key_of_the_robot_is_misspelt_and_what_it_dropped(tmp_path: Path) -> None:
    _, data_set = written(tmp_path, TWELVE["a stamp twice"])
    file = data_set / "dataset.toml"
    file.write_text(file.read_text().replace("[[run]]", 'poweer_at = "dc_bus"\n[[run]]'))
    said = irtwin_does("check", data_set, "--repair")
    assert "[robot] poweer_at is kept as a note; did you mean power_at?" in said.err
    assert "1 samples dropped, column time does not rise: line 102" in said.err
    assert "no fault found" not in said.err


@pytest.mark.slow
@pytest.mark.parametrize("fault", [fault for fault, spoiled in TWELVE.items() if spoiled.imported])
def test_import_mends_it_or_says_it(tmp_path: Path, fault: str) -> None:
    spoiled, out = TWELVE[fault], tmp_path / "set"
    log, data_set = written(tmp_path, spoiled)
    urdf = data_set / "robot.urdf"
    said = irtwin("import", log, "--robot", urdf, "--power-at", "mains", "--out", out, *spoiled.options)
    assert spoiled.imported in f"{said.out}\n{said.err}"
    usable = out.exists() and "(cure first)" not in said.err
    assert said.status == (0 if usable else 2)  # as `check` of it ends
    assert out.exists() == ("Written: " in said.err)
    assert ("cannot be used yet" in said.err) == (out.exists() and not usable)
    if spoiled.mended:
        found = read_data_set(out).runs[0].signals
        for name in ("time", "q", "torque", "power"):
            np.testing.assert_allclose(getattr(found, name), getattr(signals(good()), name), rtol=1e-12, atol=1e-12)
