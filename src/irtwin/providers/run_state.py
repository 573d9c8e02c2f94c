"""The provider of a run's state: how much of it passed idle, and where it ended.

Where a meter alone was logged, its power tells that, and energy, standby and cycles with it.
"""

from __future__ import annotations

from irtwin.providers.motions import robot_motions
from irtwin.providers.provider import Made
from irtwin.providers.records import inputs, is_described
from irtwin.signals.load_profile import Cycles, by_hour, load_profile
from irtwin.signals.motion import standstill
from irtwin.storage.database import Workspace
from irtwin.storage.energy_schema import MeteredLoad, SupplyStateRow
from irtwin.storage.schema import SIMULATED, JointState, RunEnergy, RunRow, RunState


def provide(workspace: Workspace, run_id: str) -> Made:
    """Make a run's RunState and the JointState of each joint at its last sample; of a meter's log what power says."""
    run = workspace.row(RunRow, run_id)
    robot_id = run.robot_id
    if not is_described(workspace, robot_id):
        return _metered(workspace, run)
    known = robot_motions(workspace, robot_id)
    motion = known.motions[run_id]
    still = standstill(motion)
    state = RunState(
        run_id=run_id,
        current_state="standstill" if still[-1] else "moving",
        idle_share=float(still.mean()),
    )
    joints = [
        JointState(
            run_id=run_id,
            joint=joint.name,
            robot_id=robot_id,
            joint_position_rad=float(motion.q[-1, place]),
            joint_speed_rad_s=float(motion.dq[-1, place]),
            joint_acc_rad_s2=float(motion.ddq[-1, place]),
            joint_torque_nm=None if motion.torque is None else float(motion.torque[-1, place]),
            joint_temperature_degc=None if motion.temperature is None else float(motion.temperature[-1, place]),
        )
        for place, joint in enumerate(known.robot.joints)
    ]
    return Made(robot_id, inputs(workspace, robot_id, [run_id]), [state, *joints])


def _metered(workspace: Workspace, run: RunRow) -> Made:
    """Make a run's RunState, RunEnergy, MeteredLoad, and a SupplyState for each level of its power."""
    robot_id, run_id, began = run.robot_id, run.run_id, run.start_time
    assert began is not None
    samples = workspace.read_series(run_id)
    time, power = (samples[name].to_numpy().astype(float) for name in ("time", "power"))
    profile = load_profile(time, power)
    working = sum(state.seconds for state in profile.states if state.name == "working")
    on = sum(state.seconds for state in profile.states if state.name != "off")
    standby = None if profile.standby is None else profile.standby * on
    hour = began.replace(minute=0, second=0, microsecond=0)
    hours = by_hour(time, power, (began - hour).total_seconds())
    cycles = profile.cycles or Cycles(0, 0.0, 0.0)
    read = inputs(workspace, robot_id, [run_id])
    rows = [
        RunState(
            run_id=run_id,
            current_state="standstill" if profile.standing[-1] else "moving",
            idle_share=min(max(1.0 - working / run.run_time_s, 0.0), 1.0),
        ),
        RunEnergy(
            run_id=run_id,
            energy_consumption_j=None if run.role == SIMULATED else profile.energy,
            energy_from="measured",
            run_power_w=profile.energy / run.run_time_s,
            peak_power_w=float(power.max()),
            measured_energy_j=profile.energy,
            standby_energy_j=standby,
            standby_share=None if standby is None or profile.energy <= 0 else min(standby / profile.energy, 1.0),
        ),
        MeteredLoad(
            run_id=run_id,
            standby_power_w=profile.standby,
            cycle_count=cycles.count or None,
            cycle_time_s=cycles.seconds or None,
            cycle_energy_j=cycles.energy or None,
            first_hour=hour,
            energy_by_hour_j=",".join(f"{joules:.6g}" for joules in hours),
        ),
        *(
            SupplyStateRow(
                run_id=run_id, number=number, robot_id=robot_id, state=state.name, seconds=state.seconds,
                power_w=state.power, differs=False,
            )
            for number, state in enumerate(profile.states, start=1)
        ),
    ]  # fmt: skip
    return Made(robot_id, read, rows, metered=[iri for iri in read if iri.startswith("series/")])
