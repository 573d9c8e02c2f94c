"""A model in SDF, as Gazebo and Drake have it: read into MuJoCo, and changed in numbers of its joints.

Gazebo's JointPositionController is a joint's servo. Its gains are of the error and of how fast that changes; what it
sums up of the error (i_gain), and a force that it adds (cmd_offset), are not played.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import pairwise
from xml.etree.ElementTree import Element, tostring

import numpy as np
import pinocchio as pin
import scipy
from defusedxml import ElementTree as SafeXml

from irtwin.errors import InputError
from irtwin.identification.progress import tell
from irtwin.robot import sdf_text
from irtwin.robot.structure import MOMENTS, inertia_of
from irtwin.robot.xml_elements import Element as XmlElement
from irtwin.robot.xml_elements import numbers, outermost, with_child
from irtwin.simulator.assembly import WORLD, ModelJoint, ModelLink, assembled
from irtwin.simulator.engine import mujoco
from irtwin.simulator.model_file import IN_DYNAMICS, Changes, ModelFile

_CONTROLLER = "JointPositionController"
_OF_CONTROLLER = {"kp": ("p_gain",), "kv": ("d_gain",), "forcerange": ("cmd_min", "cmd_max")}  # by what MJCF says
_BY_ITSELF = {"p_gain": 1.0, "d_gain": 0.01, "cmd_max": 1000.0}  # what Gazebo takes where none is said
_READ = {**IN_DYNAMICS, "stiffness": "spring_stiffness", "springref": "spring_reference"}
_KINDS = {"revolute": "revolute", "continuous": "revolute", "prismatic": "prismatic", "fixed": "fixed"}
_KNOWN = {  # where a word that SDF does not know would take a number away
    "dynamics": {*_READ.values()},
    "limit": {"lower", "upper", "effort", "velocity", "stiffness", "dissipation"},
    "inertial": {"mass", "pose", "inertia", "density", "auto_inertia_params", "fluid_added_mass"},
    "inertia": {*MOMENTS},
}
_NO_LIMIT = 1e16  # as SDF has it by itself
_MODEL = "__model__"
_BEFORE = (1, 4)  # the last version whose axes are said in the frame of the model


class SdfFile(ModelFile):
    """An SDF: its numbers are texts of elements, where those of MJCF and URDF are attributes.

    Its controllers are among its elements as servos, <position joint="...">, too.
    """

    damps_error = True  # as Gazebo's controllers do

    def holds(self, number: str) -> bool:
        """Return whether it has a place for a number, by what MJCF calls it."""
        return number in IN_DYNAMICS or number in _OF_CONTROLLER

    def number(self, joint: str, number: str) -> tuple[XmlElement, str]:
        """Return the joint, and the element of its <dynamics> that holds a number."""
        return self.element(["joint"], "name", joint), IN_DYNAMICS[number]

    def _inertial(self, body: pin.Inertia) -> str:
        return tostring(sdf_text.inertial(body), encoding="unicode")

    def _with_numbers(self, changes: Changes) -> bytes:
        """Return the file with numbers of joints and controllers changed; all else stays, byte for byte."""
        content = self.content
        for own in sorted(changes, key=lambda element: -element.start):  # from behind: places before stay right
            for name, value in _texts(own, changes[own]):
                element = next(element for element in outermost(content).walk() if element.start == own.start)
                axis, text = element.child("axis"), f"<{name}>{value!r}</{name}>"
                inside = element if axis is None else axis.child("dynamics")
                if inside is None:
                    assert axis is not None  # else it does not move
                    content = with_child(content, axis, "dynamics", f"<dynamics>{text}</dynamics>")
                else:
                    content = with_child(content, inside, name, text)
        return content

    def spec(self) -> mujoco.MjSpec:
        """Return the one model that has joints. Raises InputError where it cannot be told, ValueError if no tree."""
        root = SafeXml.fromstring(self.content, forbid_dtd=True)
        _check_words(root, str(self.path))
        models = [*root.findall("model"), *root.findall("world/model")]
        models = [model for model in models if model.find("joint/axis") is not None] or models[:1]
        if len(models) != 1:
            names = ", ".join(str(model.get("name")) for model in models)
            raise InputError(f"{self.path}: has {len(models)} models with joints ({names}); give a file of the robot's")
        (model,) = models
        nested = next((child.tag for child in model if child.tag in ("include", "model")), None)
        if nested is not None:
            raise InputError(f"{self.path}: its model has <{nested}>; write it out whole, as `gz sdf -p` does")
        source = f'{self.path}: model "{model.get("name")}"'
        frames = _Frames(model, source)
        version = tuple(int(part) for part in str(root.get("version", "1.7")).split(".") if part.isdigit())
        links = (_link(link, frames, source) for link in model.findall("link"))
        of_joints = [_joint(joint, frames, source, version <= _BEFORE) for joint in model.findall("joint")]
        plugins = (plugin for plugin in model.iter("plugin") if _is_controller(plugin.get("name", "")))
        drives = {(plugin.findtext("joint_name") or "").strip(): plugin for plugin in plugins}
        joints = [_driven(joint, drives[joint.name], source) if joint.name in drives else joint for joint in of_joints]
        gravity = root.findtext("world/gravity")
        return assembled(links, joints, np.array(numbers(gravity or "0 0 -9.81", 3, f"{self.path}: gravity")))


def read_sdf(file: ModelFile) -> SdfFile:
    """Return an SDF, its controllers among its elements; tell which of them do more than is played."""
    servos, more = [], []
    for element in file.elements:
        if element.tag == "plugin" and _is_controller(element.attributes.get("name", "")):
            joint, summed, force = (_text(file, element, name) for name in ("joint_name", "i_gain", "cmd_offset"))
            servos.append(
                XmlElement("position", {"joint": joint}, element.start, element.inside, element.stop, element.children)
            )
            more += [joint] if not summed or summed.strip("0.") or force.strip("0.") else []  # Gazebo's own is 0.1
    if more:
        tell(f"  {file.path}: i_gain and cmd_offset of the controllers of {', '.join(more)} are not played")
    return SdfFile(file.path, file.content, (*file.elements, *servos))


def _text(file: ModelFile, element: XmlElement, name: str) -> str:
    """Return the text of an element's child, nothing where it has none."""
    child = element.child(name)
    return "" if child is None else file.content[child.inside : child.stop].split(b"<")[0].decode().strip()


