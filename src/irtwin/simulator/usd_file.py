"""A model in USD, as Isaac Sim and Newton have it: read into MuJoCo, and changed by a layer over it.

The layer stands beside the file, or in a copy of the package where that is one.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import scipy
from pxr import Gf, Sdf, Tf, Usd, UsdGeom, UsdPhysics

from irtwin.errors import InputError
from irtwin.input_file import read_input, real_path
from irtwin.robot.structure import principal
from irtwin.robot.xml_elements import Element
from irtwin.simulator.assembly import WORLD, ModelJoint, ModelLink, assembled
from irtwin.simulator.engine import mujoco
from irtwin.simulator.model_file import Bodies, Changes, ModelFile
from irtwin.simulator.usd_package import PACKAGE, check_package, new_name, packed

_MOST = 200_000_000  # bytes; meshes are within
_KINDS = {"PhysicsRevoluteJoint": "revolute", "PhysicsPrismaticJoint": "prismatic", "PhysicsFixedJoint": "fixed"}
_AXES = {"revolute": "angular", "prismatic": "linear"}
_DEGREES = 180 / np.pi


@dataclass(frozen=True)
class _Place:
    """An attribute that holds a joint's number, "*" its axis, and the schema that has it; whether it is per degree."""

    attribute: str
    schema: str
    per_degree: bool = False

    def named(self, kind: str) -> tuple[str, str]:
        """Return attribute and schema of a kind of joint."""
        return self.attribute.replace("*", _AXES[kind]), self.schema.replace("*", _AXES[kind])


_DRIVE = "PhysicsDriveAPI:*"
_PLACES = {  # by what MJCF calls them: Newton's, PhysX's, then others that are read
    "armature": (
        _Place("newton:armature", "NewtonJointAPI"),
        _Place("physxJointAxis:*:armature", "PhysxJointAxisAPI:*"),
        _Place("mjc:armature", "MjcJointAPI"),
        _Place("physxJoint:armature", "PhysxJointAPI"),
    ),
    "damping": (
        _Place("newton:damping", "NewtonJointAPI", True),
        _Place("physxJointAxis:*:viscousFrictionCoefficient", "PhysxJointAxisAPI:*", True),
        _Place("mjc:damping", "MjcJointAPI"),
    ),
    "frictionloss": (
        _Place("newton:friction", "NewtonJointAPI"),
        _Place("physxJointAxis:*:dynamicFrictionEffort", "PhysxJointAxisAPI:*"),
        _Place("physxJointAxis:*:staticFrictionEffort", "PhysxJointAxisAPI:*"),
        _Place("mjc:frictionloss", "MjcJointAPI"),
    ),
    "kp": (_Place("drive:*:physics:stiffness", _DRIVE, True),),
    "kv": (_Place("drive:*:physics:damping", _DRIVE, True),),
    "forcerange": (_Place("drive:*:physics:maxForce", _DRIVE),),
}
_OF_LAYER = {"subLayers", "subLayerOffsets", "customLayerData", "comment", "documentation"}  # not of the stage
_FIRST_OF_OTHERS = "mjc:", "physxJoint:"  # where nobody said a number it is not put there


