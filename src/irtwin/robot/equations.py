"""Equations of motion of a small robot in symbols: tau = M(q) ddq + c(q, dq) + g(q)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
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
_WAVES = np.array([0, 1, 2, -2, -1])  # of an angle, in the order of a Fourier transform
_ANGLES, _LENGTHS = 2 * np.pi * np.arange(5) / 5, np.array([-1.0, 0.0, 1.0])  # rad, m: as many as tell them apart


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
        accelerations = library().Matrix(symbols_of(len(self.joints))[2])
        return (self.mass * accelerations)[joint] + self.speed[joint] + self.gravity[joint]

    def text(self, joint: int) -> str:
        """Return a joint's torque as text in six digits, a term of acceleration or speed a line."""
        sympy = library()
        torque = self.torque(joint).evalf(_DIGITS)
        moving = {symbol for symbols in symbols_of(len(self.joints))[1:] for symbol in symbols}
        terms = sorted(sympy.Add.make_args(torque), key=sympy.default_sort_key)
        still = sympy.Add(*(term for term in terms if not term.free_symbols & moving))
        lines = [str(term) for term in terms if term.free_symbols & moving] + ([str(still)] if still != 0 else [])
        signed = [f"  - {line[1:]}" if line.startswith("-") else f"  + {line}" for line in lines or ["0"]]
        return "\n".join([f"tau{joint + 1} =", *signed])

    def latex(self, joint: int) -> str:
        """Return a joint's torque in LaTeX, in six digits."""
        sympy = library()
        torque = self.torque(joint).evalf(_DIGITS)
        return rf"\tau_{{{joint + 1}}} = {sympy.latex(torque, symbol_names=latex_names(len(self.joints)))}"


def equations(robot: Robot) -> EquationsOfMotion:
    """Derive the equations of motion by Lagrange's method from the robot's nominal masses and dimensions.

    Rigid bodies alone: no friction, no rotors. Raises InputError where sympy is missing or more than MOST_JOINTS move.
    """
    if len(robot.joints) > MOST_JOINTS:
        raise InputError(
            f"{robot.name}: {len(robot.joints)} joints move; equations are written out for {MOST_JOINTS} or fewer. "
            "For longer chains, `recursive_equations` names what joint after joint gives"
        )
    sympy = library()
    mass, height = _energies(robot)
    q, dq, ddq = symbols_of(len(robot.joints))
    gravity = sympy.Matrix([sympy.diff(height, position) for position in q])
    least = _DUST * max(map(abs, mass.atoms(sympy.Float)), default=0.0)
    speed = sympy.Matrix([_speed_terms(mass, q, dq, joint, least) for joint in range(len(q))])
    derived = EquationsOfMotion(robot.joint_names, mass, speed, gravity, 0.0)
    torques = [derived.torque(joint) for joint in range(len(q))]
    return replace(derived, deviation=deviation_of(robot, sympy.lambdify([*q, *dq, *ddq], torques, "numpy")))


def library() -> Any:
    """Import sympy, which is an extra."""
    try:
        import sympy
    except ImportError as error:
        raise InputError('equations need sympy; install it with: pip install "irtwin[symbolic]"') from error
    return sympy


def symbols_of(joints: int) -> tuple[list[Any], list[Any], list[Any]]:
    """Return the symbols of positions, speeds and accelerations."""
    sympy = library()
    q, dq, ddq = ([sympy.Symbol(f"{sign}{n}") for n in range(1, joints + 1)] for sign in ("q", "dq", "ddq"))
    return q, dq, ddq


def latex_names(joints: int) -> dict[Any, str]:
    """Return what the symbols of `symbols_of` are called in LaTeX."""
    names: dict[Any, str] = {}
    for accent, symbols in zip(("q", r"\dot{q}", r"\ddot{q}"), symbols_of(joints), strict=True):
        names |= {symbol: f"{accent}_{{{number}}}" for number, symbol in enumerate(symbols, start=1)}
    return names


