"""Torque of a longer robot in symbols: Newton and Euler's recursion, each of its results named.

Written out, the torque of six joints has tens of thousands of terms. By names for what joint after joint gives it is a
list of short formulas, as [Khalil and Kleinfinger 1987] customise the recursion of [Luh, Walker and Paul 1980].
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from irtwin.robot.description import Robot
from irtwin.robot.equations import deviation_of, latex_names, library, symbols_of
from irtwin.robot.kinematics import joint_motions

_DUST = 1e-12  # of metres, radians and kg: what rounding leaves
_DIGITS = 6  # of a coefficient that is shown

Vector = list[Any]


@dataclass(frozen=True)
class RecursiveEquations:
    """The rigid-body torque of joints in symbols q1, dq1, ddq1, ... (rad or m, s), N m or N.

    `steps`: a symbol and its formula each, of inputs and steps before; `torques`, tau1 first, of these; `joints`: how
    many there are. `deviation`: as of `EquationsOfMotion`.
    """

    steps: tuple[tuple[Any, Any], ...]
    torques: tuple[tuple[Any, Any], ...]
    joints: int
    deviation: float

    def alone(self, joint: int) -> RecursiveEquations:
        """Return what the torque of one joint takes."""
        torques = (self.torques[joint],)
        return replace(self, steps=_needed(self.steps, torques), torques=torques)

    def text(self) -> str:
        """Return a line for each step, then for each torque, coefficients in six digits."""
        return "\n".join(f"{name} = {formula.evalf(_DIGITS)}" for name, formula in (*self.steps, *self.torques))

    def latex(self) -> str:
        """Return the same in LaTeX."""
        sympy, names = library(), latex_names(self.joints)
        written = (
            (sympy.latex(name), sympy.latex(formula.evalf(_DIGITS), symbol_names=names))
            for name, formula in (*self.steps, *self.torques)
        )
        return "\n".join(rf"{name} = {formula} \\" for name, formula in written)


def recursive_equations(robot: Robot) -> RecursiveEquations:
    """Derive the torque from the robot's nominal masses and dimensions: rigid bodies, no friction, no rotors.

    Raises InputError where sympy is missing.
    """
    sympy, recursion = library(), _Recursion(robot)
    torques = [(sympy.Symbol(f"tau{n}"), torque) for n, torque in enumerate(recursion.torques(), start=1)]
    steps = _needed(recursion.steps, torques)
    deviation = deviation_of(robot, _evaluated([*steps, *torques], [name for name, _ in torques]))
    return RecursiveEquations(steps, tuple(torques), len(robot.joints), deviation)


@dataclass(frozen=True)
class _Frame:
    """A joint's frame in its parent's: what turns vectors `back` into it, where it is, its axis, whether it slides."""

    back: list[Vector]
    shift: Vector
    axis: Vector
    slides: bool


@dataclass(frozen=True)
class _State:
    """Angular velocity and acceleration of a body, and the acceleration of its joint, in the joint's frame."""

    velocity: Vector
    turning: Vector
    acceleration: Vector


