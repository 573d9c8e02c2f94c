"""`python consistent_bodies.py [DATASET...]`: what consistent bodies cost, on the plant's robots and on measured ones.

Links without a positive definite pseudo-inertia before and after, by how much the torque of held-out runs changes (RMS,
of its own; all joints, and the worst one), their error after over that before, and processor time; beside cvxpy with
Clarabel where these are installed.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from energy_twin.cases import cases
from irtwin.check.check import checked
from irtwin.effects.catalogue import BASELINE
from irtwin.effects.stack import Stack
from irtwin.identification.consistent_bodies import PULL, described_bodies, with_consistent_bodies
from irtwin.identification.cutoff import cutoff_for
from irtwin.identification.estimators import Estimate
from irtwin.identification.fits import fit_torque
from irtwin.identification.validation import split
from irtwin.robot.pseudo_inertia import BASIS, consistent
from irtwin.signals.conditioning import condition
from irtwin.signals.log import DataSet, own_runs, read_data_set

PLANTS = [f"plant {robot} {seed}" for robot in ("KR6", "UR10-like", "Panda-like") for seed in range(2)]


def data_sets() -> Iterator[tuple[str, DataSet]]:
    for folder in sys.argv[1:]:
        yield Path(folder).name, checked(read_data_set(Path(folder))).data_set
    for name in PLANTS:
        for case in cases(1 + int(name[-1]), name):
            yield case.name, case.data_set


def by_clarabel(stack: Stack, free: Estimate) -> np.ndarray:
    """Return the same optimum by an interior-point method for cones."""
    import cvxpy

    inverse = np.linalg.inv(described_bodies(stack))
    size = np.array([term.spread for _, term in stack.torque_terms])
    x = cvxpy.Variable(len(size))
    left, right = free.equations[:, :-1] * size, free.equations[:, -1]
    pull = 0
    for body, known in enumerate(inverse):
        values = cvxpy.multiply(size[10 * body : 10 * body + 10], x[10 * body : 10 * body + 10])
        # in the frame in which the described body is one: well scaled
        root = np.linalg.cholesky(known)
        pseudo = sum(values[k] * (root.T @ BASIS[k] @ root) for k in range(10))
        pull += cvxpy.trace(pseudo) - cvxpy.log_det(pseudo)
    lowest = np.array([term.lowest for _, term in stack.torque_terms])
    bound = np.flatnonzero(np.isfinite(lowest))
    problem = cvxpy.Problem(
        cvxpy.Minimize(cvxpy.sum_squares(left @ x - right) / 2 + PULL * pull), [x[bound] >= lowest[bound] / size[bound]]
    )
    problem.solve(solver=cvxpy.CLARABEL)
    return np.asarray(x.value * size)


def timed(solve: Callable[[], np.ndarray]) -> tuple[np.ndarray, float]:
    began = time.process_time()
    found = solve()
    return found, time.process_time() - began


def main() -> None:
    print("| robot | links | before | after | change, % | worst joint, % | error, times | s | Clarabel: s | apart, % |")
    print("| --- " * 10 + "|")
    for name, given in data_sets():
        runs = own_runs(given.runs)
        cutoff = cutoff_for(given.robot, runs, given.cutoff).hz
        parts = split([condition(run, given.robot, cutoff) for run in runs])
        stack = Stack(given.robot, BASELINE)
        terms = stack.torque_terms
        _, free = fit_torque(stack, parts.fit)
        own = [place for place, (effect, _) in enumerate(terms) if effect.bodies]
        held = [stack.torque_columns(motion).reshape(-1, len(terms)) for motion in parts.held_out]
        columns = np.concatenate(held).reshape(-1, len(given.robot.joints), len(terms))

        def change(one: np.ndarray, other: np.ndarray, columns: np.ndarray = columns) -> np.ndarray:
            return 100 * np.linalg.norm(columns @ (one - other), axis=0) / np.linalg.norm(columns @ one, axis=0)

        def whole(one: np.ndarray, other: np.ndarray, columns: np.ndarray = columns) -> float:
            return float(100 * np.linalg.norm(columns @ (one - other)) / np.linalg.norm(columns @ one))

        found, seconds = timed(lambda: with_consistent_bodies(stack, terms, free).values)  # noqa: B023
        before, after = ((~consistent(x[own].reshape(-1, 10))).sum() for x in (free.values, found))
        cells = [name, len(own) // 10, before, after, f"{whole(free.values, found):.4f}"]
        measured = np.concatenate([motion.torque for motion in parts.held_out])
        errors = [np.linalg.norm(columns @ x - measured) for x in (free.values, found)]
        cells += [f"{change(free.values, found).max():.4f}", f"{errors[1] / errors[0]:.4f}", f"{seconds:.3f}"]
        try:
            other, seconds = timed(lambda: by_clarabel(stack, free))  # noqa: B023
            cells += [f"{seconds:.2f}", f"{whole(found, other):.4f}"]
        except ModuleNotFoundError:
            cells += ["-", "-"]
        print(f"| {' | '.join(map(str, cells))} |", flush=True)


if __name__ == "__main__":
    main()
