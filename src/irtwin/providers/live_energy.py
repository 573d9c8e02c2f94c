"""Energy and gap of a live run: while it lasts as far as its samples go, and of one that is stored, all of it.

Energies are those that other runs have, in the same tables; the gap beside the twin's band is a live run's alone.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import pyarrow as pa
import scipy
from sqlalchemy import select

from irtwin.errors import InputError
from irtwin.identification.validation import APART, energy_error
from irtwin.providers import records
from irtwin.providers.names import run_iri, twin_iri
from irtwin.providers.provider import Made
from irtwin.providers.records import inputs
from irtwin.signals.channels import CHANNELS, Signals, columns_of
from irtwin.storage.database import Workspace
from irtwin.storage.energy_schema import EnergyShare, JointEnergy
from irtwin.storage.rows import Tables, Values
from irtwin.storage.schema import (
    LIVE,
    LIVE_RUN,
    GapExcursion,
    GapState,
    RunEnergy,
    RunRow,
    TwinRun,
    moment_of,
)
from irtwin.twin.gap_watch import ROBOT, GapWatch, Windows, band
from irtwin.twin.so_far import EnergySoFar, WatchedStretch
from irtwin.twin.twin import Twin

_KINDS = {kind.__tablename__: kind for kind in (RunEnergy, EnergyShare, JointEnergy, GapState, GapExcursion)}
_AT_ONCE = 4096  # samples of a stored run
_MOST_RUNS = 40  # that a twin knows tell its band
_QUDT = {"W": "W", "N m": "N-M", "N": "N"}  # what QUDT calls the units of residuals


@dataclass(frozen=True)
class KnownTwin:
    """A robot's twin, and the band of its gap by place."""

    twin_id: str
    twin: Twin
    bands: Mapping[str, float]


def known_twin(workspace: Workspace, robot_id: str) -> KnownTwin | None:
    """Return a robot's twin; None where it has none. Raises InputError where its file is gone or another."""
    known = records.known_twin(workspace, robot_id)
    return None if known is None else KnownTwin(*known, _bands(workspace, known[0], known[1].robot.joint_names))


