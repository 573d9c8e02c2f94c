"""Bodies and rotors of a model beside those of a twin: told by link, and as the model's file is to have them.

A robot's torque shows sums over links alone, and a link's inertia about its own axis beside its rotor's: what is one's
and what the other's is the twin's prior. So all of them are taken in, or none.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin

from irtwin.document.document import CauseParameter
from irtwin.effects.catalogue import catalogue
from irtwin.effects.effect import NORMAL
from irtwin.gap.thresholds import DEFAULT
from irtwin.identification.consistent_bodies import known_near
from irtwin.robot.pseudo_inertia import consistent, pseudo_inertias
from irtwin.simulator.axes import model_axes, poses_of, robot_axes
from irtwin.simulator.engine import mujoco
from irtwin.simulator.model_file import Bodies
from irtwin.twin.twin import Twin

if TYPE_CHECKING:
    from irtwin.simulator.model import Model

_NUMBERS = (
    "mass",
    "centre_x",
    "centre_y",
    "centre_z",
    *(f"inertia_{at}" for at in ("xx", "xy", "yy", "xz", "yz", "zz")),
)
_UNITS = ("kg", *("m",) * 3, *("kg m^2",) * 6)
_STEP = 1e-6  # of an inertial parameter's size: by it slopes are found
_ROTOR = "armature"
_OFF = DEFAULT.matters.number


@dataclass(frozen=True)
class _Moved:
    """What a joint moves, as far as the next one: `link` is the body that it turns, `inertia` all, in its frame.

    `frame`: the joint's in the link's; `others`: bodies that are fixed to the link, by name, in its frame; `loose`:
    what other joints move beyond it, the same.
    """

    link: str
    inertia: pin.Inertia
    frame: pin.SE3
    others: Bodies
    loose: pin.Inertia

    def bodies(self, whole: pin.Inertia) -> Bodies | None:
        """Return the bodies that are `whole` together, in the joint's frame; None where they are not consistent.

        Those that are fixed to the link stay as they are, if the rest is a body; else the link has all.
        """
        own = self.frame.act(whole).toDynamicParameters() - self.loose.toDynamicParameters()
        rest = own - sum((body.toDynamicParameters() for body in self.others.values()), np.zeros(10))
        if consistent(rest[None])[0]:
            return {self.link: pin.Inertia.FromDynamicParameters(rest)}
        if consistent(own[None])[0]:
            none = dict.fromkeys((name for name, body in self.others.items() if body.mass), pin.Inertia.Zero())
            return none | {self.link: pin.Inertia.FromDynamicParameters(own)}
        return None


@dataclass(frozen=True)
class BodiesBeside:
    """The bodies and rotors of a model, beside those of a twin that was fitted to its robot."""

    model: Model
    twin: Twin

    @property
    def told(self) -> tuple[CauseParameter, ...]:
        """What is off by so much that it matters: of links mass, centre, inertia about that; and rotors.

        Intervals are of the change, by data and prior: one that holds zero is of what the data do not carry.
        """
        links = zip(self.twin.robot.joint_names, self._moved or (), strict=False)
        of_links = [number for joint, moved in links for number in self._of_link(joint, moved)]
        rotors = (self._rotor(joint) for joint in self.rotors)
        return (*of_links, *(rotor for rotor in rotors if abs(rotor.value) > _OFF * (rotor.simulator or 0.0)))

    @cached_property
    def rotors(self) -> Mapping[str, float]:
        """The inertias of rotors that the model's file is to have, by joint: zero where the twin has it in the link."""
        places = {joint: self._places(joint, of_rotor=True) for joint in self.twin.robot.joint_names}
        held = self.model.file.holds(_ROTOR)
        return {joint: float(self._values(own)[0]) if own else 0.0 for joint, own in places.items() if held}

    @cached_property
    def written(self) -> Bodies:
        """The bodies that the model's file is to have, by name; none where it cannot hold those of each joint."""
        bodies: dict[str, pin.Inertia] = {}
        for joint, moved in zip(self.twin.robot.joint_names, self._moved or (), strict=False):
            own = moved.bodies(pin.Inertia.FromDynamicParameters(self._values(self._places(joint))))
            if own is None or not all(map(self.model.file.holds_body, own)):
                return {}
            bodies |= own
        return bodies

    def _places(self, joint: str, of_rotor: bool = False) -> list[int]:
        """Return where the twin's parameters of a joint's body stand, or of its rotor."""
        effects = catalogue()
        return [
            place
            for place, own in enumerate(self.twin.parameters)
            if own.joint == joint and own.effect in effects
            if (effects[own.effect].in_mjcf.get(own.name) == _ROTOR if of_rotor else effects[own.effect].bodies)
        ]

    def _values(self, places: list[int]) -> np.ndarray:
        return np.array([self.twin.parameters[place].value for place in places])

    @cached_property
    def _whole_covariance(self) -> np.ndarray:
        """The covariance of the twin's parameters by data and by the pull to the described bodies."""
        count = len(self.twin.parameters)
        known, given = np.zeros((count, count)), self.twin.covariance
        if given is None:
            return known
        for places in map(self._places, self.twin.robot.joint_names):
            known[np.ix_(places, places)] = known_near(pseudo_inertias(self._values(places)[None]))[0]
        return np.asarray(given @ np.linalg.inv(np.eye(count) + known @ given))

    def _covariance(self, places: list[int]) -> np.ndarray:
        return np.asarray(self._whole_covariance[np.ix_(places, places)])

    def _rotor(self, joint: str) -> CauseParameter:
        places = self._places(joint, of_rotor=True)
        names = [(self.twin.parameters[place].name, self.twin.parameters[place].unit) for place in places]
        name, unit = next(iter(names), (_ROTOR, "kg m^2"))
        variance = float(self._covariance(places).sum())
        return _number(name, joint, unit, self.model.numbers(joint)[_ROTOR], self.rotors[joint], variance)

    def _of_link(self, joint: str, moved: _Moved) -> Iterator[CauseParameter]:
        places = self._places(joint)
        values = self._values(places)
        simulator, robot, slope = _numbers(moved.inertia.toDynamicParameters()), _numbers(values), _slope(values)
        variances = np.diag(slope @ self._covariance(places) @ slope.T)
        for k in _off(simulator, robot, self.rotors.get(joint, 0.0)):
            name = f"{_NUMBERS[k]} ({moved.link})"
            yield _number(name, joint, _UNITS[k], float(simulator[k]), float(robot[k]), float(variances[k]))

    @cached_property
    def _moved(self) -> tuple[_Moved, ...] | None:
        """What the joints move; None where two of them move one body."""
        compiled, robot = self.model.unfused, self.twin.robot
        places = [compiled.joint(name).id for name in self.model.joints]
        links = compiled.jnt_bodyid[places].tolist()
        if len(set(links)) < len(links):
            return None
        poses = poses_of(robot)
        axes = robot_axes(robot, poses)
        base = pin.SE3(*axes.base_in(model_axes(compiled, places, axes.turns, poses)))
        data, own = mujoco.MjData(compiled), robot.model.createData()
        data.qpos[compiled.jnt_qposadr[places]] = 0.0
        mujoco.mj_kinematics(compiled, data)
        pin.forwardKinematics(robot.model, own, np.zeros(robot.model.nq))
        frames = [base * frame for frame in list(own.oMi)[1:]]
        return tuple(_moved(compiled, data, link, links, frame) for link, frame in zip(links, frames, strict=True))


