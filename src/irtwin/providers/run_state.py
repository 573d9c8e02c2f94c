"""The provider of a run's state: how much of it passed idle, and where it ended."""

from __future__ import annotations

from irtwin.providers import meter_log
from irtwin.providers.motions import robot_motions
from irtwin.providers.provider import Made
from irtwin.providers.records import inputs, is_described
from irtwin.signals.motion import standstill
from irtwin.storage.database import Workspace
from irtwin.storage.schema import JointState, RunRow, RunState


def provide(workspace: Workspace, run_id: str) -> Made:
    """Make a run's RunState and the JointState of each joint at its last sample; of a meter's log what power says."""
    with workspace.reading() as session:
        robot_id = session.get_one(RunRow, run_id).robot_id
    if not is_described(workspace, robot_id):
        return meter_log.provide(workspace, run_id)
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
