"""A point mass at a model's flange: in the compiled model, and in its file."""

from __future__ import annotations

import copy

import numpy as np
import pinocchio as pin

from irtwin.robot.structure import six_numbers
from irtwin.robot.xml_elements import Element
from irtwin.simulator.engine import mujoco
from irtwin.simulator.model import Flange, Model

_OTHER_FORMS = ("quat", "axisangle", "xyaxes", "zaxis", "euler", "diaginertia")  # of what `fullinertia` says


def load(compiled: mujoco.MjModel, flange: Flange, mass: float, off: np.ndarray) -> None:
    """Put a mass, kg, `off` (3,) m from the flange, to its body; the model's constants are to be set after that."""
    body = flange.body
    whole, centre, inertia = together(compiled, flange, mass, off)
    moments, axes = np.linalg.eigh(inertia)
    axes[:, 2] *= np.linalg.det(axes)
    compiled.body_mass[body], compiled.body_ipos[body], compiled.body_inertia[body] = whole, centre, moments
    mujoco.mju_mat2Quat(compiled.body_iquat[body], axes.ravel())


def loaded(compiled: mujoco.MjModel, flange: Flange, mass: float, off: np.ndarray) -> mujoco.MjModel:
    """Return a copy of a compiled model with a mass, kg, `off` (3,) m from its flange."""
    laden = copy.copy(compiled)
    load(laden, flange, mass, off)
    mujoco.mj_setConst(laden, mujoco.MjData(laden))
    return laden


def loaded_tag(model: Model, mass: float, off: np.ndarray) -> dict[Element, dict[str, float | str | None]]:
    """Return what changes of the file: the inertial of the flange's body; nothing where the file says none."""
    inertial = model.file.inertial(model.compiled.body(model.flange.body).name)
    if inertial is None:
        return {}
    whole, centre, inertia = together(model.compiled, model.flange, mass, off)
    told: dict[str, float | str | None] = dict.fromkeys(_OTHER_FORMS)
    told |= {"mass": float(whole), "pos": " ".join(map(repr, centre.tolist()))}
    return {inertial: told | {"fullinertia": " ".join(map(repr, six_numbers(inertia)))}}


def together(
    compiled: mujoco.MjModel, flange: Flange, mass: float, off: np.ndarray
) -> tuple[float, np.ndarray, np.ndarray]:
    """Return mass, centre (3,) and the inertia (3, 3) about it, in the body's frame, of body and mass."""
    body, axes = flange.body, np.empty(9)
    mujoco.mju_quat2Mat(axes, compiled.body_iquat[body])
    inertia = axes.reshape(3, 3) * compiled.body_inertia[body] @ axes.reshape(3, 3).T
    own = pin.Inertia(float(compiled.body_mass[body]), compiled.body_ipos[body], inertia)
    whole = own + pin.Inertia(mass, flange.place + off, np.zeros((3, 3)))
    return whole.mass, whole.lever, whole.inertia
