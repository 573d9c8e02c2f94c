"""The provider of a run's energy: what it took, what its twin says that it took, and where it went."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import pyarrow as pa
import scipy

from irtwin.identification.validation import APART
from irtwin.providers import live_energy
from irtwin.providers.motions import robot_motions
from irtwin.providers.names import twin_iri
from irtwin.providers.provider import Made
from irtwin.providers.records import inputs, load_run, load_twin
from irtwin.signals.channels import CHANNELS, Signals, columns_of
from irtwin.signals.conditioning import condition
from irtwin.signals.motion import Motion, standstill
from irtwin.storage.database import Workspace
from irtwin.storage.energy_schema import EnergyShare, InseparableEnergy, JointEnergy, RunPrice, SupplyStateRow
from irtwin.storage.schema import PLANNED_RUN, SIMULATED, WATCHED_RUNS, Base, RunEnergy, RunRow, TwinRun
from irtwin.twin.account import Entry, Share, account
from irtwin.twin.price import Figure, Price, cost, saving
from irtwin.twin.supply_states import SupplyState, supply_states
from irtwin.twin.twin import Twin
from irtwin.twin.validate import validate


def provide(workspace: Workspace, run_id: str) -> Made:
    """Make a run's energy, its ledger, and its modelled series; of a live run its gap as well; of a plan its price."""
    run = workspace.row(RunRow, run_id)
    if run.kind in WATCHED_RUNS:
        return live_energy.provide(workspace, run_id)
    robot_id = run.robot_id
    twin_id, twin = load_twin(workspace, robot_id)
    if run.kind == PLANNED_RUN:
        return _planned(workspace, run, twin_id, twin)
    role = workspace.row(TwinRun, (twin_id, run_id))
    motion = robot_motions(workspace, robot_id).motions[run_id]
    entries = account(twin, motion)
    shares = [share for entry in entries for share in entry.shares]
    read = inputs(workspace, robot_id, [run_id])
    return Made(
        robot_id=robot_id,
        used=[*read, twin_iri(twin_id)],
        metered=[] if motion.power is None else [iri for iri in read if iri.startswith("series/")],
        rows=[
            _run_energy(run, twin_id, role, twin, motion, shares),
            *_account(robot_id, run_id, twin_id, entries),
            *_states(robot_id, run_id, supply_states(twin, motion) if twin.knows_power else ()),
            *(
                JointEnergy(run_id=run_id, joint=joint, robot_id=robot_id, energy_j=energy)
                for joint, energy in live_energy.per_joint((share.joint, share.energy) for share in shares).items()
            ),
        ],
        series={run_id: modelled_series(twin, motion, held_out(role, motion))},
    )


def _account(robot_id: str, run_id: str, twin_id: str, entries: Sequence[Entry]) -> Iterator[Base]:
    """Yield a run's shares of energy, and what is told of those together that are not told apart."""
    number = 0
    for entry in entries:
        if len(entry.shares) > 1:
            number += 1
            yield InseparableEnergy(
                run_id=run_id,
                number=number,
                robot_id=robot_id,
                energy_j=entry.energy,
                lower_j=entry.lower,
                upper_j=entry.upper,
            )
        for share in entry.shares:
            yield EnergyShare(
                twin_id=twin_id,
                run_id=run_id,
                effect=share.effect,
                place=share.joint or "robot",
                joint=share.joint,
                robot_id=robot_id,
                energy_j=share.energy,
                lower_j=share.lower,
                upper_j=share.upper,
                inseparable=number if len(entry.shares) > 1 else None,
            )


def _states(robot_id: str, run_id: str, states: Sequence[SupplyState]) -> Iterator[SupplyStateRow]:
    for number, state in enumerate(states, start=1):
        yield SupplyStateRow(
            run_id=run_id,
            number=number,
            robot_id=robot_id,
            state=state.name,
            seconds=state.seconds,
            power_w=state.logged,
            differs=state.differs,
            **_figure("modelled_power", "w", state.modelled),
        )


