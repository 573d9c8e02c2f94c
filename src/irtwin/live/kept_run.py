"""A live run that is over: from its journal into the database, with its energy; after a crash as well."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np

from irtwin.announce import Announce
from irtwin.errors import InputError
from irtwin.live import live_run
from irtwin.providers import live_energy
from irtwin.providers.live_energy import KnownTwin, LiveEnergy
from irtwin.storage.database import Workspace
from irtwin.storage.files import InsidePath, remove
from irtwin.storage.journal import DamagedJournal, Header, left_behind, read_journal
from irtwin.storage.rows import Tables, Values, tables_of
from irtwin.storage.schema import Activity, RunEnergy, RunRow, relation_to


def keep(place: Workspace, header: Header, samples: np.ndarray, counts: Values, announce: Announce) -> Tables:
    """Put a run into the database, unless it is there; return its rows.

    counts: what its live_state says beside. Its energy is worked out from all samples once more, so it is the same
    after a crash. Where its twin's file is gone, or its plan, the run is kept without, and that is announced.
    """
    if header.performs is not None and not _has(place, RunRow, header.performs):
        announce(f"{header.run_id}: its plan {header.performs} is no more; kept without")
        header = replace(header, performs=None)
    tables, series = live_run.closed_rows(header, samples, counts)
    twin = _twin(place, header, announce)
    if twin is None:  # what was measured depends on no twin: it is part of the watching
        tables = live_run.together(tables, _measured(header, samples))
    known = _has(place, RunEnergy, header.run_id)
    if not _has(place, RunRow, header.run_id):  # else a crash came right here
        others = {name: rows for name, rows in tables.items() if name != RunRow.__tablename__}
        place.keep_run(RunRow(**tables[RunRow.__tablename__][0]), series, others)
    if twin is not None and not known:
        tables = live_run.together(tables, _keep_energy(place, header, tables["activity"][0]))
    return tables


def left_by_a_crash(folder: Path, announce: Announce) -> list[tuple[InsidePath, Header, np.ndarray]]:
    """Return the journals of runs that a crash ended; what cannot be read is put aside and announced."""
    left = []
    for path in left_behind(folder):
        try:
            header, samples = read_journal(path)
        except DamagedJournal as error:
            aside = path.with_suffix(".damaged")
            path.rename(aside)
            announce(f"{error}; its samples are not in the graph; the file is kept as {aside}")
            continue
        except ValueError:
            announce(f"{path}: a crash ended this journal before its first sample; it is deleted")
            remove(path)
            continue
        announce(f"{header.run_id}: a crash ended this run; its {len(samples)} samples on disk are kept")
        left.append((path, header, samples))
    return left


def energy_tables(energy: LiveEnergy, header: Header, began: float) -> Tables:
    """Return the rows of a run's energy with their activity, which was from `began` on, s since 1970."""
    activity_id = live_run.activities(header.run_id)[1]
    if energy.known is None:
        return energy.tables(live_run.activities(header.run_id)[0])
    made = energy.tables(activity_id)
    uses = live_energy.used(header.run_id, energy.known)
    return _of_activity(live_run.activity(header, activity_id, "energy", began), uses, made) if made else {}


def _of_activity(about: Values, read: Iterable[str], made: Tables) -> Tables:
    """Return the rows of an activity, of what it read, and of what it made."""
    uses = [{"activity_id": about["activity_id"], "entity": each, "relation": relation_to(each)} for each in read]
    return {"activity": [about], "activity_use": uses, **made}


def _has(place: Workspace, kind: type[RunRow | RunEnergy], run_id: str) -> bool:
    with place.reading() as session:
        return session.get(kind, run_id) is not None


def _twin(place: Workspace, header: Header, announce: Announce) -> KnownTwin | None:
    try:
        return live_energy.known_twin(place, header.robot_id)
    except InputError as error:
        announce(f"{header.run_id}: kept without what its twin says: {error}")
        return None


def _measured(header: Header, samples: np.ndarray) -> Tables:
    energy = LiveEnergy(header.run_id, header.robot_id, live_run.joints_of(header.columns), None, kind=header.kind)
    energy.feed(dict(zip(header.columns, samples.T, strict=True)), last=True)
    return energy_tables(energy, header, float(samples[0, 0]))


def _keep_energy(place: Workspace, header: Header, watched: Values) -> Tables:
    made = live_energy.provide(place, header.run_id)
    if not made.rows:
        return {}
    about = {**watched, "activity_id": live_run.activities(header.run_id)[1], "provider": "energy"}
    place.replace_activity(Activity(**about), made.used, made.rows, made.series)
    return _of_activity(about, sorted(set(made.used)), tables_of(made.rows))