class UsdFile(ModelFile):
    """A USD file; its elements are its joints, and their drives of stiffness."""

    @cached_property
    def stage(self) -> Any:
        """The stage."""
        return Usd.Stage.Open(str(self.path))

    def holds(self, number: str) -> bool:
        """Return whether it has a place for a number, by what MJCF calls it."""
        return number in _PLACES

    def check_written(self, out: Path) -> None:
        """Raise InputError where a layer over it would not find it, or be of another kind than its name says."""
        if self.is_package:
            if out.suffix.lower() != PACKAGE:
                raise InputError(f"{out}: is to be a package, as {self.path} is; give it the ending {PACKAGE}")
        elif out.absolute().parent != self.path.absolute().parent or out.suffix.lower() != self.path.suffix.lower():
            raise InputError(f"{out}: is to be a layer over {self.path}; give a file beside that, and with its ending")

    def holds_body(self, name: str) -> bool:
        """Return whether a prim is a body whose lengths are stretched alike: others have axes that are not square."""
        prim = self.stage.GetPrimAtPath(name)
        stretch = _world(self, prim)[1] if prim else np.zeros(3)
        return bool(stretch.min() > 0 and np.allclose(stretch, stretch[0]))

    def changed(self, changes: Changes, bodies: Bodies | None = None) -> bytes:
        """Return a layer that has the file beneath and numbers and bodies anew; the file itself where none changes.

        Of a package a copy, in which such a layer comes first.
        """
        if not changes and not bodies:
            return self.content
        with tempfile.TemporaryDirectory() as folder:
            if self.is_package:
                names = check_package(self.path)
                layer = Path(folder, new_name(names))
                self._write_layer(layer, names[0], changes, bodies or {})
                return packed(self.path, names, layer)
            layer = Path(folder, self.path.name)
            self._write_layer(layer, self.path.name, changes, bodies or {})
            return layer.read_bytes()

    @property
    def is_package(self) -> bool:
        """Whether it is a package of USD files."""
        return self.path.suffix.lower() == PACKAGE

    def _write_layer(self, place: Path, beneath: str, changes: Changes, bodies: Bodies) -> None:
        layer = Sdf.Layer.CreateNew(str(place))
        root, own = layer.pseudoRoot, self.stage.GetRootLayer().pseudoRoot
        for key in set(own.ListInfoKeys()) - _OF_LAYER:
            root.SetInfo(key, own.GetInfo(key))
        layer.subLayerPaths.append(f"./{beneath}")
        for element, values in changes.items():
            for number, value in values.items():
                if value is not None:  # of a range the end, as drives have no least
                    self._put(layer, element.attributes["path"], number, float(str(value).split()[-1]))
        for path, body in bodies.items():
            self._put_body(layer, path, body)
        layer.Save()

    def spec(self) -> mujoco.MjSpec:
        """Return MuJoCo's specification of it. Raises InputError where it cannot be told, ValueError if no tree."""
        bodies = [prim for prim in self.stage.Traverse() if prim.HasAPI(UsdPhysics.RigidBodyAPI)]
        connections = [
            connection for prim in _joints(self.stage) if (connection := _connection(self, prim)) is not None
        ]
        moved = {
            connection.child for connection in connections if connection.parent != WORLD or connection.kind != "fixed"
        }
        links = [_link(self, prim, str(prim.GetPath()) in moved) for prim in bodies]
        return assembled(links, connections, _gravity(self))

    @cached_property
    def units(self) -> tuple[float, float]:
        """Return a unit of length, m, and of mass, kg."""
        return UsdGeom.GetStageMetersPerUnit(self.stage), UsdPhysics.GetStageKilogramsPerUnit(self.stage)

    def _put(self, layer: Any, path: str, number: str, value: float) -> None:
        prim, over = self.stage.GetPrimAtPath(path), Sdf.CreatePrimInLayer(layer, path)
        kind = _KINDS[prim.GetTypeName()]
        authored = [place for place in _PLACES[number] if prim.GetAttribute(place.named(kind)[0]).HasAuthoredValue()]
        for place in authored or [
            place for place in _PLACES[number] if not place.attribute.startswith(_FIRST_OF_OTHERS)
        ]:
            name, schema = place.named(kind)
            listed = over.GetInfo("apiSchemas").prependedItems if over.HasInfo("apiSchemas") else []
            if schema not in (*prim.GetAppliedSchemas(), *listed):
                over.SetInfo("apiSchemas", Sdf.TokenListOp.Create(prependedItems=[*listed, schema]))
            own = prim.GetAttribute(name)
            attribute = Sdf.AttributeSpec(over, name, own.GetTypeName() if own else Sdf.ValueTypeNames.Float)
            attribute.default = value / self.unit(number, kind, place.per_degree)

    def _put_body(self, layer: Any, path: str, body: pin.Inertia) -> None:
        (length, mass), (_, stretch) = self.units, _world(self, self.stage.GetPrimAtPath(path))
        over = Sdf.CreatePrimInLayer(layer, path)
        if not self.stage.GetPrimAtPath(path).HasAPI(UsdPhysics.MassAPI):
            over.SetInfo("apiSchemas", Sdf.TokenListOp.Create(prependedItems=["PhysicsMassAPI"]))
        moments, axes = principal(body.inertia)
        turn = scipy.spatial.transform.Rotation.from_matrix(axes).as_quat(scalar_first=True)
        for name, kind, value in (
            ("mass", Sdf.ValueTypeNames.Float, body.mass / mass),
            ("centerOfMass", Sdf.ValueTypeNames.Point3f, Gf.Vec3f(*(body.lever / stretch))),
            ("diagonalInertia", Sdf.ValueTypeNames.Float3, Gf.Vec3f(*(moments / mass / length**2))),
            ("principalAxes", Sdf.ValueTypeNames.Quatf, Gf.Quatf(*turn)),
        ):
            Sdf.AttributeSpec(over, f"physics:{name}", kind).default = value

    def unit(self, number: str, kind: str, per_degree: bool) -> float:
        """Return what a joint's number of one is in SI units of a radian."""
        length, mass = self.units
        of_torque = number in ("frictionloss", "forcerange")
        if kind == "prismatic":
            return mass * length if of_torque else mass
        return mass * length**2 * (_DEGREES if per_degree else 1.0)