def _is_controller(name: str) -> bool:
    return name.rpartition("::")[2] == _CONTROLLER


def _driven(joint: ModelJoint, controller: Element, source: str) -> ModelJoint:
    """Return a joint with its controller as its servo; one that sets speeds is none."""
    where = f'{source}: controller of joint "{joint.name}"'
    stiffness, damping, most = (_number(controller, name, value, where) for name, value in _BY_ITSELF.items())
    by_speed = (controller.findtext("use_velocity_commands") or "").strip() in ("true", "1")
    if by_speed or stiffness <= 0:
        return joint
    return replace(joint, servo=(stiffness, damping), effort=min(joint.effort, most if most > 0 else np.inf))


def _texts(own: XmlElement, changes: Mapping[str, float | str | None]) -> Iterator[tuple[str, float]]:
    """Yield names and values of what changes in an element: of a range both ends."""
    for name, value in changes.items():
        if value is not None:
            values = (float(part) for part in str(value).split())
            yield from zip(_OF_CONTROLLER[name] if own.tag == "position" else (name,), values, strict=True)


class _Frames:
    """Frames of a model by name, each said in another one."""

    def __init__(self, model: Element, source: str) -> None:
        self.source = source
        self.links = {str(link.get("name")) for link in model.findall("link")}
        fixed = {frame: frame.get("attached_to", _MODEL) for frame in model.findall("frame")}
        moved = {joint: joint.findtext("child", "").strip() for joint in model.findall("joint")}
        self.attached = {str(element.get("name")): to for element, to in (fixed | moved).items()}
        self._said: dict[str, tuple[Element, str]] = {}
        for element in (*model.findall("link"), *fixed, *moved):
            pose, name = element.find("pose"), str(element.get("name"))
            beside = None if pose is None else pose.get("relative_to")
            self._said[name] = element, beside or self.attached.get(name, _MODEL)
        self._found = {_MODEL: _pose(model, source)}
        self.on: dict[str, list[str]] = {}
        for frame in fixed:
            self.on.setdefault(self._end(str(frame.get("name"))), []).append(str(frame.get("name")))

    def place(self, name: str) -> np.ndarray:
        """Return where a frame is in the world, (4, 4)."""
        way = [name]
        while way[-1] not in self._found:
            if way[-1] not in self._said:
                raise InputError(f'{self.source}: has no frame "{way[-1]}", which another is said in')
            way.append(self._said[way[-1]][1])
            self._check(way)
        for frame, beside in reversed(list(pairwise(way))):
            self._found[frame] = self._found[beside] @ _pose(self._said[frame][0], f"{self.source}: {frame}")
        return self._found[name]

    def link(self, name: str) -> str:
        """Return the link that a frame is fixed to."""
        link = self._end(name)
        if link not in self.links and link != WORLD:
            raise InputError(f'{self.source}: has no link "{name}", which a joint names')
        return link

    def _end(self, name: str) -> str:
        way = [name]
        while way[-1] in self.attached:
            way.append(self.attached[way[-1]])
            self._check(way)
        return way[-1]

    def _check(self, way: list[str]) -> None:
        if len(way) > len(self._said) + 1:
            raise InputError(f'{self.source}: frame "{way[-1]}" is said in itself')


