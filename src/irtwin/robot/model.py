"""The Pinocchio model of a URDF."""

from __future__ import annotations

from xml.etree.ElementTree import SubElement, tostring

import numpy as np
import pinocchio as pin
from defusedxml import ElementTree as SafeXml

_UNBOUNDED = {"lower": "-1e9", "upper": "1e9", "velocity": "1e9", "effort": "1e9"}
_POSES = 512  # their mean is known within some percent


def build_model(urdf: str) -> pin.Model:
    """Build the model of checked URDF text with one position and one speed per moving joint: nq = nv = n.

    A continuous joint becomes a revolute one without limits (Pinocchio would give it a cosine and a sine); one that
    mimics another is fixed.
    Raises ValueError where Pinocchio refuses the text.
    """
    root = SafeXml.fromstring(urdf.encode("utf-8"), forbid_dtd=True)
    for link in root.findall("link"):
        for shape in [*link.findall("visual"), *link.findall("collision")]:
            link.remove(shape)
    for joint in root.findall("joint"):
        for mimic in joint.findall("mimic"):
            joint.remove(mimic)
            joint.set("type", "fixed")
        kind = joint.get("type")
        if kind == "continuous":
            joint.set("type", "revolute")
            for limit in joint.findall("limit"):
                joint.remove(limit)
        if kind != "fixed" and joint.find("limit") is None:
            SubElement(joint, "limit", _UNBOUNDED)
    return pin.buildModelFromXML(tostring(root, encoding="unicode"))


def inverse_dynamics(model: pin.Model, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray) -> np.ndarray:
    """Return (N, n) the torque that moves a model's bodies so, N m or N; q, dq, ddq: (N, n)."""
    states = (np.asfortranarray(signal.T) for signal in (q, dq, ddq))
    torque = np.ascontiguousarray(pin.rneaInParallel(1, pin.ModelPool(model, 1), *states).T)  # a loop takes four times
    return np.asarray(torque.reshape(q.shape))  # of one joint it is a plain vector


def mean_inertia(model: pin.Model) -> np.ndarray:
    """Return (n,) the inertia that each joint moves while the others hold: the mean over poses that fill their ranges.

    In kg m^2, or kg of a prismatic joint. A joint of more than a turn, or without limits, has all of one turn.
    """
    lower, upper = model.lowerPositionLimit, model.upperPositionLimit
    wide = upper - lower > 2 * np.pi
    lower, upper = np.where(wide, -np.pi, lower), np.where(wide, np.pi, upper)
    poses = np.random.default_rng(0).uniform(lower, upper, (_POSES, model.nq))
    data = model.createData()
    return np.asarray(np.mean([pin.crba(model, data, pose).diagonal() for pose in poses], axis=0))
