"""What a campaign leaves beside its runs: dataset.toml."""

from __future__ import annotations

from irtwin.demo.plant.machine import Drawings
from plant.campaign import Campaign, Run

EFFECTS = (
    "rigid_body",
    "rotor_inertia",
    "coulomb_friction",
    "viscous_friction",
    "torque_offset",
    "mechanical_power",
    "standby_power",
    "copper_loss",
)


def describe(campaign: Campaign, drawings: Drawings) -> str:
    """Return the text of dataset.toml: what the maker says, what the operator noted."""
    head = f"""\
# Made by `python -m plant {campaign.robot}` in bench/; a change here is lost when it is made again.
[robot]
name = "{campaign.name}"
urdf = "robot.urdf"
manufacturer = "{drawings.manufacturer}"
type = "articulated"
weight = {drawings.weight}
rated_payload = {drawings.rated_payload}
ambient_temperature = {drawings.thermal.ambient}
power_at = "mains"
torque = "motor current times nominal torque constant times gear ratio"
power = "meter in the mains lead, controller and drives together"
temperature = "housing of each joint's motor"
simulated = true
simulator = "irtwin plant: MuJoCo forward dynamics in closed loop with drives, DC bus and sensors"
seed = {campaign.seed}
"""
    joints = [_data_sheet(drawings, index) for index in range(len(drawings.joints))]
    twin = "[twin]\neffects = [\n" + "".join(f'    "{effect}",\n' for effect in EFFECTS) + "]\n"
    return "\n".join([head, *joints, twin, *(_entry(run) for run in campaign.runs)])


def _data_sheet(drawings: Drawings, index: int) -> str:
    drive = drawings.drive
    return f"""\
[robot.joint.{drawings.joints[index]}]
gear_ratio = {drive.gear_ratio[index]:.1f}
rotor_inertia = {drive.joint_inertia[index]:.4f}
torque_constant = {drive.joint_torque_constant[index]:.2f}
winding_resistance = {drive.resistance[index]:.2f}
"""


def _entry(run: Run) -> str:
    lines = ["[[run]]", f'file = "runs/{run.name}.parquet"', 'role = "observed"']
    lines += [f"payload_mass = {run.payload_mass}", f"payload_com = {list(run.payload_com)}"]
    if run.repeat_of is not None:
        lines.append(f'repeat_of = "runs/{run.repeat_of}.parquet"')
    lines += [f"started = {run.started.isoformat().replace('+00:00', 'Z')}", f'programme = "{run.motion}"']
    return "\n".join(lines) + "\n"