def read_usd(path: Path) -> UsdFile:
    """Read a USD file, and look at those that it names.

    Raises InputError where one cannot be read, is larger than 200 MB, missing, or outside the folder.
    """
    content = read_input(path, _MOST)
    try:
        _check_inside(path, path.parent, set())
        file = UsdFile(path, content, ())
        return UsdFile(path, content, tuple(_elements(file.stage)))
    except Tf.ErrorException as error:
        raise InputError(f"{path}: is no USD that can be read ({_reason(error)})") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is no USD that can be read (a name in it is no UTF-8)") from error


def _reason(error: Exception) -> str:
    """Return the last line of words that USD says; it quotes what it reads, which may be no text."""
    try:
        lines = str(error.args[0]).splitlines() if error.args else []
    except UnicodeDecodeError:
        return "it is no UTF-8"
    return next((line.strip() for line in reversed(lines) if any(map(str.isalpha, line))), "no reason is given")


def _check_inside(path: Path, folder: Path, seen: set[Path]) -> None:
    seen.add(path)
    if path.suffix.lower() == PACKAGE:
        check_package(path)
        return
    for named in Sdf.Layer.FindOrOpen(str(path)).GetCompositionAssetDependencies():
        place = path.parent / named
        real = real_path(place)
        if real is None or not real.is_relative_to(folder.resolve()):
            raise InputError(f"{path}: names {named}, which is outside the folder of the model; move it there")
        if not real.is_file():
            raise InputError(f"{path}: names {named}, which is missing; put it there")
        if real not in seen:
            read_input(real, _MOST)
            _check_inside(real, folder, seen)


def _joints(stage: Any) -> Iterator[Any]:
    for prim in stage.Traverse():
        closes = prim.GetAttribute("physics:excludeFromArticulation").Get()
        if prim.IsA(UsdPhysics.Joint) and not closes and prim.GetAttribute("physics:jointEnabled").Get() is not False:
            yield prim


def _elements(stage: Any) -> Iterator[Element]:
    for prim in _joints(stage):
        attributes = {"name": _name(prim), "joint": _name(prim), "path": str(prim.GetPath())}
        yield Element("joint", attributes, 0, 0)
        yield Element("position", attributes, 0, 0)


def _name(prim: Any) -> str:
    return str(prim.GetDisplayName() or prim.GetName())


