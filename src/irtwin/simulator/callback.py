"""What no file of MuJoCo holds of a robot, added while its model moves.

    model = mujoco.MjModel.from_xml_path("robot.xml")
    print(apply(model, "twin.json"))  # from here on mj_step and mj_inverse have it

Twins have friction that a joint's two numbers cannot say, ripple, cables, coupling; servos have dead bands.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from irtwin.document.document import Document
from irtwin.effects.effect import Effect, stays_within
from irtwin.effects.stack import Stack
from irtwin.errors import InputError
from irtwin.input_file import read_text
from irtwin.json_text import parse_json
from irtwin.signals.conditioning import STANDSTILL
from irtwin.signals.motion import Motion
from irtwin.simulator.differences import not_held
from irtwin.simulator.model import joints_of
from irtwin.simulator.servos import drive_of
from irtwin.simulator.writing import effects as of_servos
from irtwin.twin.files import from_json
from irtwin.twin.twin import Twin

_LARGEST = 100_000_000  # bytes
_MEND = "name a twin that irtwin saved, or the JSON of a diagnosis"
_LEAST = 1e-9  # N m of dry friction, with which MuJoCo lets a joint have some
_MODEL = "the model"

Added = Callable[[mujoco.MjModel, mujoco.MjData], None]


@dataclass(frozen=True)
class Rest:
    """Ids of effects that MuJoCo is told to add; `left_out`: of those that it cannot: they need what was before."""

    effects: tuple[str, ...]
    left_out: tuple[str, ...]


def apply(model: mujoco.MjModel, file: Path | str) -> Rest:
    """Let MuJoCo add to a model what it does not hold of a twin, or of a diagnosis of servos by their commands.

    The model has the numbers that a file can hold: of `irtwin export --mjcf`, or `diagnose --save-simulator`. It is
    given the twin's armature, damping and dry friction, which belong with what is added, and a trace of dry friction in
    each joint whose friction is added. MuJoCo has one passive callback, and compiles
    no model while it is set: this one takes the place of another, and `mujoco.set_mjcb_passive(None)` takes it out.
    Raises InputError where the file is neither, or the model lacks a joint of it.
    """
    path = Path(file)
    text = read_text(path, _LARGEST, _MEND)
    try:
        given = parse_json(text)
    except ValueError as error:
        raise InputError(f"{path}: not JSON ({error}); {_MEND}") from error
    saved = Document.from_json(given) if isinstance(given, dict) and "verdict" in given else from_json(text, path)
    rest, add = _of_diagnosis(model, saved) if isinstance(saved, Document) else _of_twin(model, saved)
    mujoco.set_mjcb_passive(lambda moving, data: add(moving, data) if moving is model else None)
    return rest


def _of_twin(model: mujoco.MjModel, twin: Twin) -> tuple[Rest, Added]:
    real = [effect for effect in twin.standing if effect.channel == "torque"]
    known = [
        effect
        for effect in real
        if not (effect.memory or effect.requires or effect.disturbance or effect.within_bodies)
    ]
    rest = [effect for effect in known if not (effect.bodies or effect.in_mjcf)]
    left_out = tuple(dict.fromkeys(effect.id for effect in real if effect not in known))
    return Rest(tuple(dict.fromkeys(effect.id for effect in rest)), left_out), _Torque(model, twin, known, rest)


class _Torque:
    """Torque of effects of a twin.

    What turns with a joint's speed is given to MuJoCo as dry friction of the joint, so that it can hold; the rest is a
    force. The acceleration is that of the step before.
    """

    def __init__(self, model: mujoco.MjModel, twin: Twin, known: Sequence[Effect], rest: Sequence[Effect]):
        joints, _ = joints_of(model, twin.robot.joint_names, _MODEL)
        self._q, self._dq = model.jnt_qposadr[joints], model.jnt_dofadr[joints]
        self._stack = Stack(twin.robot, known)
        self._values = twin.values(self._stack.torque_terms)
        for (effect, term), value in zip(self._stack.torque_terms, self._values, strict=True):
            if number := effect.in_mjcf.get(term.name):
                getattr(model, f"dof_{number}")[self._dq[twin.robot.index(str(term.joint))]] = max(value, 0.0)
        self._within = [effect for effect in rest if stays_within(effect)]
        self._across = [effect for effect in rest if not stays_within(effect)]
        rubs = [place for effect in self._within for place in effect.places(twin.robot)]
        friction = model.dof_frictionloss
        friction[self._dq[rubs]] = np.maximum(friction[self._dq[rubs]], _LEAST)

    def __call__(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        dq = data.qvel[self._dq]
        slides = np.where(dq < 0, -1.0, 1.0) * np.maximum(np.abs(dq), STANDSTILL)
        q, ddq = (np.tile(state, (3, 1)) for state in (data.qpos[self._q], data.qacc[self._dq]))
        motion = Motion(np.full(3, data.time), q, np.array([slides, -slides, dq]), ddq, run=_MODEL)
        ahead, back, _ = self._stack.torque_of(self._within, motion, self._values)
        turns = (ahead - back) / 2 * np.sign(slides)
        held = _hold(model, data, self._dq, turns)
        across = self._stack.torque_of(self._across, motion, self._values)[2] if self._across else 0.0
        data.qfrc_passive[self._dq] -= (ahead + back) / 2 + (turns - held) * np.sign(dq) + across


def _hold(model: mujoco.MjModel, data: mujoco.MjData, dof: np.ndarray, more: np.ndarray) -> np.ndarray:
    """Give dry friction (n,) to joints beside the model's own, in this step; return what they took."""
    row = np.full(model.nv, -1)
    (rubs,) = np.nonzero(data.efc_type[: data.nefc] == int(mujoco.mjtConstraint.mjCNSTR_FRICTION_DOF))
    row[data.efc_id[rubs]] = rubs
    has, own = row[dof] >= 0, model.dof_frictionloss[dof]
    held = np.where(has, np.maximum(more, -own), 0.0)
    data.efc_frictionloss[row[dof][has]] = (own + held)[has]
    if data.nisland:  # its solver has a copy
        data.iefc_frictionloss[data.map_efc2iefc[row[dof][has]]] = (own + held)[has]
    return held


