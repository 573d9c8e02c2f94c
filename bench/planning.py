"""Plan motions of the KR6 by the twin of its shipped logs: how long that takes, what is kept clear, what energy saves.

Processor seconds are counted, the import of the libraries left out. Each task is planned for least time and for least
energy, in the time of the fastest motion and in more. The rivals in more time: the fastest motion and a wait at the
goal, and the fastest motion slowed evenly.
"""

from __future__ import annotations

import argparse
import tempfile
from dataclasses import replace
from pathlib import Path
from time import process_time

import numpy as np

from irtwin import identify
from irtwin.planning.plan import Plan, Task, plan
from irtwin.planning.poses import Pose
from irtwin.robot.collision import CollisionModel, Obstacle
from irtwin.robot.urdf import read_urdf
from irtwin.signals.motion import Motion
from irtwin.twin.twin import Twin
from irtwin.workflow import unpack_demo

_DOWN = (0.0, np.pi / 2, 0.0)
TASKS = {
    "around a box": Task(
        Pose((0.45, -0.35, 0.3), _DOWN), Pose((0.45, 0.35, 0.3), _DOWN), [Obstacle((0.55, 0, 0.3), (0.2, 0.2, 0.6))]
    ),
    "across": Task(np.array([-1.0, -1.2, 1.5, 0.0, 0.8, 0.0]), np.array([1.2, -0.4, 0.6, 1.0, -0.8, 1.5])),
    "half round": Task(np.array([-1.5, -0.6, 1.2, 0.0, 0.9, 0.0]), np.array([1.5, -0.6, 1.2, 0.0, 0.9, 0.0])),
    "lift": Task(np.array([0.8, 0.3, 1.0, 0.5, 0.8, 0.0]), np.array([-0.8, -1.6, 0.6, -0.5, -0.6, 1.0])),
}


def waiting(twin: Twin, fastest: Plan, seconds: float) -> float:
    """Return the energy of the fastest motion and the wait until `seconds`, J."""
    q = np.repeat(fastest.motion.q[-1:], 20, axis=0)
    rest = Motion(np.linspace(0, 1, 20), q, 0 * q, 0 * q, run="wait")
    assert fastest.price is not None
    return fastest.price.energy.value + (seconds - fastest.seconds) * float(twin.power(rest)[0])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("urdf", nargs="?", type=Path, help="a KR6 with collision shapes; default: the shipped one")
    parser.add_argument("--times", type=float, nargs="*", default=[1.0, 1.5, 2.0], help="cycle times over the shortest")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        twin = identify(unpack_demo(Path(folder)))
    if given.urdf:
        shapes = read_urdf(given.urdf)
        twin = replace(twin, robot=replace(twin.robot, urdf=shapes.urdf, links=shapes.links))
    standby = sum(parameter.value for parameter in twin.parameters if parameter.effect == "standby_power")
    print(f"Standby {standby:.0f} W; in brackets: of what standby leaves.\n")
    plan(twin, TASKS["lift"])  # imports the libraries
    print(
        "| task | cycle s | planned in s | clearance mm | wait J | slowed J | least J | below waiting | below slowed |"
    )
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    for name, task in TASKS.items():
        began = process_time()
        fastest = plan(twin, task)
        took = process_time() - began
        met, _ = CollisionModel(twin.robot, task.obstacles).first_meeting(fastest.motion.time, fastest.motion.q)
        assert met is None
        print(
            f"| {name}: least time | {fastest.seconds:.2f} | {took:.2f} | {1000 * fastest.clearance:.1f} |", flush=True
        )
        for factor in given.times:
            seconds = factor * fastest.seconds
            slowed = plan(twin, replace(task, seconds=seconds))
            began = process_time()
            least = plan(twin, replace(task, seconds=seconds, least_energy=True))
            took = process_time() - began
            assert slowed.price and least.price
            rivals = waiting(twin, fastest, seconds), slowed.price.energy.value
            energy = least.price.energy.value
            print(
                f"| {name}: least energy | {seconds:.2f} | {took:.1f} | {1000 * least.clearance:.1f} | "
                f"{rivals[0]:.1f} | {rivals[1]:.1f} | {energy:.1f} | "
                + " | ".join(
                    f"{100 - 100 * energy / rival:.1f} % ({100 * (rival - energy) / (rival - standby * seconds):.0f} %)"
                    for rival in rivals
                )
                + " |",
                flush=True,
            )


if __name__ == "__main__":
    main()
