"""Equations of motion of a small robot in symbols: tau = M(q) ddq + c(q, dq) + g(q)."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
import pinocchio as pin

from irtwin.errors import InputError
from irtwin.robot.description import Robot

if TYPE_CHECKING:
    import sympy

MOST_JOINTS = 3  # that move: the terms of more fill pages, and nobody reads them
_DUST = 1e-13  # of the largest coefficient: what rounding leaves
_DIGITS = 6  # of a coefficient that is shown
_STATES = 20  # at which the equations are held against Pinocchio


@dataclass(frozen=True)
class EquationsOfMotion:
    """The rigid-body torque of each joint in symbols q1, dq1, ddq1, ... (rad or m, s), N m or N.

    `mass` (n, n), `speed` (n,) and `gravity` (n,) are the parts; `deviation` is by how much the whole differs at most
    from Pinocchio's recursive Newton-Euler algorithm at states drawn at random, N m or N.
    """

    joints: tuple[str, ...]
    mass: sympy.Matrix
    speed: sympy.Matrix
    gravity: sympy.Matrix
    deviation: float

    def torque(self, joint: int) -> sympy.Expr:
        """Return a joint's torque, N m (N for one that slides)."""
        accelerations = _library().Matrix(_symbols(len(self.joints))[2])
        return (self.mass * accelerations)[joint] + self.speed[joint] + self.gravity[joint]

    def text(self, joint: int) -> str:
        """Return a joint's torque as text in six digits, a term of acceleration or speed a line."""
        sympy = _library()
        torque = self.torque(joint).evalf(_DIGITS)
        moving = {symbol for symbols in _symbols(len(self.joints))[1:] for symbol in symbols}
        terms = sorted(sympy.Add.make_args(torque), key=sympy.default_sort_key)
        still = sympy.Add(*(term for term in terms if not term.free_symbols & moving))
        lines = [str(term) for term in terms if term.free_symbols & moving] + ([str(still)] if still != 0 else [])
        signed = [f"  - {line[1:]}" if line.startswith("-") else f"  + {line}" for line in lines or ["0"]]
        return "\n".join([f"tau{joint + 1} =", *signed])

    def latex(self, joint: int) -> str:
        """Return a joint's torque in LaTeX, in six digits."""
        sympy = _library()
        names: dict[Any, str] = {}
        for accent, symbols in zip(("q", r"\dot{q}", r"\ddot{q}"), _symbols(len(self.joints)), strict=True):
            names |= {symbol: f"{accent}_{{{number}}}" for number, symbol in enumerate(symbols, start=1)}
        torque = self.torque(joint).evalf(_DIGITS)
        return rf"\tau_{{{joint + 1}}} = {sympy.latex(torque, symbol_names=names)}"


def equations(robot: Robot) -> EquationsOfMotion:
    """Derive the equations of motion by Lagrange's method from the robot's nominal masses and dimensions.

    Rigid bodies alone: no friction, no rotors. Raises InputError where sympy is missing or more than MOST_JOINTS move.
    """
    if len(robot.joints) > MOST_JOINTS:
        raise InputError(
            f"{robot.name}: {len(robot.joints)} joints move; equations are written for {MOST_JOINTS} or fewer. "
            "For longer chains, `irtwin predict` computes the torque"
        )
    sympy = _library()
    mass, height = _Chain(robot).energies()
    q, dq, _ = _symbols(len(robot.joints))
    gravity = sympy.Matrix([sympy.diff(height, position) for position in q])
    speed = sympy.Matrix([_speed_terms(mass, q, dq, joint) for joint in range(len(q))])
    derived = EquationsOfMotion(robot.joint_names, mass, speed, gravity, 0.0)
    return EquationsOfMotion(robot.joint_names, mass, speed, gravity, _deviation(robot, derived))


def _library() -> Any:
    """Import sympy, which is an extra."""
    try:
        import sympy
    except ImportError as error:
        raise InputError('equations need sympy; install it with: pip install "irtwin[symbolic]"') from error
    return sympy


