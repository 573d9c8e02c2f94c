"""Arms that others modelled, read from the MJCF files of Python packages.

`pip download --no-deps robosuite gymnasium-robotics -d MODELS` brings all of them; MODELS is read as it is, wheels or
what was unpacked of them. Of a file an arm keeps bodies, inertias and hinges; shapes, hands and drives stay behind.
"""

from __future__ import annotations

import re
import zipfile
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import mujoco
import numpy as np

KEPT_OF_JOINTS = ("name", "type", "axis", "pos", "range")
SPRING_ABOVE, SPRING_ALONG = 0.12, 0.22  # m from the axis of joint 2, where a counterbalance is hung up


@dataclass(frozen=True)
class Source:
    """Where an arm stands: the file, its first body, bodies to drop, and drives' torques if the file has none."""

    file: str
    body: str | None = None
    dropped: tuple[str, ...] = ()
    torque: tuple[float, ...] | None = None  # N m, of data sheets


ROBOSUITE = "robosuite/models/assets/robots/{}/robot.xml"
SOURCES = {
    "panda": Source(ROBOSUITE.format("panda")),
    "iiwa": Source(ROBOSUITE.format("iiwa")),
    "ur5e": Source(ROBOSUITE.format("ur5e")),
    "kinova3": Source(ROBOSUITE.format("kinova3")),
    "sawyer": Source(ROBOSUITE.format("sawyer")),
    "jaco": Source(ROBOSUITE.format("jaco")),
    "xarm7": Source(ROBOSUITE.format("xarm7"), torque=(50.0, 50.0, 30.0, 30.0, 30.0, 20.0, 20.0)),
    "fetch": Source(
        "gymnasium_robotics/envs/assets/fetch/robot.xml",
        "robot0:shoulder_pan_link",
        ("robot0:r_gripper_finger_link", "robot0:l_gripper_finger_link"),
        (33.8, 131.8, 76.9, 66.2, 29.4, 25.7, 7.4),
    ),
}


@dataclass(frozen=True)
class Model:
    """An arm without friction, rotors or load: MJCF that compiles, its joints in order, what its drives may give."""

    name: str
    spec: str
    joints: tuple[str, ...]
    torque: np.ndarray  # (n,) N m
    lower: np.ndarray  # (n,) rad
    upper: np.ndarray

    def compiled(self) -> mujoco.MjModel:
        """Return a new MuJoCo model of the arm; programmes keep its joints from their ends."""
        model = mujoco.MjSpec.from_string(self.spec).compile()
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_LIMIT
        return model


def read_model(folder: Path, name: str) -> Model:
    """Read an arm; raise FileNotFoundError where the folder has neither the file nor a wheel that holds it."""
    source = SOURCES[name]
    root = ElementTree.fromstring(_text(folder, source.file))
    body = next(each for each in root.iter("body") if source.body in (None, each.get("name")))
    drives = {motor.get("joint"): float(str(motor.get("ctrlrange")).split()[1]) for motor in root.iter("motor")}
    _strip(body, source.dropped)
    mjcf = _wrapped(name, body)
    own = [str(joint.get("name")) for joint in mjcf.iter("joint") if joint.get("name")]
    joints = tuple(re.sub(r"\W", "_", joint.removeprefix("robot0:")) for joint in own)
    torque = source.torque or tuple(drives[joint] for joint in own)
    for joint, clean in zip([j for j in mjcf.iter("joint") if j.get("name")], joints, strict=True):
        joint.set("name", clean)
    _equip(mjcf, joints)
    text = ElementTree.tostring(mjcf, encoding="unicode")
    lower, upper = mujoco.MjSpec.from_string(text).compile().jnt_range.T.copy()
    free = upper <= lower
    return Model(name, text, joints, np.array(torque), np.where(free, -np.pi, lower), np.where(free, np.pi, upper))


def _text(folder: Path, file: str) -> str:
    if (folder / file).exists():
        return (folder / file).read_text(encoding="utf-8")
    for wheel in sorted(folder.glob(file.split("/")[0] + "-*.whl")):
        with zipfile.ZipFile(wheel) as archive:
            return archive.read(file).decode()
    raise FileNotFoundError(f"{folder} has no {file}: pip download --no-deps robosuite gymnasium-robotics -d {folder}")


def _strip(body: ElementTree.Element, dropped: tuple[str, ...]) -> None:
    body.attrib.pop("childclass", None)
    for part in list(body):
        if part.tag == "joint":
            part.attrib = {key: value for key, value in part.attrib.items() if key in KEPT_OF_JOINTS}
        elif part.tag == "body" and part.get("name") not in dropped:
            _strip(part, dropped)
        elif part.tag != "inertial":
            body.remove(part)


def _wrapped(name: str, body: ElementTree.Element) -> ElementTree.Element:
    root = ElementTree.Element("mujoco", model=name)
    ElementTree.SubElement(root, "compiler", angle="radian", autolimits="true")
    ElementTree.SubElement(root, "worldbody").append(body)
    return root


def _equip(mjcf: ElementTree.Element, joints: tuple[str, ...]) -> None:
    """Add what effects need and nothing shows while it weighs nothing: a load, a counterbalance, a coupled wrist."""
    model = mujoco.MjSpec.from_string(ElementTree.tostring(mjcf, encoding="unicode")).compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    holders = [body for body in mjcf.iter("body") if body.find("joint") is not None]
    load = ElementTree.SubElement(holders[-1], "body", name="load", pos=_words(_flange(model, data)))
    ElementTree.SubElement(load, "inertial", pos="0 0 0", mass="0", diaginertia="0 0 0")
    axis, anchor = data.xaxis[1], data.xanchor[1]
    com = data.subtree_com[model.jnt_bodyid[1]] - anchor
    along = com - axis * (axis @ com)
    above = np.array([0.0, 0.0, 1.0]) - axis * axis[2]
    hung = {
        "hook": (0, anchor + SPRING_ABOVE * above / np.linalg.norm(above)),
        "eye": (1, anchor + SPRING_ALONG * along / np.linalg.norm(along)),
    }
    for site, (joint, place) in hung.items():
        body = model.jnt_bodyid[joint]
        local = data.xmat[body].reshape(3, 3).T @ (place - data.xpos[body])
        ElementTree.SubElement(holders[joint], "site", name=site, pos=_words(local), size="0.005")
    tendon = ElementTree.SubElement(mjcf, "tendon")
    spring = ElementTree.SubElement(tendon, "spatial", name="counterbalance", springlength="0 0.05")
    for site in hung:
        ElementTree.SubElement(spring, "site", site=site)
    wrist = ElementTree.SubElement(tendon, "fixed", name="wrist")
    for name in joints[-2:]:
        ElementTree.SubElement(wrist, "joint", joint=name, coef="1")


def _flange(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    """Return where the last frame lies in the last moving body."""
    last = model.jnt_bodyid[-1]
    return np.asarray(data.xmat[last].reshape(3, 3).T @ (data.xpos[-1] - data.xpos[last]))


def _words(numbers: np.ndarray) -> str:
    return " ".join(f"{number:.9g}" for number in numbers)
