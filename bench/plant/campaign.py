"""A campaign: the runs of one robot over some days, in order, each as warm as the ones before left it."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from irtwin.demo.plant.arm import PlantPayload
from irtwin.demo.plant.machine import Drawings, build
from irtwin.demo.plant.motion import PlantMotion, check, programme
from irtwin.demo.plant.simulate import PlantRecording, simulate
from irtwin.demo.plant.thermal import Thermal
from plant.drawings import read_drawings
from plant.fourier import fourier

FOLDER = Path(__file__).parent
CAMPAIGNS = FOLDER / "campaigns"


@dataclass(frozen=True)
class Run:
    """One planned run. The robot `worked` (minutes) before it, as in the run before, and stood still until then."""

    name: str
    motion: str
    started: datetime
    repeat_of: str | None = None
    worked: float = 0.0
    payload_mass: float = 0.0
    payload_com: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def payload(self) -> PlantPayload:
        return PlantPayload(self.payload_mass, self.payload_com)


@dataclass(frozen=True)
class Campaign:
    """A plan read from campaigns/NAME.toml."""

    name: str
    robot: str
    seed: int
    motions: dict[str, dict[str, Any]]
    runs: tuple[Run, ...]


def read_campaign(name: str) -> Campaign:
    """Read campaigns/NAME.toml."""
    table = tomllib.loads((CAMPAIGNS / f"{name}.toml").read_text(encoding="utf-8"))
    runs = tuple(Run(**entry) for entry in table["run"])
    return Campaign(table["name"], table["robot"], table["seed"], table["motion"], runs)


def carry_out(campaign: Campaign) -> Iterator[tuple[Run, PlantMotion, PlantRecording]]:
    """Simulate the runs one after another."""
    machine = build(read_drawings(campaign.robot), campaign.seed)
    thermal = Thermal(machine.drawings.thermal)
    before: tuple[Run, PlantRecording] | None = None
    for number, run in enumerate(campaign.runs):
        if before is not None:
            _pass_time(thermal, *before, run)
        motion = motion_of(campaign.motions[run.motion], machine.drawings)
        recording = simulate(machine, motion, run.payload, thermal, seed=10 + number)
        before = run, recording
        yield run, motion, recording


def _pass_time(thermal: Thermal, run: Run, recording: PlantRecording, following: Run) -> None:
    gap = (following.started - run.started).total_seconds() - float(recording.time[-1])
    worked = 60 * following.worked
    if gap < worked:
        raise ValueError(f"{following.name} starts {gap:.0f} s after {run.name}; it worked {worked:.0f} s in between")
    nothing = np.zeros_like(recording.mean_body_loss)
    thermal.wait(nothing, nothing, gap - worked)
    thermal.wait(recording.mean_winding_loss, recording.mean_body_loss, worked)


def motion_of(entry: dict[str, Any], drawings: Drawings) -> PlantMotion:
    """Return the motion of a campaign's [motion.NAME] table, checked against the robot's limits."""
    if "file" in entry:
        motion = fourier(FOLDER / entry["file"], drawings.step, entry.get("speed", 1.0))
    else:
        motion = programme(entry["moves"], drawings.limits, drawings.step, entry["cycles"])
    check(motion, drawings.limits)
    return motion
