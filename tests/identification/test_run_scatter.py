"""Friction that differs from run to run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.synthetic import arm, measure, swing, truth

from irtwin.effects.catalogue import BASELINE
from irtwin.effects.stack import Stack
from irtwin.identification.fits import fit_torque
from irtwin.identification.run_scatter import with_run_scatter

ROBOT = arm(3)


def deviations(runs: int, scatter: float, effects=BASELINE) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Deviations by name, as fitted and with the scatter, of runs whose dry friction is off by a share of its own."""
    rng, motions = np.random.default_rng(0), []
    for seed in range(runs):
        motion = measure(ROBOT, swing(ROBOT, seed, seconds=8.0), noise=0.2, seed=seed)
        own = scatter * rng.standard_normal(3) * truth(ROBOT)["Fc"] * np.sign(motion.dq)
        motions.append(replace(motion, torque=motion.torque + own))
    stack = Stack(ROBOT, effects)
    blocks, found = fit_torque(stack, motions)
    wider = with_run_scatter(stack, blocks, found)
    names = np.array([term.name for _, term in stack.torque_terms])
    both = [np.sqrt(np.diag(one.covariance)) for one in (found, wider)]
    return {name: (both[0][names == name], both[1][names == name]) for name in set(names)}


def test_friction_is_as_unsure_as_that_of_a_run():
    fitted, wider = deviations(12, 0.1)["Fc"]
    assert wider == pytest.approx(0.1 * truth(ROBOT)["Fc"], rel=0.5)
    assert (wider > 2 * fitted).all()


def test_what_does_not_differ_stays_as_it_is():
    found = deviations(12, 0.1)
    assert all((found[name][0] == found[name][1]).all() for name in ("m", "Ia", "Ixx"))
    fitted, wider = deviations(12, 0.0)["Fc"]
    assert (wider < 3 * fitted).all()


def test_what_bodies_make_up_for_does_not_differ_from_run_to_run():
    """A load friction that drives as much as it brakes is a scale of all bodies, which no run tells."""
    fitted, wider = deviations(12, 0.1, (*BASELINE, "load_dependent_friction"))["mu"]
    assert (wider < 1.1 * fitted).all()


def test_few_runs_tell_nothing_of_it():
    fitted, wider = deviations(3, 0.1)["Fc"]
    assert (fitted == wider).all()