class _Recursion:
    """Newton and Euler's recursion over a robot's tree, vectors in the frames of the joints."""

    def __init__(self, robot: Robot):
        """Take the robot's tree."""
        self._sympy, self._model = library(), robot.model
        self._motions = joint_motions(robot.model)
        self._q, self._dq, self._ddq = symbols_of(len(robot.joints))
        self.steps: list[tuple[Any, Any]] = []

    def torques(self) -> list[Any]:
        """Return each joint's torque, in the order of the robot's joints; `steps` are made on the way."""
        still, model = self._vector(np.zeros(3)), self._model
        frames = {joint: self._frame(joint) for joint in range(1, model.njoints)}
        states = {0: _State(still, still, self._vector(-model.gravity.linear))}  # the base accelerates for gravity
        forces, moments = {0: still}, {0: still}
        for joint, frame in frames.items():
            states[joint] = self._state(joint, frame, states[model.parents[joint]])
            forces[joint], moments[joint] = self._taken(joint, states[joint])
        torques = []
        for joint, frame in reversed(frames.items()):
            parent, outwards = model.parents[joint], _transposed(frame.back)
            force, moment = self._named(forces[joint]), self._named(moments[joint])
            torques.append(_dot(frame.axis, force if frame.slides else moment))
            borne = self._named(_times(outwards, force))
            forces[parent] = _sum(forces[parent], borne)
            moments[parent] = _sum(moments[parent], _times(outwards, moment), _cross(frame.shift, borne))
        return torques[::-1]

    def _state(self, joint: int, frame: _Frame, parent: _State) -> _State:
        """Return how the body behind a joint moves, by how its parent does."""
        dq, ddq = self._dq[joint - 1], self._ddq[joint - 1]
        around = _cross(parent.velocity, _cross(parent.velocity, frame.shift))
        here = _times(frame.back, _sum(parent.acceleration, _cross(parent.turning, frame.shift), around))
        velocity = self._named(_times(frame.back, parent.velocity))
        turning = _times(frame.back, parent.turning)
        across = _cross(velocity, frame.axis)
        if frame.slides:
            here = _sum(here, _scaled(across, 2 * dq), _scaled(frame.axis, ddq))
        else:
            velocity = self._named(_sum(velocity, _scaled(frame.axis, dq)))
            turning = _sum(turning, _scaled(across, dq), _scaled(frame.axis, ddq))
        return _State(velocity, self._named(turning), self._named(here))

    def _taken(self, joint: int, state: _State) -> tuple[Vector, Vector]:
        """Return the force on a body and the moment about its joint that its motion takes."""
        inertia = self._model.inertias[joint]
        centre, mass = self._vector(inertia.lever), self._number(inertia.mass)
        about = [self._vector(row) for row in inertia.inertia]
        around = _cross(state.velocity, _cross(state.velocity, centre))
        force = self._named(_scaled(_sum(state.acceleration, _cross(state.turning, centre), around), mass))
        spin = self._named(_times(about, state.velocity))
        return force, _sum(_times(about, state.turning), _cross(state.velocity, spin), _cross(centre, force))

    def _frame(self, joint: int) -> _Frame:
        model, q = self._model, self._q[joint - 1]
        linear, angular = np.split(self._motions[joint - 1], 2)
        fixed = model.jointPlacements[joint]
        shift = self._vector(fixed.translation)
        if np.linalg.norm(linear) > np.linalg.norm(angular):
            axis, back = self._vector(linear), [self._vector(row) for row in fixed.rotation.T]
            return _Frame(back, _sum(shift, _scaled(_times(_transposed(back), axis), q)), axis, True)
        axis = self._vector(angular)
        cosine, sine = (self._symbol(f"{name[0]}{joint}", getattr(self._sympy, name)(q)) for name in ("cos", "sin"))
        turned = [
            [
                cosine * int(row == column) + (1 - cosine) * axis[row] * axis[column] + sine * skew
                for column, skew in enumerate(skews)
            ]
            for row, skews in enumerate(_skew_transposed(axis))
        ]
        back = [self._named([_dot(row, self._vector(column)) for column in fixed.rotation]) for row in turned]
        return _Frame(back, shift, axis, False)

    def _symbol(self, name: str, formula: Any) -> Any:
        symbol = self._sympy.Symbol(name)
        self.steps.append((symbol, formula))
        return symbol

    def _number(self, value: float) -> Any:
        whole = round(value)
        if abs(value - whole) < _DUST:
            return self._sympy.Integer(whole)
        return self._sympy.Float(float(value))

    def _vector(self, values: np.ndarray) -> Vector:
        return [self._number(float(value)) for value in values]

    def _named(self, vector: Vector) -> Vector:
        """Return a vector whose entries are numbers or symbols: what is more gets a name of its own."""
        return [self._name(self._sympy.sympify(entry)) for entry in vector]

    def _name(self, entry: Any) -> Any:
        if entry.is_number or entry.is_Symbol or (-entry).is_Symbol:
            return entry
        return self._symbol(f"v{len(self.steps) + 1}", entry)


def _needed(steps: Sequence[tuple[Any, Any]], torques: Sequence[tuple[Any, Any]]) -> tuple[tuple[Any, Any], ...]:
    """Return the steps that torques need."""
    wanted = {symbol for _, torque in torques for symbol in torque.free_symbols}
    kept = []
    for symbol, formula in reversed(steps):
        if symbol in wanted:
            kept.append((symbol, formula))
            wanted |= formula.free_symbols
    return tuple(reversed(kept))


def _evaluated(steps: Sequence[tuple[Any, Any]], asked: Sequence[Any]) -> Callable[..., list[float]]:
    """Return a function of positions, speeds and accelerations (3 n) that gives what the steps say of symbols."""
    sympy = library()
    inputs = [symbol for symbols in symbols_of(len(asked)) for symbol in symbols]
    functions = []
    for symbol, formula in steps:
        own = sorted(formula.free_symbols, key=str)
        functions.append((symbol, own, sympy.lambdify(own, formula, "math")))

    def values(*given: float) -> list[float]:
        known: dict[Any, Any] = dict(zip(inputs, given, strict=True))
        for symbol, own, function in functions:
            known[symbol] = function(*(known[each] for each in own))
        return [float(known[symbol]) for symbol in asked]

    return values


def _times(matrix: list[Vector], vector: Vector) -> Vector:
    return [_dot(row, vector) for row in matrix]


def _transposed(matrix: list[Vector]) -> list[Vector]:
    return [list(column) for column in zip(*matrix, strict=True)]


def _dot(one: Vector, other: Vector) -> Any:
    return sum(a * b for a, b in zip(one, other, strict=True))


def _scaled(vector: Vector, factor: Any) -> Vector:
    return [factor * entry for entry in vector]


def _sum(*vectors: Vector) -> Vector:
    return [sum(entries) for entries in zip(*vectors, strict=True)]


def _cross(one: Vector, other: Vector) -> Vector:
    (a, b, c), (x, y, z) = one, other
    return [b * z - c * y, c * x - a * z, a * y - b * x]


def _skew_transposed(axis: Vector) -> list[Vector]:
    x, y, z = axis
    return [[0, z, -y], [-z, 0, x], [y, -x, 0]]
