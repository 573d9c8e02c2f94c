"""Single numbers of a URDF changed: bodies of links and dynamics of joints; all else stays, byte for byte."""

from __future__ import annotations

from collections.abc import Mapping
from xml.sax.saxutils import quoteattr

import pinocchio as pin

from irtwin.robot.structure import MOMENTS, six_numbers
from irtwin.robot.xml_elements import outermost, with_child


def with_numbers(urdf: str, bodies: Mapping[str, pin.Inertia], dynamics: Mapping[str, Mapping[str, float]]) -> str:
    """Return checked URDF text with these bodies of links, in the links' frames, and numbers of joints' <dynamics>."""
    content = urdf.encode("utf-8")
    for element in reversed(outermost(content).children):  # from behind: places before stay right
        name = element.attributes.get("name", "")
        if element.tag == "link" and name in bodies:
            content = with_child(content, element, "inertial", _inertial(bodies[name]))
        elif element.tag == "joint" and dynamics.get(name):
            said = next((child.attributes for child in element.children if child.tag == "dynamics"), {})
            words = said | {key: repr(value) for key, value in dynamics[name].items()}
            tag = " ".join(["<dynamics", *(f"{key}={quoteattr(value)}" for key, value in words.items())])
            content = with_child(content, element, "dynamics", f"{tag}/>")
    return content.decode("utf-8")


def _inertial(body: pin.Inertia) -> str:
    centre = " ".join(map(repr, body.lever.tolist()))
    moments = " ".join(f'{name}="{value!r}"' for name, value in zip(MOMENTS, six_numbers(body.inertia), strict=True))
    return f'<inertial><origin xyz="{centre}"/><mass value="{float(body.mass)!r}"/><inertia {moments}/></inertial>'