def _of_diagnosis(model: mujoco.MjModel, document: Document) -> tuple[Rest, Added]:
    dead_band = of_servos()["dead_band"][0]
    bands = {
        parameter.joint: parameter.value
        for cause in document.causes
        if cause.effect == dead_band
        for parameter in cause.parameters
        if parameter.joint is not None
    }
    left_out = tuple(cause.effect for cause in not_held(document) if cause.effect != dead_band)
    return Rest((dead_band,) if bands else (), left_out), _DeadBands(model, tuple(bands), np.array([*bands.values()]))


class _DeadBands:
    """What dead bands, rad (m) to either side, take from the pull of position servos."""

    def __init__(self, model: mujoco.MjModel, names: Sequence[str], bands: np.ndarray):
        joints, _ = joints_of(model, names, _MODEL)
        self._q, self._dq = model.jnt_qposadr[joints], model.jnt_dofadr[joints]
        self._drives = np.array([drive_of(model, name, _MODEL) for name in names], dtype=int)
        self._gears = model.actuator_gear[self._drives, 0]
        self._bands = np.abs(self._gears) * bands

    def __call__(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        at, q, dq = self._drives, self._gears * data.qpos[self._q], self._gears * data.qvel[self._dq]
        stiffness, (offset, _, damping) = model.actuator_gainprm[at, 0], model.actuator_biasprm[at, :3].T
        off = self._told(model, data) + offset / stiffness - q
        pull = stiffness * off + damping * dq
        less = pull - stiffness * np.clip(off, -self._bands, self._bands)
        limited = model.actuator_forcelimited[at] == 1
        least, most = np.where(limited, model.actuator_forcerange[at].T, [[-np.inf], [np.inf]])
        data.qfrc_passive[self._dq] += self._gears * (np.clip(less, least, most) - np.clip(pull, least, most))

    def _told(self, model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
        """Return the commands (n,) that the servos follow now: late where they have a delay, within their range."""
        told = np.zeros((len(self._drives), 1))
        for row, at in enumerate(self._drives):
            told[row] = mujoco.mj_readCtrl(model, data, at, data.time, told[row], model.actuator_history[at, 1])
        limited, ends = model.actuator_ctrllimited[self._drives] == 1, model.actuator_ctrlrange[self._drives].T
        return np.where(limited, np.clip(told[:, 0], *ends), told[:, 0])