def _speed_terms(mass: Any, q: list[Any], dq: list[Any], joint: int, least: float) -> Any:
    """Return Coriolis and centrifugal torque: the Christoffel symbols of the mass matrix times speeds.

    Coefficients below the `least` are left out: what rounding leaves of terms that cancel.
    """
    total = library().Integer(0)
    for j, k in product(range(len(q)), repeat=2):
        if k < j:
            continue
        symbol = mass[joint, j].diff(q[k]) + mass[joint, k].diff(q[j]) - mass[j, k].diff(q[joint])
        terms = (symbol / 2 if j == k else symbol).expand().as_coefficients_dict().items()
        total += sum(value * wave for wave, value in terms if abs(value) > least) * dq[j] * dq[k]
    return total


def _energies(robot: Robot) -> tuple[Any, Any]:
    """Return the mass matrix (n, n), kg m^2 (kg m, kg), and the potential energy, J.

    Of the position of a joint that turns they have waves of up to twice the angle, of one that slides powers of up to
    two: what Pinocchio says at a few positions of each joint determines them.
    """
    count, model, data = len(robot.joints), robot.model, robot.model.createData()
    slides = [joint.kind == "prismatic" for joint in robot.joints]
    poses = np.stack(np.meshgrid(*(_LENGTHS if sliding else _ANGLES for sliding in slides), indexing="ij"), axis=-1)
    upper = np.triu([[pin.crba(model, data, q)] for q in poses.reshape(-1, count)])
    height = [pin.computePotentialEnergy(model, data, q) for q in poses.reshape(-1, count)]
    mass = _coefficients((upper + np.triu(upper, 1).swapaxes(-1, -2)).reshape(*poses.shape[:-1], count, count), slides)
    entries = [_in_symbols(mass[..., row, column], slides, mass) for row, column in np.ndindex(count, count)]
    potential = _coefficients(np.reshape(height, poses.shape[:-1]), slides)
    return library().Matrix(count, count, entries), _in_symbols(potential, slides, potential)


def _coefficients(values: np.ndarray, slides: Sequence[bool]) -> np.ndarray:
    """Return of values at all poses, an axis a joint, the coefficients of waves, and of powers where a joint slides."""
    for axis, sliding in enumerate(slides):
        if sliding:
            powers = np.linalg.inv(np.vander(_LENGTHS, increasing=True))
            values = np.moveaxis(np.tensordot(powers, values, (1, axis)), 0, axis)
        else:
            values = np.fft.fft(values, axis=axis, norm="forward")
    return values


def _in_symbols(coefficients: np.ndarray, slides: Sequence[bool], beside: np.ndarray) -> Any:
    """Return a sum of cosines and sines of sums of positions, times powers of those that slide.

    Coefficients below the dust of the largest `beside` them are left out.
    """
    sympy = library()
    q, *_ = symbols_of(len(slides))
    terms = []
    for place, amplitude in np.ndenumerate(coefficients):
        wave = [0 if sliding else int(_WAVES[k]) for k, sliding in zip(place, slides, strict=True)]
        first = next((k for k in wave if k), 0)
        if first < 0:  # the conjugate of one that is counted
            continue
        angle = sum(k * position for k, position in zip(wave, q, strict=True))
        along = sympy.prod(position**k for k, position, sliding in zip(place, q, slides, strict=True) if sliding)
        for value, function in ((amplitude.real, sympy.cos), (-amplitude.imag, sympy.sin)):
            value = value * (2.0 if first else 1.0)
            if abs(value) > _DUST * np.abs(beside).max():
                terms.append(sympy.Float(value) * along * function(angle))
    return sympy.Add(*terms)


def deviation_of(robot: Robot, torque: Callable[..., Sequence[float]]) -> float:
    """Return by how much a `torque` (n,) of q, dq, ddq (3 n numbers) differs from Pinocchio's at most."""
    data, worst = robot.model.createData(), 0.0
    for state in np.random.default_rng(0).uniform(-2.0, 2.0, (_STATES, 3, len(robot.joints))):
        expected = pin.rnea(robot.model, data, *state)
        worst = max(worst, float(np.abs(np.array(torque(*state.ravel()), dtype=float) - expected).max()))
    return worst
