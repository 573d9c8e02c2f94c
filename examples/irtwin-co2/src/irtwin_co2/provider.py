"""The provider of emissions: the energy of a run times what the grid emits."""

from __future__ import annotations

import tomllib
from importlib.resources import files

from irtwin.providers.names import run_iri
from irtwin.providers.provider import Made
from irtwin.storage.database import Workspace
from irtwin.storage.schema import RunEnergy, RunRow
from irtwin_co2.tables import RunEmission

JOULES_PER_KWH = 3.6e6


def provide(workspace: Workspace, run_id: str) -> Made:
    """Make a run's RunEmission."""
    grid = tomllib.loads(files("irtwin_co2").joinpath("grid.toml").read_text(encoding="utf-8"))
    with workspace.reading() as session:
        robot_id = session.get_one(RunRow, run_id).robot_id
        energy = session.get_one(RunEnergy, run_id).energy_consumption_j
    grams = 1000 * grid["kg_co2_per_kwh"] * energy / JOULES_PER_KWH
    return Made(robot_id, [run_iri(run_id)], [RunEmission(run_id=run_id, co2_g=grams)])
