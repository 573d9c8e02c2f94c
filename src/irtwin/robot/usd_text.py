"""USD text of a robot: what Isaac Sim and Newton need to move it."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np
import pinocchio as pin

from irtwin.robot.description import Joint, Robot
from irtwin.robot.structure import Connection, Solid, principal, structure_of

_HEAD = """#usda 1.0
(
    defaultPrim = "{}"
    kilogramsPerUnit = 1
    metersPerUnit = 1
    upAxis = "Z"
)
"""
_GRAVITY = ["vector3f physics:gravityDirection = (0, 0, -1)", "float physics:gravityMagnitude = 9.81"]
_SHAPES = {"box": "Cube", "cylinder": "Cylinder", "sphere": "Sphere"}
_PER_DEGREE = np.pi / 180


def usd_text(robot: Robot, armature: Mapping[str, float]) -> str:
    """Return a robot as USD text, its base fixed to the world; `armature`, kg m^2 (kg), of joints by name.

    Links that are fixed to another are frames of it; the inertia of all stands at the link that moves. Numbers of
    joints are said for Newton and for PhysX. Meshes are left out. Most numbers are of single precision, as USD has it.
    """
    structure = structure_of(robot)
    joints = {joint.name: joint for joint in robot.joints}
    links = [body.name for body in structure.bodies]
    names = _identifiers([robot.name, *links, *(connection.name for connection in structure.connections)])
    whole, base = names[robot.name], links[0]
    moving, places, within = {base: base}, {base: np.eye(4)}, {base: np.eye(4)}  # links of each; in the world; in these
    bodies: dict[str, list[str]] = {base: [*_place(np.eye(4)), *_mass(structure.bodies[0].spatial)]}
    fixed = _prim("PhysicsFixedJoint", "world_to_base", [f"rel physics:body1 = </{whole}/{names[base]}>"])
    connections = [fixed]
    for connection in structure.connections:
        place = places[connection.child] = places[connection.parent] @ connection.origin.transform
        on = moving[connection.parent]
        if connection.axis is None:
            moving[connection.child] = on
            within[connection.child] = within[connection.parent] @ connection.origin.transform
            bodies[on] += _prim("Xform", names[connection.child], _place(within[connection.child]))
            continue
        moving[connection.child], within[connection.child] = connection.child, np.eye(4)
        bodies[connection.child] = [*_place(place), *_mass(robot.model.inertias[1 + robot.index(connection.name)])]
        ends = [f"rel physics:body{end} = </{whole}/{names[link]}>" for end, link in enumerate((on, connection.child))]
        frame = within[connection.parent] @ connection.origin.transform
        lines = [*ends, *_numbers(connection, joints[connection.name], frame, armature.get(connection.name, 0.0))]
        axis = "linear" if connection.kind == "prismatic" else "angular"
        kind = "PhysicsPrismaticJoint" if connection.kind == "prismatic" else "PhysicsRevoluteJoint"
        connections.append(
            _prim(kind, names[connection.name], lines, ("NewtonJointAPI", f"PhysxJointAxisAPI:{axis}"), connection.name)
        )
    for number, solid in enumerate(structure.solids):
        if solid.kind in _SHAPES:
            bodies[moving[solid.link]] += _shape(solid, within[solid.link], f"{solid.purpose}_{number}")
    prims = (
        _prim("Xform", names[link], lines, ("PhysicsRigidBodyAPI", "PhysicsMassAPI"), link)
        for link, lines in bodies.items()
    )
    inside = [line for prim in (*prims, *connections) for line in prim]
    scene = _prim("PhysicsScene", "physicsScene", _GRAVITY)
    arm = _prim("Xform", whole, inside, ("PhysicsArticulationRootAPI",), robot.name)
    return "\n".join([_HEAD.format(whole), *scene, *arm, ""])


def _prim(kind: str, name: str, inside: Iterable[str], schemas: Sequence[str] = (), called: str = "") -> list[str]:
    metadata = [f"prepend apiSchemas = [{', '.join(map(_text, schemas))}]"] if schemas else []
    metadata += [f"displayName = {_text(called)}"] if called not in ("", name) else []
    head = [f'def {kind} "{name}" (', *_within(metadata), ")"] if metadata else [f'def {kind} "{name}"']
    return [*head, "{", *_within(inside), "}"]


def _within(lines: Iterable[str]) -> Iterator[str]:
    return (f"    {line}" for line in lines)


def _place(transform: np.ndarray) -> list[str]:
    rows = ", ".join(_tuple(row) for row in transform.T)
    return [f"matrix4d xformOp:transform = ({rows})", 'uniform token[] xformOpOrder = ["xformOp:transform"]']


def _mass(body: pin.Inertia) -> list[str]:
    if not body.mass:
        return []
    moments, axes = principal(body.inertia)
    return [
        f"float physics:mass = {float(body.mass)!r}",
        f"point3f physics:centerOfMass = {_tuple(body.lever)}",
        f"float3 physics:diagonalInertia = {_tuple(moments)}",
        f"quatf physics:principalAxes = {_quaternion(axes)}",
    ]


def _numbers(connection: Connection, joint: Joint, frame: np.ndarray, armature: float) -> Iterator[str]:
    """Yield what a joint says: its frames, whose x axis it moves about or along, limits, and numbers."""
    assert connection.axis is not None
    turn = pin.Quaternion.FromTwoVectors(np.array([1.0, 0.0, 0.0]), np.array(connection.axis)).matrix()
    slides = connection.kind == "prismatic"
    angle, per_angle = (1.0, 1.0) if slides else (1 / _PER_DEGREE, _PER_DEGREE)
    axis = "linear" if slides else "angular"
    yield 'uniform token physics:axis = "X"'
    yield f"point3f physics:localPos0 = {_tuple(frame[:3, 3])}"
    yield f"quatf physics:localRot0 = {_quaternion(frame[:3, :3] @ turn)}"
    yield "point3f physics:localPos1 = (0, 0, 0)"
    yield f"quatf physics:localRot1 = {_quaternion(turn)}"
    for end in ("lower", "upper"):
        if np.isfinite(getattr(joint, end)):
            yield f"float physics:{end}Limit = {getattr(joint, end) * angle!r}"
    for newton, physx, value in (
        ("armature", ("armature",), armature),
        ("damping", ("viscousFrictionCoefficient",), connection.damping * per_angle),
        ("friction", ("staticFrictionEffort", "dynamicFrictionEffort"), connection.friction),
    ):
        yield f"float newton:{newton} = {float(value)!r}"
        yield from (f"float physxJointAxis:{axis}:{name} = {float(value)!r}" for name in physx)


def _shape(solid: Solid, link: np.ndarray, name: str) -> list[str]:
    place = link @ solid.origin.transform
    if solid.kind == "box":
        place = place @ np.diag([*solid.size, 1.0])
    sizes = {"box": ["double size = 1"], "sphere": [f"double radius = {solid.size[0]!r}"]}
    sizes["cylinder"] = [
        f"double radius = {solid.size[0]!r}",
        'uniform token axis = "Z"',
        f"double height = {solid.size[-1]!r}",
    ]
    colour = [] if solid.colour is None else [f"color3f[] primvars:displayColor = [{_tuple(solid.colour[:3])}]"]
    schemas = ("PhysicsCollisionAPI",) if solid.purpose == "collision" else ()
    unseen = ['uniform token purpose = "guide"'] if schemas else []
    return _prim(_SHAPES[solid.kind], name, [*_place(place), *sizes[solid.kind], *colour, *unseen], schemas)


def _identifiers(names: Iterable[str]) -> dict[str, str]:
    """Return names as USD allows them: letters, digits and lines; no two the same."""
    identifiers: dict[str, str] = {}
    taken: set[str] = {"physicsScene", "world_to_base"}
    for name in dict.fromkeys(names):
        plain = re.sub(r"\W|^(?=\d)", "_", name, flags=re.ASCII) or "_"
        identifiers[name] = next(
            candidate
            for candidate in (plain, *(f"{plain}_{k}" for k in range(len(taken) + 1)))
            if candidate not in taken
        )
        taken.add(identifiers[name])
    return identifiers


def _text(value: str) -> str:
    escaped = value.replace("\\", "\\\\").replace('"', '\\"').replace("\n", " ")
    return f'"{escaped}"'


def _quaternion(turn: np.ndarray) -> str:
    x, y, z, w = pin.Quaternion(turn).coeffs()
    return _tuple((w, x, y, z))


def _tuple(values: Iterable[float]) -> str:
    return f"({', '.join(repr(float(value)) for value in values)})"
