"""The provider of a run's energy: what it took, what its twin says that it took, and where it went."""

from __future__ import annotations

from collections import defaultdict

import numpy as np
import pyarrow as pa
from scipy.integrate import cumulative_trapezoid
from sqlalchemy import select

from irtwin.identification.validation import APART
from irtwin.providers import live_energy
from irtwin.providers.motions import robot_motions
from irtwin.providers.provider import Made
from irtwin.providers.records import run_iri, twin_iri
from irtwin.signals.channels import CHANNELS, Signals, columns_of
from irtwin.signals.motion import Motion
from irtwin.storage import schema
from irtwin.storage.database import Workspace
from irtwin.storage.files import inside
from irtwin.twin.files import from_json
from irtwin.twin.twin import LedgerEntry, Twin
from irtwin.twin.validate import validate


def provide(workspace: Workspace, run_id: str) -> Made:
    """Make a run's energy, its ledger, and its modelled series; of a live run its gap as well."""
    with workspace.reading() as session:
        run = session.get_one(schema.Run, run_id)
    if run.role == schema.LIVE:
        return live_energy.provide(workspace, run_id)
    robot_id = run.robot_id
    with workspace.reading() as session:
        row = session.scalars(select(schema.Twin).where(schema.Twin.robot_id == robot_id)).one()
        role = session.get_one(schema.TwinRun, (row.twin_id, run_id))
    document = workspace.read_document(row.file, row.sha256).decode()
    twin = from_json(document, inside(workspace.folder, row.file))
    motion = robot_motions(workspace, robot_id).motions[run_id]
    ledger = twin.ledger(motion)
    return Made(
        robot_id=robot_id,
        used=[run_iri(run_id), twin_iri(row.twin_id)],
        rows=[
            _run_energy(run_id, row.twin_id, role, twin, motion, ledger),
            *(
                schema.EnergyShare(
                    twin_id=row.twin_id,
                    run_id=run_id,
                    effect=entry.effect,
                    place=entry.joint or "robot",
                    joint=entry.joint,
                    robot_id=robot_id,
                    energy_j=entry.energy,
                )
                for entry in ledger
            ),
            *(
                schema.JointEnergy(run_id=run_id, joint=joint, robot_id=robot_id, energy_j=energy)
                for joint, energy in _per_joint(ledger).items()
            ),
        ],
        series={run_id: modelled_series(twin, motion, held_out(role, motion))},
    )


def held_out(role: schema.TwinRun, motion: Motion) -> np.ndarray:
    """Return which samples took no part in the fit, (N,) bool."""
    if role.held_out_from_s is not None:
        return motion.time >= role.held_out_from_s
    return np.full(len(motion.time), role.part == "held_out")


def modelled_series(twin: Twin, motion: Motion, judged: np.ndarray) -> pa.Table:
    """Return measured (filtered) and modelled torque, power and energy side by side, a row a sample.

    Columns: time, held_out, q_J, tau_J, tau_J_model, power, power_model, energy, energy_model; those that nothing
    measured are left out. Energies are cumulative, J.
    """
    names = twin.robot.joint_names
    measured = Signals(motion.time, motion.q, torque=twin.measured_torque(motion))
    columns = {"time": motion.time, "held_out": judged, **columns_of(measured, names)}
    columns |= {
        f"{CHANNELS['torque'].column(name)}_model": of for name, of in zip(names, twin.torque(motion).T, strict=True)
    }
    for suffix, power in (("", motion.power), ("_model", twin.power(motion))):
        if power is not None:
            columns[f"{CHANNELS['power'].prefix}{suffix}"] = power
            columns[f"energy{suffix}"] = cumulative_trapezoid(power, motion.time, initial=0.0)
    return pa.table(columns)


def _run_energy(
    run_id: str, twin_id: str, role: schema.TwinRun, twin: Twin, motion: Motion, ledger: tuple[LedgerEntry, ...]
) -> schema.RunEnergy:
    (whole,) = validate(twin, [motion])
    start = int(np.argmax(held_out(role, motion)))
    judged = whole if start == 0 else validate(twin, [motion.part(start, len(motion.time))])[0]
    power = twin.power(motion) if motion.power is None else motion.power
    at_rest = {effect.id for effect in twin.stack.effects if effect.drawn_at_rest}
    standby = sum(entry.energy for entry in ledger if entry.effect in at_rest)
    electrical = any(effect.electrical_loss for effect in twin.stack.effects)
    return schema.RunEnergy(
        run_id=run_id,
        twin_id=twin_id,
        part=role.part,
        energy_consumption_j=whole.modelled_energy if whole.measured_energy is None else whole.measured_energy,
        energy_from="measured" if motion.power is not None else "modelled" if electrical else "mechanical",
        run_power_w=float(np.mean(power)),
        peak_power_w=float(np.max(power)),
        measured_energy_j=whole.measured_energy,
        modelled_energy_j=whole.modelled_energy,
        energy_error_percent=None if role.part == APART else judged.energy_error,
        power_rmse_w=None if role.part == APART else judged.power_rmse,
        standby_energy_j=standby if at_rest else None,
        standby_share=standby / whole.modelled_energy if at_rest and whole.modelled_energy > 0 else None,
        returned_energy_j=returned_energy(twin, motion),
    )


def returned_energy(twin: Twin, motion: Motion) -> float:
    """Return the mechanical energy that the joints gave back while they braked, J, positive."""
    given = np.maximum(-twin.joint_torque(motion) * motion.dq, 0.0)
    return float(np.trapezoid(given.sum(axis=1), motion.time))


def _per_joint(ledger: tuple[LedgerEntry, ...]) -> dict[str, float]:
    energies: dict[str, float] = defaultdict(float)
    for entry in ledger:
        if entry.joint is not None:
            energies[entry.joint] += entry.energy
    return dict(energies)