class LiveEnergy:
    """Energy and gap of a run, fed with its samples; `stretches` are given on to who shows them."""

    def __init__(
        self,
        run_id: str,
        robot_id: str,
        joints: tuple[str, ...],
        known: KnownTwin | None,
        payload: float = 0.0,
        payload_com: tuple[float, float, float] = (0.0, 0.0, 0.0),
        kind: str = LIVE_RUN,
    ) -> None:
        """Begin a run of a robot by its twin, with what its flange carries: kg, and m in the flange's frame."""
        self.known = known
        self._is_consumption = kind == LIVE_RUN  # a replay takes nothing
        self._run_id, self._robot_id = run_id, robot_id
        twin = None if known is None else known.twin
        self.so_far = EnergySoFar(joints, twin, name=run_id, payload=payload, payload_com=payload_com)
        self.watch = GapWatch(joints, {} if known is None else known.bands)

    def feed(self, columns: dict[str, np.ndarray], *, last: bool = False, least: float = 0.0) -> list[WatchedStretch]:
        """Take samples, columns as of a log by name; return what could be worked out, as `EnergySoFar.feed`."""
        stretches = list(self.so_far.feed(columns, last=last, least=least))
        for stretch in stretches:
            self.watch.take(stretch)
        if last:
            self.watch.end()
        return stretches

    def tables(self, activity_id: str) -> Tables:
        """Return all that is known as rows of the database; none before there is an energy."""
        so_far = self.so_far
        energy = self._run_energy()
        if energy is None:
            return {}
        made = {"run_id": self._run_id, "activity_id": activity_id}
        taken_by = activity_id if so_far.measured is None else watching(self._run_id)
        energy = energy | {"taken_activity_id": taken_by}
        if self.known is None:
            return {"run_energy": [made | energy]}
        of = {**made, "robot_id": self._robot_id}
        by_twin = {**of, "twin_id": self.known.twin_id}
        shares = [
            {**by_twin, "effect": effect, "place": joint or ROBOT, "joint": joint, "energy_j": value}
            for (effect, joint), value in so_far.ledger.items()
        ]
        joints = per_joint((joint, value) for (_, joint), value in so_far.ledger.items())
        return {
            "run_energy": [made | energy],
            "energy_share": shares,
            "joint_energy": [{**of, "joint": joint, "energy_j": value} for joint, value in joints.items()],
            "gap_state": [by_twin | row for row in self._gap_states()],
            "gap_excursion": [by_twin | row for row in self._excursions()],
        }

    def _run_energy(self) -> Values | None:
        so_far, known, measured = self.so_far, self.known, self.so_far.measured
        if not so_far.seconds or (known is None and measured is None):
            return None
        row: Values = {}
        if known is not None:
            at_rest = known.twin.at_rest
            standby = sum(value for (effect, _), value in so_far.ledger.items() if effect in at_rest)
            row = {
                "twin_id": known.twin_id,
                "part": "held_out",
                "modelled_energy_j": so_far.modelled,
                "energy_error_percent": energy_error(measured, so_far.modelled) if measured else None,
                "standby_energy_j": standby if at_rest else None,
                "standby_share": standby / so_far.modelled if at_rest and so_far.modelled > 0 else None,
                "returned_energy_j": so_far.returned,
            }
        taken = so_far.modelled if measured is None else measured
        return row | {
            "energy_consumption_j": taken if self._is_consumption else None,
            "energy_from": known.twin.energy_from if known is not None and measured is None else "measured",
            "run_power_w": taken / so_far.seconds,
            "peak_power_w": so_far.peak_power,
            "measured_energy_j": measured,
        }

    def _gap_states(self) -> Iterator[Values]:
        for place, now in self.watch.places.items():
            yield self._place(place) | {
                "residual": now.residual,
                "band": now.band,
                "ratio": now.ratio,
                "state": now.state,
                "since": moment_of(now.since),
            }

    def _excursions(self) -> Iterator[Values]:
        for place, now in self.watch.places.items():
            for number, excursion in enumerate(now.excursions, start=1):
                yield self._place(place) | {
                    "number": number,
                    "began": moment_of(excursion.began),
                    "ended": None if excursion.ended is None else moment_of(excursion.ended),
                    "lasted_s": excursion.until - excursion.began,
                    "peak_residual": excursion.peak_residual,
                    "peak_ratio": excursion.peak_ratio,
                }

    def _place(self, place: str) -> Values:
        assert self.known is not None
        if place == ROBOT:
            return {"place": place, "channel": "power", "joint": None, "unit": _QUDT[CHANNELS["power"].unit]}
        kind = next(joint.kind for joint in self.known.twin.robot.joints if joint.name == place)
        return {"place": place, "channel": "torque", "joint": place, "unit": _QUDT[CHANNELS["torque"].unit_of(kind)]}


def per_joint(ledger: Iterable[tuple[str | None, float]]) -> dict[str, float]:
    """Return what each joint took, J, of shares that have a joint or none."""
    energies: defaultdict[str, float] = defaultdict(float)
    for joint, energy in ledger:
        if joint is not None:
            energies[joint] += energy
    return energies


def watching(run_id: str) -> str:
    """Return the id of the activity that watched a live run, and read its meter."""
    return f"{LIVE}.{run_id}"


def used(run_id: str, known: KnownTwin | None) -> list[str]:
    """Return the IRIs of what the energy of a run is worked out from."""
    return [run_iri(run_id), *([] if known is None else [twin_iri(known.twin_id)])]


