"""The URDF of a MuJoCo arm: a link for each joint, with all that is welded to it."""

from __future__ import annotations

from xml.etree import ElementTree

import mujoco
import numpy as np

from closed_loop.models import Model


def urdf(model: Model, compiled: mujoco.MjModel) -> str:
    """Return the URDF text; kinematics of the model, masses and inertias of `compiled`."""
    data = mujoco.MjData(compiled)
    data.qpos[:] = 0
    mujoco.mj_forward(compiled, data)
    root = ElementTree.Element("robot", name=model.name)
    ElementTree.SubElement(root, "link", name="base_link")
    turn, place, parent = np.eye(3), np.zeros(3), "base_link"
    for joint, name in enumerate(model.joints):
        body = compiled.jnt_bodyid[joint]
        own_turn, own_place = data.xmat[body].reshape(3, 3).copy(), data.xanchor[joint].copy()
        link = f"link_{joint + 1}"
        element = ElementTree.SubElement(root, "joint", name=name, type="revolute")
        ElementTree.SubElement(element, "parent", link=parent)
        ElementTree.SubElement(element, "child", link=link)
        _origin(element, turn.T @ (own_place - place), turn.T @ own_turn)
        ElementTree.SubElement(element, "axis", xyz=_words(compiled.jnt_axis[joint]))
        ElementTree.SubElement(
            element, "limit", lower=f"{model.lower[joint]:.6g}", upper=f"{model.upper[joint]:.6g}",
            effort=f"{model.torque[joint]:.6g}", velocity="3.14",
        )  # fmt: skip
        _inertial(ElementTree.SubElement(root, "link", name=link), compiled, data, body, own_turn, own_place)
        turn, place, parent = own_turn, own_place, link
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _inertial(
    link: ElementTree.Element,
    compiled: mujoco.MjModel,
    data: mujoco.MjData,
    body: int,
    turn: np.ndarray,
    place: np.ndarray,
) -> None:
    welded = np.flatnonzero(compiled.body_weldid == body)
    masses = compiled.body_mass[welded]
    centre = (masses @ data.xipos[welded]) / masses.sum()
    inertia = np.zeros((3, 3))
    for each, mass in zip(welded, masses, strict=True):
        own, lever = data.ximat[each].reshape(3, 3), data.xipos[each] - centre
        inertia += own @ np.diag(compiled.body_inertia[each]) @ own.T
        inertia += mass * (lever @ lever * np.eye(3) - np.outer(lever, lever))
    inertia = turn.T @ inertia @ turn
    element = ElementTree.SubElement(link, "inertial")
    _origin(element, turn.T @ (centre - place), np.eye(3))
    ElementTree.SubElement(element, "mass", value=f"{masses.sum():.9g}")
    names = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
    ElementTree.SubElement(element, "inertia", {key: f"{inertia[at]:.9g}" for key, at in names.items()})


def _origin(element: ElementTree.Element, place: np.ndarray, turn: np.ndarray) -> None:
    pitch = np.arctan2(-turn[2, 0], np.hypot(turn[0, 0], turn[1, 0]))
    if abs(np.cos(pitch)) > 1e-9:
        roll, yaw = np.arctan2(turn[2, 1], turn[2, 2]), np.arctan2(turn[1, 0], turn[0, 0])
    else:
        roll, yaw = np.arctan2(-turn[1, 2], turn[1, 1]), 0.0
    ElementTree.SubElement(element, "origin", xyz=_words(place), rpy=_words(np.array([roll, pitch, yaw])))


def _words(numbers: np.ndarray) -> str:
    return " ".join(f"{number:.12g}" for number in numbers)
