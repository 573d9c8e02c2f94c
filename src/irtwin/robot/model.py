"""The Pinocchio model of a URDF."""

from __future__ import annotations

from xml.etree.ElementTree import SubElement, tostring

import pinocchio as pin
from defusedxml import ElementTree as SafeXml

_UNBOUNDED = {"lower": "-1e9", "upper": "1e9", "velocity": "1e9", "effort": "1e9"}


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