def _moved(compiled: mujoco.MjModel, data: mujoco.MjData, link: int, links: list[int], frame: pin.SE3) -> _Moved:
    """Return what is moved by the joint of a link, of those of the robot's joints; frame: the joint's in the world."""
    place = _placed(data, link)
    others: dict[str, pin.Inertia] = {}
    whole, loose = body_of(compiled, link), pin.Inertia.Zero()
    for body in range(link + 1, compiled.nbody):
        above = body
        while above not in (0, *links):
            above = int(compiled.body_parentid[above])
        if above != link or body in links:
            continue
        inertia = (place.inverse() * _placed(data, body)).act(body_of(compiled, body))
        whole += inertia
        if compiled.body_weldid[body] == compiled.body_weldid[link]:
            others[compiled.body(body).name] = inertia
        else:
            loose += inertia
    joint = place.inverse() * frame
    return _Moved(compiled.body(link).name, joint.inverse().act(whole), joint, others, loose)


def _placed(data: mujoco.MjData, body: int) -> pin.SE3:
    return pin.SE3(data.xmat[body].reshape(3, 3), data.xpos[body])


def body_of(compiled: mujoco.MjModel, body: int) -> pin.Inertia:
    """Return the inertia of a compiled model's body in its frame."""
    axes = np.empty(9)
    mujoco.mju_quat2Mat(axes, compiled.body_iquat[body])
    turn = axes.reshape(3, 3)
    return pin.Inertia(
        float(compiled.body_mass[body]), compiled.body_ipos[body], turn * compiled.body_inertia[body] @ turn.T
    )


def _numbers(values: np.ndarray) -> np.ndarray:
    """Return mass, centre and inertia about that (10,) of inertial parameters (10,), in their order."""
    body = pin.Inertia.FromDynamicParameters(values)
    return np.array([body.mass, *body.lever, *body.inertia[np.tril_indices(3)]])


def _slope(values: np.ndarray) -> np.ndarray:
    """Return (10, 10) how mass, centre and inertia change with each inertial parameter."""
    steps = _STEP * np.maximum(np.abs(values), np.abs(values).max() * _STEP)
    ahead, behind = (np.array([_numbers(values + side * step) for step in np.diag(steps)]) for side in (1, -1))
    return np.asarray((ahead - behind).T / (2 * steps))


def _off(simulator: np.ndarray, robot: np.ndarray, rotor: float) -> list[int]:
    """Return which of a link's numbers (10,) are told: mass, centre, inertia are each told as a whole.

    What a centre and an inertia are off by is held against how the whole link is spread about its joint, an inertia
    against the rotor's, too: beside that a wrist's own hardly shows.
    """
    mass, spread = simulator[0], simulator[[4, 6, 9]].sum() / 2 / max(simulator[0], 1e-12) + (simulator[1:4] ** 2).sum()
    limits = ((slice(0, 1), mass), (slice(1, 4), np.sqrt(spread)), (slice(4, 10), mass * spread + rotor))
    off = [range(10)[part] for part, size in limits if np.linalg.norm((robot - simulator)[part]) > _OFF * size]
    return [k for part in off for k in part]


def _number(name: str, joint: str, unit: str, simulator: float, robot: float, variance: float) -> CauseParameter:
    change, half = robot - simulator, NORMAL * float(np.sqrt(max(variance, 0.0)))
    return CauseParameter(
        name=name,
        joint=joint,
        value=change,
        unit=unit,
        interval95=(change - half, change + half) if half else None,
        simulator=simulator,
        robot=robot,
    )