def _world(file: UsdFile, prim: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return where a prim is in the world, (4, 4), m, and by what (3,) its own lengths are stretched to be m."""
    length, _ = file.units
    place = np.array(UsdGeom.XformCache(Usd.TimeCode.Default()).GetLocalToWorldTransform(prim)).T
    stretch = np.linalg.norm(place[:3, :3], axis=0)
    place[:3, :3] /= stretch
    place[:3, 3] *= length
    return place, stretch * length


def _frame(position: Any, turn: Any, stretch: np.ndarray) -> np.ndarray:
    frame, quaternion = np.eye(4), np.array([*turn.GetImaginary(), turn.GetReal()])
    if quaternion.any():
        frame[:3, :3] = scipy.spatial.transform.Rotation.from_quat(quaternion).as_matrix()
    frame[:3, 3] = np.array(position) * stretch
    return frame


def _end(file: UsdFile, prim: Any, end: int) -> tuple[str, np.ndarray]:
    """Return the body that an end of a joint is fixed to, and the joint's frame (4, 4) in it."""
    targets = prim.GetRelationship(f"physics:body{end}").GetTargets()
    target = file.stage.GetPrimAtPath(targets[0]) if targets else file.stage.GetPseudoRoot()
    if not target:
        raise InputError(f'{file.path}: joint "{_name(prim)}" names {targets[0]}, which is missing')
    body = target
    while not body.IsPseudoRoot() and not body.HasAPI(UsdPhysics.RigidBodyAPI):
        body = body.GetParent()
    place, stretch = _world(file, target) if targets else (np.eye(4), np.full(3, file.units[0]))
    position, turn = (prim.GetAttribute(f"physics:local{part}{end}").Get() for part in ("Pos", "Rot"))
    frame = place @ _frame(position, turn, stretch)
    if body.IsPseudoRoot():
        return WORLD, frame
    return str(body.GetPath()), np.linalg.inv(_world(file, body)[0]) @ frame


def _connection(file: UsdFile, prim: Any) -> ModelJoint | None:
    (parent, above), (child, below) = _end(file, prim, 0), _end(file, prim, 1)
    kind = _KINDS.get(prim.GetTypeName())
    if kind is None:
        raise InputError(
            f'{file.path}: joint "{_name(prim)}" is a {prim.GetTypeName()}, which cannot be modelled; '
            f"use {', '.join(_KINDS)}"
        )
    turned = child == WORLD
    if turned:
        (parent, above), (child, below) = (child, below), (parent, above)
    origin = above @ np.linalg.inv(below)
    if child == WORLD or kind == "fixed":
        fixed = ModelJoint(_name(prim), "fixed", parent, child, origin, below[:3, 3], below[:3, 2])
        return None if child == WORLD else fixed
    along = prim.GetAttribute("physics:axis").Get()
    if along not in tuple("XYZ"):
        raise InputError(f'{file.path}: joint "{_name(prim)}" moves along {along}; give X, Y or Z as its physics:axis')
    axis = below[:3, "XYZ".index(along)]
    unit = 1 / _DEGREES if kind == "revolute" else file.units[0]
    lower, upper = (unit * prim.GetAttribute(f"physics:{end}Limit").Get() for end in ("lower", "upper"))
    servo, effort = _servo(file, prim, kind)
    return ModelJoint(
        _name(prim),
        kind,
        parent,
        child,
        origin,
        below[:3, 3],
        -axis if turned else axis,
        (lower, upper),
        effort,
        {number: _number(file, prim, kind, number) for number in ("armature", "damping", "frictionloss")},
        servo,
    )


def _number(file: UsdFile, prim: Any, kind: str, number: str) -> float:
    for place in _PLACES[number]:
        attribute = prim.GetAttribute(place.named(kind)[0])
        if attribute.HasAuthoredValue():
            value = attribute.Get()
            if not isinstance(value, int | float):
                raise InputError(f'{file.path}: joint "{_name(prim)}" has no number as its {attribute.GetName()}')
            return float(value) * file.unit(number, kind, place.per_degree)
    return 0.0


def _servo(file: UsdFile, prim: Any, kind: str) -> tuple[tuple[float, float] | None, float]:
    """Return the gains of a drive that pulls to a position, None where the joint has none, and the most it gives."""
    of = f"drive:{_AXES[kind]}:physics"
    stiffness, damping, most = (_number(file, prim, kind, number) for number in ("kp", "kv", "forcerange"))
    limit = most if prim.GetAttribute(f"{of}:maxForce").HasAuthoredValue() else np.inf
    is_force = prim.GetAttribute(f"{of}:type").Get() in (None, "force")
    return ((stiffness, damping) if stiffness > 0 and is_force else None), limit


def _link(file: UsdFile, prim: Any, moves: bool) -> ModelLink:
    place, stretch = _world(file, prim)
    name, has_mass = str(prim.GetPath()), prim.HasAPI(UsdPhysics.MassAPI)
    own = UsdPhysics.MassAPI(prim)
    mass, centre, moments = (
        get().Get() for get in (own.GetMassAttr, own.GetCenterOfMassAttr, own.GetDiagonalInertiaAttr)
    )
    if not has_mass or not mass or not any(moments) or not np.isfinite(centre).all():
        if moves and (mass or _has_shapes(prim)):
            raise InputError(
                f"{file.path}: {name} takes its mass from its shapes; give it physics:mass, physics:centerOfMass and "
                "physics:diagonalInertia"
            )
        return ModelLink(name, place)
    length, unit = file.units
    turn = _frame((0, 0, 0), own.GetPrincipalAxesAttr().Get(), stretch)[:3, :3]
    inertia = turn * np.array(moments) @ turn.T * unit * length**2
    return ModelLink(name, place, mass * unit, np.array(centre) * stretch, inertia)


def _has_shapes(body: Any) -> bool:
    prims = iter(Usd.PrimRange(body))
    for prim in prims:
        if prim != body and prim.HasAPI(UsdPhysics.RigidBodyAPI):
            prims.PruneChildren()
        elif prim.HasAPI(UsdPhysics.CollisionAPI):
            return True
    return False


def _gravity(file: UsdFile) -> np.ndarray:
    length, _ = file.units
    scene = next((prim for prim in file.stage.Traverse() if prim.IsA(UsdPhysics.Scene)), None)
    along = np.zeros(3) if scene is None else np.array(UsdPhysics.Scene(scene).GetGravityDirectionAttr().Get())
    most = -np.inf if scene is None else UsdPhysics.Scene(scene).GetGravityMagnitudeAttr().Get()
    if not along.any():
        along = -np.eye(3)["XYZ".index(UsdGeom.GetStageUpAxis(file.stage))]
    return along / np.linalg.norm(along) * (9.81 if most < 0 else most * length)