def _pose(element: Element, where: str) -> np.ndarray:
    """Return the (4, 4) of an element's <pose>; where it has none, nothing is moved."""
    pose = element.find("pose")
    if pose is None or not (pose.text or "").strip():
        return np.eye(4)
    turned = pose.get("rotation_format") == "quat_xyzw"
    *xyz, first, second, third = values = numbers(pose.text, 7 if turned else 6, f"{where}: pose")
    if turned:
        turn = scipy.spatial.transform.Rotation.from_quat(values[3:]).as_matrix()
        return np.asarray(pin.SE3(turn, np.array(values[:3])).homogeneous)
    angles = np.array([first, second, third])
    angles = np.deg2rad(angles) if pose.get("degrees", "").strip() in ("true", "1") else angles
    return np.asarray(pin.SE3(pin.rpy.rpyToMatrix(angles), np.array(xyz)).homogeneous)


def _link(link: Element, frames: _Frames, source: str) -> ModelLink:
    name = str(link.get("name"))
    where, place = f'{source}: link "{name}"', frames.place(name)
    inertial = link.find("inertial")
    if inertial is not None and inertial.get("auto") in ("true", "1"):
        raise InputError(f"{where}: its inertia is that of its shapes (auto); give its mass and inertia")
    body = Element("inertial") if inertial is None else inertial
    within = _pose(body, where)
    turn = within[:3, :3]
    six = [_number(body, f"inertia/{name}", float(name in MOMENTS[:3]), where) for name in MOMENTS]
    own = np.linalg.inv(place)
    return ModelLink(
        name,
        place,
        _number(body, "mass", 1.0, where),
        within[:3, 3],
        turn @ inertia_of(six) @ turn.T,
        {frame: (own @ frames.place(frame))[:3, 3] for frame in frames.on.get(name, ())},
    )


def _joint(joint: Element, frames: _Frames, source: str, of_model: bool) -> ModelJoint:
    name, kind = str(joint.get("name")), str(joint.get("type"))
    where = f'{source}: joint "{name}"'
    if kind not in _KINDS:
        raise InputError(f'{where}: type "{kind}" cannot be modelled; use {", ".join(_KINDS)}')
    parent, child = (frames.link((joint.findtext(end) or "").strip()) for end in ("parent", "child"))
    place = frames.place(child)
    within = np.linalg.inv(place) @ frames.place(name)
    beside = np.eye(4) if parent == WORLD else frames.place(parent)
    origin = np.linalg.inv(beside) @ place
    axis = joint.find("axis")
    if axis is None or kind == "fixed":
        return ModelJoint(name, "fixed", parent, child, origin, within[:3, 3], np.array([0.0, 0.0, 1.0]))
    xyz = axis.find("xyz")
    expressed_in = None if xyz is None else xyz.get("expressed_in")
    of_model = axis.findtext("use_parent_model_frame", str(of_model)).strip().lower() in ("true", "1")
    frame = within if not expressed_in and not of_model else np.linalg.inv(place) @ frames.place(expressed_in or _MODEL)
    along = frame[:3, :3] @ numbers("0 0 1" if xyz is None else xyz.text, 3, f"{where}: axis")
    lower, upper = (
        _number(axis, f"limit/{end}", end_of, where) for end, end_of in (("lower", -np.inf), ("upper", np.inf))
    )
    effort = _number(axis, "limit/effort", np.inf, where)
    return ModelJoint(
        name,
        _KINDS[kind],
        parent,
        child,
        origin,
        within[:3, 3],
        along,
        (lower, upper) if kind != "continuous" and -_NO_LIMIT < lower <= upper < _NO_LIMIT else (-np.inf, np.inf),
        effort if 0 < effort < _NO_LIMIT else np.inf,
        {number: _number(axis, f"dynamics/{word}", 0.0, where) for number, word in _READ.items()},
    )


def _number(element: Element, path: str, otherwise: float, where: str) -> float:
    text = (element.findtext(path) or "").strip()
    if text.lower().lstrip("+-") in ("inf", "infinity"):
        return float(text)
    return numbers(text, 1, f"{where}: {path}")[0] if text else otherwise


def _check_words(root: Element, source: str) -> None:
    """Raise InputError where an element with numbers has one that SDF does not know: it would be lost unseen."""
    for name, known in _KNOWN.items():
        for child in (child for element in root.iter(name) for child in element):
            if child.tag not in known and ":" not in child.tag:
                raise InputError(
                    f"{source}: <{name}> has <{child.tag}>, which SDF does not know; it has {', '.join(known)}"
                )
