"""Does gravity turn the joints as bodies that lie where those of the URDF do would, whatever they weigh?

The torque of gravity at a joint is a sine of the joint's own angle; its phase says where about the axis the load beyond
the joint hangs. Bodies of other masses change its size, a tool or a cable its phase a little. A load that hangs far
from where the URDF has it is another robot's, or angles are counted from another zero, or the base stands otherwise.
Free bodies, as `whole_body` has them, would explain that as well, by centres of mass beside the links.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from irtwin.check.moving import Moving
from irtwin.check.rigid_body import FEW_ROWS, RigidBodyRows, friction, rows_of
from irtwin.check.robust_fit import fit
from irtwin.robot.description import Robot
from irtwin.signals.finding import LogFinding

_LOADED = 0.2  # of the most loaded joint's gravity, by the URDF: what less turns is as much tool as robot
_SEEN = 0.15  # of the variance that losses, inertia and springs leave of a torque: gravity must explain as much
_SURE = 4.0  # standard deviations
_TURNED = np.deg2rad(25)  # own logs, 9 measured and 57 simulated: surely 2 at most; others' robots: 40 and more


@dataclass(frozen=True)
class _Load:
    """By how much (rad) the load of a joint, from 0, hangs about its axis from where the URDF has it."""

    joint: int
    turned: float
    deviation: float

    @property
    def surely(self) -> float:
        """By how much at least."""
        return abs(self.turned) - _SURE * self.deviation


def gravity_findings(robot: Robot, moving: Moving) -> list[LogFinding]:
    """Return the clearest of the joints that gravity turns as no load of this robot would.

    What a load is turned by, those further out are turned by, too: one that surely is not speaks for all before it.
    """
    rows = rows_of(robot, moving, FEW_ROWS)
    if rows is None:
        return []
    loads = list(_loads(robot, rows, moving.joints))
    right = max((load.joint for load in loads if abs(load.turned) + _SURE * load.deviation < _TURNED), default=-1)
    turned = [load for load in loads if load.surely > _TURNED and load.joint > right]
    if len(turned) < len(loads) and all(abs(load.turned) > np.pi - _TURNED for load in turned):
        return []  # none, or the sign of one torque
    return [_finding(max(turned, key=lambda load: load.surely), robot, moving)] if turned else []


def _loads(robot: Robot, rows: RigidBodyRows, joints: np.ndarray) -> Iterator[_Load]:
    """Yield what each of the `joints` (n,) that turns and bears the arm says."""
    gravity = _gravity(rows)
    inertia = rows.nominal() - gravity
    sizes = np.sqrt(np.mean(gravity**2, axis=0))
    for joint in np.flatnonzero(joints & (sizes > 0) & (sizes >= _LOADED * sizes.max())).tolist():
        if robot.joints[joint].kind == "prismatic":
            continue
        q, speed, torque = rows.q[:, joint], rows.dq[:, joint], rows.torque[:, joint]
        springs = (np.cos(q), np.sin(q), q)  # a balancer or a hose goes with its own joint's angle alone
        beside = np.column_stack([inertia[:, joint], rows.ddq, friction(speed), *springs])
        loads = np.column_stack([gravity[:, joint], _gravity(rows, joint)[:, joint]])
        load = _load(joint, loads, beside, torque)
        if load is not None:
            yield load


def _load(joint: int, loads: np.ndarray, beside: np.ndarray, torque: np.ndarray) -> _Load | None:
    """Fit a torque (N,) by gravity (N, 2), of the joint and a quarter further; None where it is not seen."""
    both = np.hstack([loads, beside])
    fitted = fit(both, torque)
    left, without = (np.var(torque - columns @ fit(columns, torque).coefficients) for columns in (both, beside))
    if without <= np.finfo(float).eps * np.mean(torque**2) or 1 - left / without < _SEEN:
        return None
    a, b = fitted.coefficients[:2]
    slope = np.array([-b, a]) / (a**2 + b**2)
    deviation = float(np.sqrt(max(slope @ fitted.covariance[:2, :2] @ slope, 0.0)))
    return _Load(joint, float(np.arctan2(b, a)), deviation)


def _gravity(rows: RigidBodyRows, quarter: int | None = None) -> np.ndarray:
    """Return gravity's torque by the URDF's bodies (N, n), one joint a quarter further than it is."""
    still = np.zeros_like(rows.q)
    further = np.pi / 2 * (np.arange(rows.q.shape[1]) == quarter)
    return replace(rows, q=rows.q + further, dq=still, ddq=still).nominal()


def _finding(load: _Load, robot: Robot, moving: Moving) -> LogFinding:
    degrees, name = float(np.rad2deg(abs(load.turned))), robot.joints[load.joint].name
    deviation = float(np.rad2deg(load.deviation))
    return LogFinding(
        "other_robot", "robot.urdf", moving.names, certain=True, mended=False,
        evidence={"turned_deg": round(degrees, 1), "deviation_deg": round(deviation, 1)},
        say="robot.urdf is not of the robot that was logged, or positions have other zeros, directions or another "
        f"order than its joints, or its base stands otherwise: gravity turns {name} as if its load hung {degrees:.0f} "
        "degrees about the axis from where the URDF has it, which no masses explain; give the description of that "
        "robot, or correct the positions or the base",
    )  # fmt: skip
