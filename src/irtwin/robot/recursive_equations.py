"""Torque of a longer robot in symbols: Newton and Euler's recursion, each of its results named.

Written out, the torque of six joints has tens of thousands of terms. By names for what joint after joint gives it is a
list of short formulas, as [Khalil and Kleinfinger 1987] customise the recursion of [Luh, Walker and Paul 1980].
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pinocchio as pin

from irtwin.robot.description import Robot
from irtwin.robot.equations import deviation_of, latex_names, library, symbols_of

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


class _Recursion:
    """Newton and Euler's recursion over a robot's tree, vectors in the frames of the joints."""

    def __init__(self, robot: Robot):
        """Take the robot's tree."""
        self._sympy, self._robot, self._model = library(), robot, robot.model
        self._q, self._dq, self._ddq = symbols_of(len(robot.joints))
        self.steps: list[tuple[Any, Any]] = []

    def torques(self) -> list[Any]:
        """Return each joint's torque, in the order of the robot's joints; `steps` are made on the way."""
        count = self._model.njoints
        spin, turn, speed = [[self._vector(np.zeros(3))] * count for _ in range(3)]
        speed[0] = self._vector(-self._model.gravity.linear)  # the base accelerates upwards in place of gravity
        places = [self._place(joint) for joint in range(count)]
        forces, moments = [[self._vector(np.zeros(3))] * count for _ in range(2)]
        for joint in range(1, count):
            parent, (back, shift, axis, slides) = self._model.parents[joint], places[joint]
            dq, ddq = self._dq[joint - 1], self._ddq[joint - 1]
            there = _sum(speed[parent], _cross(turn[parent], shift), _cross(spin[parent], _cross(spin[parent], shift)))
            carried = self._named(_times(back, spin[parent]))
            before, here = _times(back, turn[parent]), _times(back, there)
            if slides:
                spin[joint], turn[joint] = carried, self._named(before)
                coriolis = _scaled(_cross(carried, axis), 2 * dq)
                speed[joint] = self._named(_sum(here, coriolis, _scaled(axis, ddq)))
            else:
                spin[joint] = self._named(_sum(carried, _scaled(axis, dq)))
                turn[joint] = self._named(_sum(before, _scaled(_cross(carried, axis), dq), _scaled(axis, ddq)))
                speed[joint] = self._named(here)
            forces[joint], moments[joint] = self._body(joint, spin[joint], turn[joint], speed[joint])
        torques: list[Any] = [None] * (count - 1)
        for joint in reversed(range(1, count)):
            parent, (back, shift, axis, slides) = self._model.parents[joint], places[joint]
            force, moment = self._named(forces[joint]), self._named(moments[joint])
            torques[joint - 1] = _dot(axis, force if slides else moment)
            outward = self._named(_times(_transposed(back), force))
            forces[parent] = _sum(forces[parent], outward)
            moments[parent] = _sum(moments[parent], _times(_transposed(back), moment), _cross(shift, outward))
        return torques

    def _body(self, joint: int, spin: Vector, turn: Vector, speed: Vector) -> tuple[Vector, Vector]:
        """Return the force on a body and the moment about its joint that its motion takes."""
        inertia = self._model.inertias[joint]
        centre, mass = self._vector(inertia.lever), self._number(inertia.mass)
        about = [self._vector(row) for row in inertia.inertia]
        pull = _sum(speed, _cross(turn, centre), _cross(spin, _cross(spin, centre)))
        force = self._named(_scaled(pull, mass))
        moment = _sum(_times(about, turn), _cross(spin, self._named(_times(about, spin))), _cross(centre, force))
        return force, moment

    def _place(self, joint: int) -> tuple[list[Vector], Vector, Vector, bool]:
        """Return what turns vectors of a joint's parent into its frame, where it is there, its axis, and its kind."""
        if joint == 0:
            return [], [], [], False
        model, number = self._model, joint - 1
        jacobian = pin.computeJointJacobian(model, model.createData(), pin.neutral(model), joint)
        along = np.reshape(jacobian, (6, -1))[:, number]
        slides = bool(np.linalg.norm(along[:3]) > np.linalg.norm(along[3:]))
        axis = self._vector(along[:3] if slides else along[3:])
        fixed = model.jointPlacements[joint]
        if slides:
            back = [self._vector(row) for row in fixed.rotation.T]
            return (
                back,
                _sum(self._vector(fixed.translation), _scaled(_times(_transposed(back), axis), self._q[number])),
                axis,
                True,
            )
        cosine, sine = self._symbol(f"c{joint}", "cos", number), self._symbol(f"s{joint}", "sin", number)
        turned = [
            [
                cosine * int(row == column) + (1 - cosine) * axis[row] * axis[column] + sine * skew
                for column, skew in enumerate(_skew_transposed(axis)[row])
            ]
            for row in range(3)
        ]
        back = [self._named([_dot(row, self._vector(column)) for column in fixed.rotation]) for row in turned]
        return back, self._vector(fixed.translation), axis, False

    def _symbol(self, name: str, function: str, number: int) -> Any:
        symbol = self._sympy.Symbol(name)
        self.steps.append((symbol, getattr(self._sympy, function)(self._q[number])))
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
        entry = self._sympy.nsimplify(entry, rational=False) if entry.is_number else entry
        if entry.is_number or entry.is_Symbol or (-entry).is_Symbol:
            return entry
        symbol = self._sympy.Symbol(f"v{len(self.steps) + 1}")
        self.steps.append((symbol, entry))
        return symbol


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
    made = []
    for symbol, formula in steps:
        own = sorted(formula.free_symbols, key=str)
        made.append((symbol, own, sympy.lambdify(own, formula, "math")))

    def values(*given: float) -> list[float]:
        known: dict[Any, Any] = dict(zip(inputs, given, strict=True))
        for symbol, own, function in made:
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