def _symbols(joints: int) -> tuple[list[Any], list[Any], list[Any]]:
    sympy = _library()
    q, dq, ddq = ([sympy.Symbol(f"{sign}{n}") for n in range(1, joints + 1)] for sign in ("q", "dq", "ddq"))
    return q, dq, ddq


def _speed_terms(mass: Any, q: list[Any], dq: list[Any], joint: int) -> Any:
    """Return Coriolis and centrifugal torque: the Christoffel symbols of the mass matrix times speeds."""
    total = _library().Integer(0)
    for j, k in product(range(len(q)), repeat=2):
        if k < j:
            continue
        symbol = mass[joint, j].diff(q[k]) + mass[joint, k].diff(q[j]) - mass[j, k].diff(q[joint])
        total += (symbol / 2 if j == k else symbol).expand() * dq[j] * dq[k]
    return total


class _Chain:
    """Kinetic and potential energy in a ring of polynomials in the cosine, sine and value of each joint's position."""

    def __init__(self, robot: Robot) -> None:
        from sympy.polys.domains import RR
        from sympy.polys.rings import ring

        self._robot, self._model = robot, robot.model
        count = len(robot.joints)
        names = [f"{sign}{n}" for sign in ("c", "s", "x") for n in range(1, count + 1)]
        self._ring, *signs = ring(names, RR)
        self._cos, self._sin, self._slide = signs[:count], signs[count : 2 * count], signs[2 * count :]
        self._count = count

    def energies(self) -> tuple[Any, Any]:
        """Return the mass matrix (n, n), and the potential energy, J."""
        count, model = self._count, self._model
        turns, places, axes = self._kinematics()
        mass = np.full((count, count), self._ring.zero, dtype=object)
        potential = self._ring.zero
        for body in range(1, count + 1):
            inertia = model.inertias[body]
            centre = places[body] + self._times(turns[body], self._numbers(inertia.lever))
            potential = potential - self._times(self._numbers(model.gravity.linear * inertia.mass), centre)
            line = np.full((3, count), self._ring.zero, dtype=object)  # m/s of the centre of mass a rad/s (m/s)
            turn = line.copy()  # rad/s in the body's own axes
            joint = body
            while joint > 0:
                axis = axes[joint]
                if self._robot.joints[joint - 1].kind == "prismatic":
                    line[:, joint - 1] = axis
                else:
                    line[:, joint - 1] = self._reduced(np.cross(axis, centre - places[joint]))
                    turn[:, joint - 1] = self._times(turns[body].T, axis)
                joint = model.parents[joint]
            moments = self._numbers(np.array(inertia.inertia))
            mass = mass + self._times(line.T, line) * inertia.mass
            mass = mass + self._times(turn.T, self._times(moments, turn))
        sympy = _library()
        largest = max((abs(value) for entry in mass.flat for value in entry.values()), default=1.0)
        return sympy.Matrix(count, count, [self._waves(entry, largest) for entry in mass.flat]), self._waves(
            potential, max((abs(value) for value in potential.values()), default=1.0)
        )

    def _kinematics(self) -> tuple[list[np.ndarray], list[np.ndarray], list[np.ndarray]]:
        """Return turns (3, 3), origins (3,) and axes (3,) of the joints in the base frame; the first is the base."""
        turns, places = [self._numbers(np.eye(3))], [self._numbers(np.zeros(3))]
        axes = [self._numbers(np.zeros(3))]
        data = self._model.createData()
        pin.computeJointJacobians(self._model, data, np.zeros(self._count))
        columns = np.reshape(data.J, (6, -1))
        for number, joint in enumerate(self._robot.joints, start=1):
            slides = joint.kind == "prismatic"
            parent, before = self._model.parents[number], self._model.jointPlacements[number]
            axis = data.oMi[number].rotation.T @ columns[: 3 if slides else 6, number - 1][-3:]
            place = places[parent] + self._times(turns[parent], self._numbers(before.translation))
            turn = self._times(turns[parent], self._numbers(before.rotation))
            along = self._times(turn, self._numbers(axis))
            if slides:
                place = place + along * self._slide[number - 1]
            else:
                across = pin.skew(axis)
                own = self._numbers(np.eye(3)) + self._numbers(across) * self._sin[number - 1]
                own = own + self._numbers(across @ across) * (1 - self._cos[number - 1])
                turn = self._times(turn, own)
            turns.append(turn)
            places.append(place)
            axes.append(along)
        return turns, places, axes

    def _numbers(self, values: np.ndarray) -> np.ndarray:
        """Return numbers as elements of the ring, the dust of rounding at zero."""
        tidy = np.where(np.abs(values) < 1e-15, 0.0, values)
        return np.asarray(np.vectorize(lambda value: self._ring(float(value)), otypes=[object])(tidy))

    def _times(self, left: np.ndarray, right: np.ndarray) -> Any:
        return self._reduced(left @ right)

    def _reduced(self, values: Any) -> Any:
        """Put 1 - c^2 for s^2 wherever it stands, so that equal polynomials look equal."""
        if isinstance(values, np.ndarray):
            return np.vectorize(self._reduced, otypes=[object])(values)
        for cosine, sine in zip(self._cos, self._sin, strict=True):
            place = next(k for k, generator in enumerate(self._ring.gens) if generator == sine)
            while any(powers[place] > 1 for powers in values):
                kept = self._ring.zero
                for powers, factor in values.items():
                    term = self._ring({powers: factor})
                    if powers[place] > 1:
                        lower = tuple(power - 2 * (k == place) for k, power in enumerate(powers))
                        term = self._ring({lower: factor}) * (1 - cosine**2)
                    kept = kept + term
                values = kept
        return values

    def _waves(self, polynomial: Any, largest: float) -> Any:
        """Return a polynomial as a sum of cosines and sines of sums of positions, times powers of those that slide.

        Coefficients below the dust of `largest` are left out.
        """
        sympy = _library()
        count = self._count
        q, *_ = _symbols(count)
        waves: dict[tuple[tuple[int, ...], tuple[int, ...]], complex] = {}
        for powers, factor in polynomial.items():
            spectrum = {(0,) * count: complex(factor)}
            for joint in range(count):
                for half in [(0.5, 0.5)] * powers[joint] + [(-0.5j, 0.5j)] * powers[count + joint]:
                    spectrum = _shifted(spectrum, joint, half)
            for wave, amplitude in spectrum.items():
                key = (wave, tuple(powers[2 * count :]))
                waves[key] = waves.get(key, 0.0) + amplitude
        terms = []
        for (wave, slides), amplitude in sorted(waves.items(), reverse=True):
            first = next((k for k in wave if k), 0)
            if first < 0:  # the conjugate of one that is counted
                continue
            angle = sum(k * position for k, position in zip(wave, q, strict=True))
            along = sympy.prod(position**power for position, power in zip(q, slides, strict=True))
            for value, function in ((amplitude.real, sympy.cos), (-amplitude.imag, sympy.sin)):
                value = value * (2.0 if first else 1.0)
                if abs(value) > _DUST * largest:
                    terms.append(sympy.Float(value) * along * function(angle))
        return sympy.Add(*terms)


def _shifted(
    spectrum: dict[tuple[int, ...], complex], joint: int, half: tuple[complex, complex]
) -> dict[tuple[int, ...], complex]:
    """Multiply a spectrum by a cosine or a sine of a joint's position: half of it a step up, half a step down."""
    result: dict[tuple[int, ...], complex] = {}
    for wave, amplitude in spectrum.items():
        for step, factor in zip((1, -1), half, strict=True):
            key = tuple(k + step * (place == joint) for place, k in enumerate(wave))
            result[key] = result.get(key, 0.0) + amplitude * factor
    return result


def _deviation(robot: Robot, derived: EquationsOfMotion) -> float:
    sympy = _library()
    count = len(robot.joints)
    q, dq, ddq = _symbols(count)
    said = sympy.lambdify([*q, *dq, *ddq], [derived.torque(joint) for joint in range(count)], "numpy")
    data, worst = robot.model.createData(), 0.0
    for state in np.random.default_rng(0).uniform(-2.0, 2.0, (_STATES, 3, count)):
        expected = pin.rnea(robot.model, data, *state)
        worst = max(worst, float(np.abs(np.array(said(*state.ravel()), dtype=float) - expected).max()))
    return worst