def _planned(workspace: Workspace, run: RunRow, twin_id: str, twin: Twin) -> Made:
    run_id, scaled = run.run_id, run.time_scaling_of
    motion = condition(load_run(workspace, twin.robot, run_id), twin.robot, twin.cutoff)
    taken = cost(twin, [motion])
    saved = None
    if scaled is not None and twin.knows_power:  # against the run as it was, and rest until the scaled one would end
        saved = saving(twin, motion, condition(load_run(workspace, twin.robot, scaled), twin.robot, twin.cutoff))
    row = RunPrice(
        run_id=run_id,
        twin_id=twin_id,
        energy_from="modelled" if twin.knows_power else "mechanical",
        **_figure("energy", "j", taken.energy),
        **_figure("mean_power", "w", taken.mean),
        **_figure("peak_power", "w", taken.peak),
        **({} if saved is None else _figure("saving", "j", saved)),
    )
    nothing = np.zeros(len(motion.time), dtype=bool)
    return Made(
        robot_id=run.robot_id,
        used=[*inputs(workspace, run.robot_id, [run_id, *([] if scaled is None else [scaled])]), twin_iri(twin_id)],
        rows=[row],
        series={run_id: modelled_series(twin, motion, nothing)},
    )


def _figure(name: str, unit: str, figure: Figure) -> dict[str, float | None]:
    """Return a value and its interval by their columns."""
    half = figure.half_width
    lower, upper = (None, None) if half is None else (figure.value - half, figure.value + half)
    return {f"{name}_{unit}": figure.value, f"{name}_lower_{unit}": lower, f"{name}_upper_{unit}": upper}


def stored_price(workspace: Workspace, run_id: str) -> Price | None:
    """Return what a planned run takes, as it was stored; None where its robot's twin knows nothing of power."""
    row = workspace.row(RunPrice, run_id)
    if row.energy_from != "modelled":
        return None

    def figure(value: float, upper: float | None) -> Figure:
        return Figure(value, None if upper is None else upper - value)

    return Price(
        workspace.row(RunRow, run_id).run_time_s,
        energy=figure(row.energy_j, row.energy_upper_j),
        peak=figure(row.peak_power_w, row.peak_power_upper_w),
        mean=figure(row.mean_power_w, row.mean_power_upper_w),
    )


def held_out(role: TwinRun, motion: Motion) -> np.ndarray:
    """Return which samples took no part in the fit, (N,) bool."""
    if role.held_out_from_s is not None:
        return motion.time >= role.held_out_from_s
    return np.full(len(motion.time), role.part == "held_out")


def modelled_series(twin: Twin, motion: Motion, judged: np.ndarray) -> pa.Table:
    """Return filtered motion, and measured and modelled torque, power and energy side by side, a row a sample.

    Columns: time, held_out, standing (no joint moves), q_J, dq_J, tau_J, tau_J_model, power, power_model, energy,
    energy_model; those that nothing measured are left out. Energies are cumulative, J.
    """
    names = twin.robot.joint_names
    measured = Signals(motion.time, motion.q, dq=motion.dq, torque=twin.measured_torque(motion))
    columns = {"time": motion.time, "held_out": judged, "standing": standstill(motion), **columns_of(measured, names)}
    columns |= {
        f"{CHANNELS['torque'].column(name)}_model": of for name, of in zip(names, twin.torque(motion).T, strict=True)
    }
    for suffix, power in (("", motion.power), ("_model", twin.power(motion))):
        if power is not None:
            columns[f"{CHANNELS['power'].prefix}{suffix}"] = power
            columns[f"energy{suffix}"] = scipy.integrate.cumulative_trapezoid(power, motion.time, initial=0.0)
    return pa.table(columns)


def _run_energy(
    run: RunRow, twin_id: str, role: TwinRun, twin: Twin, motion: Motion, shares: Sequence[Share]
) -> RunEnergy:
    (whole,) = validate(twin, [motion])
    start = int(np.argmax(held_out(role, motion)))
    judged = whole if start == 0 else validate(twin, [motion.part(start, len(motion.time))])[0]
    power = twin.power(motion) if motion.power is None else motion.power
    standby = sum(share.energy for share in shares if share.effect in twin.at_rest)
    energy = whole.modelled_energy if whole.measured_energy is None else whole.measured_energy
    return RunEnergy(
        run_id=run.run_id,
        twin_id=twin_id,
        part=role.part,
        energy_consumption_j=None if run.role == SIMULATED else energy,
        energy_from=twin.energy_from if motion.power is None else "measured",
        run_power_w=float(np.mean(power)),
        peak_power_w=float(np.max(power)),
        measured_energy_j=whole.measured_energy,
        modelled_energy_j=whole.modelled_energy,
        energy_error_percent=None if role.part == APART else judged.energy_error,
        power_rmse_w=None if role.part == APART else judged.power_rmse,
        standby_energy_j=standby if twin.at_rest else None,
        standby_share=standby / whole.modelled_energy if twin.at_rest and whole.modelled_energy > 0 else None,
        returned_energy_j=twin.returned_energy(motion),
    )
