"""Let the simulated KR6 carry out the motion of `irtwin demo --case-study`; writes the log that it is measured by.

In bench/: `python case_study_log.py ../src/irtwin/demo/kuka_kr6_r700_case_study/process_measured.parquet`
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np
from scipy.interpolate import BPoly

from irtwin import case_study
from irtwin.location import Location
from irtwin.planning.plan import Plan
from plant.arm import Payload
from plant.campaign import check, read_campaign
from plant.dataset import write_run
from plant.machine import build, read_drawings
from plant.motion import Motion
from plant.simulate import simulate
from plant.thermal import Thermal

_SEED = 100  # of the run's noise and friction; the robot is the demo's
_WARM_UP = 1800.0  # s at work before it


def main() -> None:
    """Plan as the command does, and simulate."""
    with tempfile.TemporaryDirectory() as folder:
        workspace = Location(Path(folder))
        case_study.identify(case_study.unpack(workspace.folder), workspace)
        plan, kept = case_study.plan_process(workspace)
    campaign = read_campaign("kuka_kr6_r700")
    machine = build(read_drawings(campaign.robot), campaign.seed)
    motion = _motion(plan, machine.drawings.step)
    check(motion, machine.drawings.limits)
    thermal = Thermal(machine.drawings.thermal)
    first = simulate(machine, motion, Payload(), thermal, _SEED - 1)
    thermal.wait(first.mean_winding_loss, first.mean_body_loss, _WARM_UP)
    recording = simulate(machine, motion, Payload(), thermal, _SEED)
    write_run(Path(sys.argv[1]), recording, machine.drawings.joints)
    print(f"planned: {kept.price}")
    print(f"measured: {np.trapezoid(recording.power, recording.time):.1f} J, {recording.power.max():.0f} W at most")


def _motion(plan: Plan, step: float) -> Motion:
    """Return the plan at the controller's steps: the polynomial of fifth degree through its samples."""
    planned = plan.motion
    samples = np.stack([planned.q, planned.dq, planned.ddq], axis=1)
    curve = BPoly.from_derivatives(planned.time, samples)
    time = step * np.arange(round(plan.seconds / step) + 1)
    return Motion(curve(time), curve(time, 1), curve(time, 2))


if __name__ == "__main__":
    main()
