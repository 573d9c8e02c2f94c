"""The position servos of a model, one a joint, and the numbers that say how each follows its commands."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import scipy

from irtwin.errors import InputError
from irtwin.robot.xml_elements import Element
from irtwin.simulator.engine import mujoco
from irtwin.simulator.feedforward import Feedforward
from irtwin.simulator.model import Model
from irtwin.simulator.payload import load, loaded_tag
from irtwin.simulator.variant import PlayedModel, variant

OF_JOINTS = (
    "stiffness", "damping", "friction", "holding", "armature", "offset", "delay", "torque_limit", "dead_band",
    "spring", "compliance", "link_compliance",
)  # fmt: skip
PARTS = {"payload": ("payload", "payload_x", "payload_y", "payload_z"), "base_tilt": ("tilt_x", "tilt_y")}
OF_ROBOT = tuple(name for names in PARTS.values() for name in names)  # the same at all joints
NAMES = (*OF_JOINTS, *OF_ROBOT)
CALLED = {  # by what a model's file calls it, and MuJoCo's specification
    "stiffness": "kp",
    "damping": "damping",
    "friction": "frictionloss",
    "holding": "solimpfriction",
    "armature": "armature",
    "offset": "offset",
    "delay": "delay",
    "torque_limit": "forcerange",
    "spring": "stiffness",
    "payload": "inertial",
    "base_tilt": "gravity",
}
_IN_SERVO = ("stiffness", "offset", "delay", "torque_limit")  # and damping, of some
_UNLIMITED = np.array([[-1e12], [1e12]])  # N m
_FARTHEST = 2 * np.pi  # rad that a joint is off: a servo without limit gives no more torque than there
HOLDS = 0.9999  # impedance of friction that lets a joint at rest creep no more: the most that MuJoCo takes
# times inertia, s^-2, s^-1, s^-2, 1, s^-2
_NEAR_ZERO = {"stiffness": 0.01, "damping": 0.1, "friction": 0.1, "armature": 0.01, "torque_limit": 0.01}
_LIGHT = 0.01  # of the arm's mass: a payload near zero
SOFT = (OF_JOINTS.index("compliance"), OF_JOINTS.index("link_compliance"))
_SPRING, _SOFT = OF_JOINTS.index("spring"), list(SOFT)
_SOFTEST = 4.0  # of the square of the frequency with which an arm swings on its servo, over that on the joint


@dataclass(frozen=True)
class Servos:
    """A model's servos in the order of its joints; numbers of them are (k, n), a row a name of NAMES.

    stiffness N m/rad; damping N m s/rad, of servo and joint together; friction N m; holding: the impedance of that
    friction, 0 to 1; armature kg m^2; offset rad, added to a command; delay s; torque_limit N m, the most of the servo;
    dead_band rad, how far a joint is off before its servo pulls; spring N m/rad, between a joint and where the model
    has it at rest; compliance rad/(N m), of what is between a motor, where the position is measured, and its link, and
    link_compliance, where that of the link is; payload kg, the same in all columns, as where it is: payload_x,
    payload_y, payload_z m from the flange, in the frame of its body; and as tilt_x, tilt_y rad, by which gravity is
    turned about the world's axes. N and m where a joint slides.
    """

    model: Model
    actuators: np.ndarray  # (n,)
    numbers: np.ndarray  # (k, n), the model's own
    scale: np.ndarray  # (k, n), below which a number is as good as zero
    trusted: frozenset[str] = frozenset()  # names, and parts, of numbers that are right
    variants: dict[tuple[bool, tuple[str, ...]], PlayedModel] = field(default_factory=dict)

    def chart(self, numbers: np.ndarray) -> np.ndarray:
        """Return numbers (..., k, n) in coordinates in which equal steps matter alike: logarithms, but near zero.

        A spring is held to the servo's stiffness, a compliance to one with which link and servo swing alike.
        """
        coordinates = np.where(np.isnan(self.scale), numbers, np.log1p(numbers / self.scale))
        stiffness = numbers[..., 0, :]
        coordinates[..., _SPRING, :] = (numbers[..., _SPRING, :] - self.numbers[_SPRING]) / stiffness
        coordinates[..., _SOFT, :] = numbers[..., _SOFT, :] * (stiffness * self._of_links)[..., None, :]
        return coordinates

    def of_chart(self, coordinates: np.ndarray) -> np.ndarray:
        """Return the numbers of coordinates (..., k, n); those that cannot be below zero are not."""
        free = np.isnan(self.scale)
        free[[NAMES.index("delay"), NAMES.index("dead_band"), *_SOFT]] = False
        held = np.where(free, coordinates, np.maximum(coordinates, 0.0))
        numbers = np.where(np.isnan(self.scale), held, self.scale * np.expm1(np.where(np.isnan(self.scale), 0.0, held)))
        stiffness = numbers[..., 0, :]
        numbers[..., _SPRING, :] = np.maximum(self.numbers[_SPRING] + held[..., _SPRING, :] * stiffness, 0.0)
        softest = np.minimum(held[..., _SOFT, :], _SOFTEST)
        numbers[..., _SOFT, :] = softest / (stiffness * self._of_links)[..., None, :]
        return numbers

    @property
    def _of_links(self) -> np.ndarray:
        """How much of the inertia that each servo moves (n,) is the link's."""
        return np.asarray(self.model.links / (self.model.links + self.numbers[NAMES.index("armature")]))

    @cached_property
    def feedforward(self) -> Feedforward | None:
        """What the robot's controller adds to its servos, None where it adds nothing."""
        return Feedforward(self.model.robot) if self.model.robot.feedforward else None

    @cached_property
    def can_differ(self) -> np.ndarray:
        """Whether numbers (k, n) of joints can be others.

        A servo whose commands are filtered has no dead band, a joint without a rotor is not soft behind it, and what
        is trusted is right.
        """
        free = [name in OF_JOINTS and name not in self.trusted for name in NAMES]
        can_differ = np.repeat(np.array(free)[:, None], self.numbers.shape[1], axis=1)
        can_differ[NAMES.index("dead_band")] &= self.model.compiled.actuator_actnum[self.actuators] == 0
        can_differ[_SOFT] &= self.numbers[NAMES.index("armature")] > 0
        return can_differ

    @cached_property
    def held(self) -> np.ndarray:
        """Whether the file has a place for each number (k, n) that one can have; a dead band is played alone."""
        holds = [part_of(name) not in CALLED or self.model.file.holds(CALLED[part_of(name)]) for name in NAMES]
        return np.array(holds)[:, None] & (self.in_file | ~np.isin(NAMES, _IN_SERVO)[:, None])

    @cached_property
    def in_file(self) -> np.ndarray:
        """Whether the servo of each joint (n,) is the model's file's, not one by its controller's gains."""
        return np.array([joint not in self.model.gains for joint in self.model.joints])

    @cached_property
    def gears(self) -> np.ndarray:
        """The gears (n,) of the file's servos: numbers are those at the joints, behind them."""
        return np.asarray(self.model.gears[self.actuators])

    def of_file(self, numbers: np.ndarray) -> np.ndarray:
        """Return numbers (k, n) with those of servos as the file has them, before their gears."""
        own = numbers.copy()
        own[NAMES.index("stiffness")] /= self.gears**2
        own[NAMES.index("offset")] *= self.gears
        own[NAMES.index("torque_limit")] /= np.abs(self.gears)
        return own

    def lead(self, numbers: np.ndarray) -> np.ndarray:
        """Return how many s (n,) of a commanded speed controllers of told gains, or of errors, add to a command."""
        leads = ~self.in_file | self.model.file.damps_error
        return np.where(leads, self.dampings(numbers[1])[1] / numbers[0], 0.0)

    def needs(self, numbers: np.ndarray) -> tuple[bool, tuple[str, ...]]:
        """Return what of a variant of the model numbers (k, n) need: whether dead bands, and soft joints."""
        soft = self.compliance(numbers) * self.model.stiffest > 1
        banded = bool(numbers[NAMES.index("dead_band")].any())
        return banded, tuple(name for name, is_soft in zip(self.model.joints, soft, strict=True) if is_soft)

    @staticmethod
    def compliance(numbers: np.ndarray) -> np.ndarray:
        """Return how soft joints are (n,), rad/(N m), wherever their positions are measured."""
        return np.asarray(numbers[_SOFT].sum(axis=0))

    @staticmethod
    def on_links(numbers: np.ndarray) -> np.ndarray:
        """Return whether positions of joints (n,) are measured at their links."""
        return np.asarray(numbers[_SOFT[1]] > 0)

    def variant(self, needs: tuple[bool, tuple[str, ...]]) -> PlayedModel:
        """Return the model with dead bands, and soft joints, that numbers need."""
        if needs not in self.variants:
            self.variants[needs] = variant(self.model, *needs)
        return self.variants[needs]

    def limits(self, torque_limit: np.ndarray) -> np.ndarray:
        """Return the least and most torque (2, ..., n) of servos: the model's, where the limit (..., n) is."""
        compiled, at = self.model.compiled, self.actuators
        own = np.where(compiled.actuator_forcelimited[at] == 1, compiled.actuator_forcerange[at].T, _UNLIMITED)
        changed = torque_limit != self.numbers[NAMES.index("torque_limit")]
        return np.array([np.where(changed, side * torque_limit, end) for side, end in zip((-1, 1), own, strict=True)])

    def compiled(self, numbers: np.ndarray, of: PlayedModel) -> mujoco.MjModel:
        """Return a variant of the model with numbers (k, n) of its own; offset and delay are the commands' to have."""
        model = copy.copy(of.compiled)
        model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ISLAND)  # an arm is one: looking for more takes time
        at, dof = self.actuators, of.speeds
        stiffness, damping, friction, holding, armature, _, _, limit, band, spring, *_ = numbers[: len(OF_JOINTS)]
        mass, *off = numbers[len(OF_JOINTS) :, 0]
        if mass:
            load(model, self.model.flange, float(mass), np.array(off[:3]))
        model.opt.gravity = tilted(model, off[3:])
        ends = self.limits(limit)
        if len(of.second):
            model.actuator_gainprm[of.second, 0], model.actuator_biasprm[of.second, 1] = -stiffness, stiffness
            model.actuator_forcerange[of.second] = (stiffness * band * np.array([[-1.0], [1.0]])).T
        if len(of.second) or len(of.fed):  # several actuators share what one motor can give
            model.actuator_forcelimited[at] = 0
            limited = model.jnt_actfrclimited[of.joints] == 1
            least, most = np.where(limited, model.jnt_actfrcrange[of.joints].T, _UNLIMITED)
            both = np.maximum(ends[0], least), np.minimum(ends[1], most)
            model.jnt_actfrclimited[of.joints], model.jnt_actfrcrange[of.joints] = 1, np.transpose(both)
        else:
            model.actuator_forcelimited[at], model.actuator_forcerange[at] = 1, ends.T
        in_joint, in_servo = self.dampings(damping)
        model.actuator_gainprm[at, 0], model.actuator_biasprm[at, 1] = stiffness, -stiffness
        model.actuator_biasprm[at, 0], model.actuator_biasprm[at, 2] = 0.0, -in_servo
        model.dof_damping[dof], model.dof_frictionloss[dof], model.dof_armature[dof] = in_joint, friction, armature
        model.jnt_stiffness[of.joints] = spring
        changed = holding != self.numbers[NAMES.index("holding")]
        model.dof_solimp[dof, 0] = holding
        model.dof_solimp[dof, 1] = np.where(changed, holding, model.dof_solimp[dof, 1])
        of.soften(model, self.compliance(numbers))
        mujoco.mj_setConst(model, mujoco.MjData(model))
        return model

    def dampings(self, damping: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the damping (n,) in joint and in servo: that of a servo of the file changes where it has any."""
        joint = self.model.compiled.dof_damping[self.model.speeds]
        servo = -self.model.compiled.actuator_biasprm[self.actuators, 2]
        kept = np.where((servo > 0) & self.in_file, np.minimum(joint, damping), np.maximum(damping - servo, 0.0))
        return kept, damping - kept

    def written(self, numbers: np.ndarray, differs: np.ndarray) -> bytes:
        """Return the model's file with those of numbers (k, n) that differ (k, n); all else stays, byte for byte.

        What the file has no place for stays out: a URDF's friction that creeps and armature, and gains that are told.
        """
        changes: dict[Element, dict[str, float | str | None]] = {}
        file, differs = self.model.file, differs & self.held
        numbers = self.of_file(np.where(self.held, numbers, self.numbers))
        in_joint, in_servo = self.dampings(numbers[NAMES.index("damping")])
        in_servo = in_servo / self.gears**2
        for place, joint in enumerate(self.model.joints):
            own = dict(zip(NAMES, differs[:, place], strict=True))
            told = dict(zip(NAMES, map(float, numbers[:, place]), strict=True))
            of_joint: dict[str, float | str | None] = {}
            if own["damping"] and in_joint[place] != self.dampings(self.numbers[1])[0][place]:
                of_joint["damping"] = float(in_joint[place])
            of_joint |= {CALLED[name]: told[name] for name in ("friction", "armature", "spring") if own[name]}
            if own["holding"]:
                of_joint["solimpfriction"] = f"{told['holding']!r} {told['holding']!r}"
            for key in of_joint:
                element, attribute = file.number(joint, key)
                changes.setdefault(element, {})[attribute] = of_joint[key]
            if self.in_file[place] and any(own[name] for name in ("damping", *_IN_SERVO)):
                servo = file.element(["position", "general"], "joint", joint)
                changes[servo] = self._of_servo(servo, place, told, own, float(in_servo[place]))
        mass, *off = numbers[len(OF_JOINTS) :, 0]
        if differs[NAMES.index("payload")].any():
            changes |= loaded_tag(self.model, float(mass), np.array(off[:3]))
        option = next((element for element in file.elements if element.tag == "option"), None)
        if option and differs[NAMES.index("tilt_x")].any():
            changes[option] = {"gravity": " ".join(map(repr, tilted(self.model.compiled, off[3:]).tolist()))}
        return file.changed(changes)

    def unwritten(self, differs: np.ndarray) -> list[str]:
        """Return which numbers that differ (k, n) the file has no place for, in words."""
        lacks = differs & ~self.held
        rows = [(name, lacks[row]) for row, name in enumerate(OF_JOINTS)]
        told = [f"{name} of {self.model.joints[place]}" for name, row in rows for place in np.flatnonzero(row)]
        return told + [part.replace("_", " ") for part in PARTS if lacks[row_of(part)].any()]

    def _of_servo(
        self, servo: Element, place: int, told: Mapping[str, float], own: Mapping[str, bool], damping: float
    ) -> dict[str, float | str | None]:
        """Return what changes of a servo's tag; only <general> holds an offset of commands."""
        changed: dict[str, float | str | None] = {}
        bias = f"{told['stiffness'] * told['offset']!r} {-told['stiffness']!r} {-damping!r}"
        if servo.tag == "general":
            changed |= {"gainprm": told["stiffness"], "biasprm": bias}
        elif told["offset"]:
            kind = {"": "general", "kp": None, "kv": None, "dampratio": None, "inheritrange": None}
            changed |= {**kind, "gaintype": "fixed", "biastype": "affine"}
            changed |= {"gainprm": told["stiffness"], "biasprm": bias}
            compiled, at = self.model.compiled, self.actuators[place]
            if compiled.actuator_actnum[at]:
                constant = float(compiled.actuator_dynprm[at, 0])
                changed |= {"timeconst": None, "dyntype": "filterexact", "dynprm": constant}
            if compiled.actuator_ctrllimited[at] and "ctrlrange" not in servo.attributes:
                ends = np.sort(compiled.actuator_ctrlrange[at] * self.gears[place])
                changed["ctrlrange"] = " ".join(map(repr, ends.tolist()))
        else:
            changed |= {"kp": told["stiffness"]} if own["stiffness"] else {}
            changed |= {"kv": damping, "dampratio": None} if own["damping"] else {}
        if own["torque_limit"]:
            changed["forcerange"] = f"{-told['torque_limit']!r} {told['torque_limit']!r}"
        if own["delay"]:
            samples = int(np.ceil(told["delay"] / self.model.compiled.opt.timestep)) + 1
            changed |= {"delay": told["delay"], "nsample": str(samples), "interp": "linear"}  # else of whole steps
        return changed

    def clipped(self, commands: np.ndarray) -> Mapping[str, float]:
        """Return the share of commands (N, n) that the model's limits clip, by joint; joints with none are left out."""
        compiled = self.model.compiled
        lower, upper = compiled.actuator_ctrlrange[self.actuators].T
        outside = ((commands < lower) | (commands > upper)) & (compiled.actuator_ctrllimited[self.actuators] == 1)
        shares = zip(self.model.joints, outside.mean(axis=0), strict=True)
        return {joint: float(share) for joint, share in shares if share > 0}


def part_of(name: str) -> str:
    """Return what a number is told as: a payload and its place are one thing."""
    return next((part for part, names in PARTS.items() if name in names), name)


def row_of(name: str) -> int:
    """Return the row of a number, or the first of those that are told as one thing."""
    return NAMES.index(PARTS.get(name, (name,))[0])


def tilted(compiled: mujoco.MjModel, angles: Sequence[float]) -> np.ndarray:
    """Return a model's gravity (3,), m/s^2, turned by two angles, rad, about the world's x and y axes."""
    return np.asarray(scipy.spatial.transform.Rotation.from_rotvec([*angles, 0.0]).apply(compiled.opt.gravity))


def has_servos(model: Model) -> bool:
    """Return whether each joint of the robot is driven by one position servo."""
    return all(_servo(model.compiled, joint) is not None for joint in model.joints)


def servos(model: Model) -> Servos:
    """Return the servos of a model. Raises InputError where a joint is not driven by one position servo."""
    compiled = model.compiled
    at = np.array([drive_of(compiled, joint, str(model.file.path)) for joint in model.joints])
    dof = model.speeds
    stiffness = compiled.actuator_gainprm[at, 0]
    own = np.vstack(
        [
            stiffness,
            compiled.dof_damping[dof] - compiled.actuator_biasprm[at, 2],
            compiled.dof_frictionloss[dof],
            compiled.dof_solimp[dof, 0],
            compiled.dof_armature[dof],
            compiled.actuator_biasprm[at, 0] / stiffness,
            model.delays[at],
            np.where(
                compiled.actuator_forcelimited[at] == 1, compiled.actuator_forcerange[at, 1], _FARTHEST * stiffness
            ),
            np.zeros(len(at)),
            compiled.jnt_stiffness[compiled.dof_jntid[dof]],
            np.zeros((len(_SOFT) + len(OF_ROBOT), len(at))),
        ]
    )
    data = mujoco.MjData(compiled)
    mujoco.mj_forward(compiled, data)
    inertia = np.zeros((compiled.nv, compiled.nv))
    mujoco.mj_fullM(compiled, data, inertia)
    scale = np.array([_NEAR_ZERO.get(name, np.nan) for name in NAMES])[:, None] * np.diag(inertia)[dof]
    scale[NAMES.index("payload")] = _LIGHT * compiled.body_subtreemass[compiled.jnt_bodyid[compiled.dof_jntid[dof[0]]]]
    return Servos(model, at, own, scale)


def drive_of(compiled: mujoco.MjModel, joint: str, source: str) -> int:
    """Return a joint's position servo. Raises InputError, naming `source`, where it is not driven by one alone."""
    drive = _servo(compiled, joint)
    if drive is None:
        raise InputError(
            f"{source}: joint {joint} is not driven by one position servo; its commands need one to be played: "
            f'<position joint="{joint}" kp="..."/>, or kp of the joint in dataset.toml'
        )
    return drive


def _servo(compiled: mujoco.MjModel, joint: str) -> int | None:
    """Return the actuator that alone drives a joint, if it is a position servo."""
    at_joint = compiled.actuator_trntype == int(mujoco.mjtTrn.mjTRN_JOINT)
    drives = np.flatnonzero(at_joint & (compiled.actuator_trnid[:, 0] == compiled.joint(joint).id)).tolist()
    return drives[0] if len(drives) == 1 and _follows_position(compiled, drives[0]) else None


def _follows_position(compiled: mujoco.MjModel, actuator: int) -> bool:
    """Return whether an actuator pulls its joint to its command, as <position> does."""
    gain, bias = compiled.actuator_gainprm[actuator], compiled.actuator_biasprm[actuator]
    return bool(
        compiled.actuator_gaintype[actuator] == int(mujoco.mjtGain.mjGAIN_FIXED)
        and compiled.actuator_biastype[actuator] == int(mujoco.mjtBias.mjBIAS_AFFINE)
        and gain[0] > 0
        and bias[1] == -gain[0]
        and compiled.actuator_gear[actuator, 0] != 0
    )
