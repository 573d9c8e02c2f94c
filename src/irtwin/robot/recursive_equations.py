"""Torque of a longer robot in symbols: Newton and Euler's recursion, each of its results named.

Written out, the torque of six joints has tens of thousands of terms. By names for what joint after joint gives it is a
list of short formulas, as [Khalil and Kleinfinger 1987] customise the recursion of [Luh, Walker and Paul 1980].
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pinocchio as pin

from irtwin.robot.description import Robot
from irtwin.robot.equations import deviation_of, latex_names, library, symbols_of
from irtwin.robot.kinematics import joint_motions

if TYPE_CHECKING:
    import sympy

_DUST = 1e-12  # of metres, radians and kg: what rounding leaves
_DIGITS = 6  # of a coefficient that is shown


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
    sympy, recursion, count = library(), _Recursion(robot), len(robot.joints)
    torques = tuple((sympy.Symbol(f"tau{n}"), torque) for n, torque in enumerate(recursion.torques(), start=1))
    steps = _needed(recursion.steps, torques)
    inputs = [symbol for symbols in symbols_of(count) for symbol in symbols]
    formulas = [torque for _, torque in torques]
    evaluate = sympy.lambdify(inputs, formulas, "math", cse=lambda formulas: (steps, formulas))
    return RecursiveEquations(steps, torques, count, deviation_of(robot, evaluate))


@dataclass(frozen=True)
class _Frame:
    """A joint's frame in its parent's: what turns vectors `back` into it, where it is, its axis, whether it slides."""

    back: sympy.Matrix
    shift: sympy.Matrix
    axis: sympy.Matrix
    slides: bool


@dataclass(frozen=True)
class _State:
    """Angular velocity and acceleration of a body, and the acceleration of its joint, in the joint's frame."""

    velocity: sympy.Matrix
    turning: sympy.Matrix
    acceleration: sympy.Matrix


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
        still, model = self._matrix(np.zeros(3)), self._model
        frames = {joint: self._frame(joint) for joint in range(1, model.njoints)}
        states = {0: _State(still, still, self._matrix(-model.gravity.linear))}  # the base accelerates for gravity
        forces, moments = {0: still}, {0: still}
        for joint, frame in frames.items():
            states[joint] = self._state(joint, frame, states[model.parents[joint]])
            forces[joint], moments[joint] = self._taken(joint, states[joint])
        torques = []
        for joint, frame in reversed(frames.items()):
            parent = model.parents[joint]
            force, moment = self._named(forces[joint]), self._named(moments[joint])
            torques.append(frame.axis.dot(force if frame.slides else moment))
            borne = self._named(frame.back.T * force)
            forces[parent] += borne
            moments[parent] += frame.back.T * moment + frame.shift.cross(borne)
        return torques[::-1]

    def _state(self, joint: int, frame: _Frame, parent: _State) -> _State:
        """Return how the body behind a joint moves, by how its parent does."""
        dq, ddq = self._dq[joint - 1], self._ddq[joint - 1]
        around = parent.velocity.cross(parent.velocity.cross(frame.shift))
        here = frame.back * (parent.acceleration + parent.turning.cross(frame.shift) + around)
        velocity = self._named(frame.back * parent.velocity)
        turning = frame.back * parent.turning
        across = velocity.cross(frame.axis)
        if frame.slides:
            here += 2 * dq * across + ddq * frame.axis
        else:
            velocity = self._named(velocity + dq * frame.axis)
            turning += dq * across + ddq * frame.axis
        return _State(velocity, self._named(turning), self._named(here))

    def _taken(self, joint: int, state: _State) -> tuple[sympy.Matrix, sympy.Matrix]:
        """Return the force on a body and the moment about its joint that its motion takes."""
        inertia = self._model.inertias[joint]
        centre, about, mass = self._matrix(inertia.lever), self._matrix(inertia.inertia), self._number(inertia.mass)
        around = state.velocity.cross(state.velocity.cross(centre))
        force = self._named(mass * (state.acceleration + state.turning.cross(centre) + around))
        spin = self._named(about * state.velocity)
        return force, about * state.turning + state.velocity.cross(spin) + centre.cross(force)

    def _frame(self, joint: int) -> _Frame:
        q, fixed = self._q[joint - 1], self._model.jointPlacements[joint]
        linear, angular = np.split(self._motions[joint - 1], 2)
        shift, back = self._matrix(fixed.translation), self._matrix(fixed.rotation.T)
        if np.linalg.norm(linear) > np.linalg.norm(angular):
            axis = self._matrix(linear)
            return _Frame(back, shift + q * back.T * axis, axis, True)
        axis = self._matrix(angular)
        cosine, sine = (self._symbol(f"{name[0]}{joint}", getattr(self._sympy, name)(q)) for name in ("cos", "sin"))
        turn = cosine * self._sympy.eye(3) + (1 - cosine) * axis * axis.T - sine * self._matrix(pin.skew(angular))
        return _Frame(self._named(turn * back), shift, axis, False)

    def _symbol(self, name: str, formula: Any) -> Any:
        symbol = self._sympy.Symbol(name)
        self.steps.append((symbol, formula))
        return symbol

    def _number(self, value: float) -> Any:
        whole = round(value)
        if abs(value - whole) < _DUST:
            return self._sympy.Integer(whole)
        return self._sympy.Float(float(value))

    def _matrix(self, values: np.ndarray) -> sympy.Matrix:
        return self._sympy.Matrix(values).applyfunc(self._number)

    def _named(self, matrix: sympy.Matrix) -> sympy.Matrix:
        """Return a matrix whose entries are numbers or symbols: what is more gets a name of its own."""
        return self._sympy.Matrix(*matrix.shape, list(map(self._name, matrix)))

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