def provide(workspace: Workspace, run_id: str) -> Made:
    """Make the energy, the ledger, the gap and the modelled series of a live run that is stored."""
    run = workspace.row(RunRow, run_id)
    joints = records.joint_names(workspace, run.robot_id)
    known = known_twin(workspace, run.robot_id)
    com = (run.payload_com_x_m, run.payload_com_y_m, run.payload_com_z_m)
    energy = LiveEnergy(run_id, run.robot_id, joints, known, run.payload_kg, com, run.kind)
    table = workspace.read_series(run_id)
    columns = {name: np.array(table.column(name), dtype=float) for name in table.column_names}
    assert run.start_time is not None  # of what was watched
    began = run.start_time.timestamp()
    columns["time"] = columns["time"] + began
    stretches: list[WatchedStretch] = []
    for start in range(0, table.num_rows, _AT_ONCE):
        piece = {name: values[start : start + _AT_ONCE] for name, values in columns.items()}
        stretches += energy.feed(piece, last=start + _AT_ONCE >= table.num_rows)
    rows = [_KINDS[name](**values) for name, some in energy.tables("").items() for values in some]
    series = {} if not stretches else {run_id: _modelled_series(joints, stretches, began)}
    read = {*inputs(workspace, run.robot_id, [run_id]), *used(run_id, known)}
    return Made(run.robot_id, sorted(read), rows, series)


def _modelled_series(joints: tuple[str, ...], stretches: list[WatchedStretch], began: float) -> pa.Table:
    """Return measured (filtered) and modelled signals side by side, columns as in `providers.energy`."""
    parts: defaultdict[str, list[np.ndarray]] = defaultdict(list)
    energies = {"energy": 0.0, "energy_model": 0.0}
    metered = all(stretch.motion.power is not None for stretch in stretches)
    shown = all(stretch.torque_residual is not None for stretch in stretches)
    for stretch in stretches:
        motion = stretch.motion
        torque = stretch.torque + stretch.torque_residual if shown and stretch.torque_residual is not None else None
        columns = dict(columns_of(Signals(motion.time - began, motion.q, torque=torque), joints))
        modelled = zip(joints, stretch.torque.T, strict=True)
        columns |= {f"{CHANNELS['torque'].column(name)}_model": of for name, of in modelled}
        powers = {"energy_model": stretch.power} | (
            {"energy": motion.power} if metered and motion.power is not None else {}
        )
        columns |= {name.replace("energy", "power"): power for name, power in powers.items()}
        for name, power in powers.items():
            columns[name] = energies[name] + scipy.integrate.cumulative_trapezoid(power, motion.time, initial=0.0)
            energies[name] = float(columns[name][-1])
        new = slice(0 if stretch.begins else 1, None)
        for name, values in columns.items():
            parts[name].append(values[new])
    table = {name: np.concatenate(values) for name, values in parts.items()}
    held_out = {"time": table.pop("time"), "held_out": np.ones(len(table[CHANNELS["q"].column(joints[0])]), dtype=bool)}
    return pa.table(held_out | table)


def _bands(workspace: Workspace, twin_id: str, joints: tuple[str, ...]) -> dict[str, float]:
    """Return the band of each place: the widest of the newest runs that the twin knows, fitted or held out."""
    newest = (
        select(TwinRun.run_id)
        .join(RunRow, RunRow.run_id == TwinRun.run_id)
        .where(TwinRun.twin_id == twin_id, TwinRun.part != APART)
        .order_by(RunRow.start_time.desc())
        .limit(_MOST_RUNS)
    )
    runs = workspace.all(newest)
    of_runs = [band(windows) for run_id in runs if len(windows := _windows(workspace, run_id, joints))]
    if not of_runs:
        return {}
    widest = np.fmax.reduce(np.array(of_runs))
    return {place: float(value) for place, value in zip((*joints, ROBOT), widest, strict=True) if not np.isnan(value)}


def _windows(workspace: Workspace, run_id: str, joints: tuple[str, ...]) -> np.ndarray:
    """Return the root mean squares of a run's residuals, window by window, (M, n + 1); NaN where not measured."""
    try:
        table = workspace.read_series(run_id, "modelled")
    except InputError:  # its energy was not worked out yet
        return np.empty((0, len(joints) + 1))
    names = [*(CHANNELS["torque"].column(joint) for joint in joints), "power"]
    missing = np.full(table.num_rows, np.nan)
    there = set(table.column_names)
    columns = [np.array(table[name]) - np.array(table[f"{name}_model"]) if name in there else missing for name in names]
    windows = Windows().take(np.array(table["time"]), np.column_stack(columns), begins=True)
    return np.array([root for _, root in windows]).reshape(-1, len(names))
