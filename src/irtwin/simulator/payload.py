"""A point mass at a model's flange: in the compiled model, and in its file."""

from __future__ import annotations

import copy

import numpy as np
import pinocchio as pin

from irtwin.robot.mjcf_text import inertial
from irtwin.robot.structure import principal
from irtwin.robot.xml_elements import Element
from irtwin.simulator.bodies import body_of
from irtwin.simulator.engine import mujoco
from irtwin.simulator.model import Flange, Model

_OTHER_FORMS = ("quat", "axisangle", "xyaxes", "zaxis", "euler", "diaginertia")  # of what `fullinertia` says


def load(compiled: mujoco.MjModel, flange: Flange, mass: float, off: np.ndarray) -> None:
    """Put a mass, kg, `off` (3,) m from the flange, to its body; the model's constants are to be set after that."""
    body = flange.body
    whole = together(compiled, flange, mass, off)
    moments, axes = principal(whole.inertia)
    compiled.body_mass[body], compiled.body_ipos[body], compiled.body_inertia[body] = whole.mass, whole.lever, moments
    mujoco.mju_mat2Quat(compiled.body_iquat[body], axes.ravel())


def loaded(compiled: mujoco.MjModel, flange: Flange, mass: float, off: np.ndarray) -> mujoco.MjModel:
    """Return a copy of a compiled model with a mass, kg, `off` (3,) m from its flange."""
    laden = copy.copy(compiled)
    load(laden, flange, mass, off)
    mujoco.mj_setConst(laden, mujoco.MjData(laden))
    return laden


def loaded_tag(model: Model, mass: float, off: np.ndarray) -> dict[Element, dict[str, float | str | None]]:
    """Return what changes of the file: the inertial of the flange's body; nothing where the file says none."""
    element = model.file.inertial(model.compiled.body(model.flange.body).name)
    if element is None:
        return {}
    return {element: dict.fromkeys(_OTHER_FORMS) | inertial(together(model.compiled, model.flange, mass, off))}


def together(compiled: mujoco.MjModel, flange: Flange, mass: float, off: np.ndarray) -> pin.Inertia:
    """Return the flange's body and a mass as one, in the body's frame."""
    return body_of(compiled, flange.body) + pin.Inertia(mass, flange.place + off, np.zeros((3, 3)))
