"""Contacts whose runs, force, start and stop are known, and troubles that are none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.synthetic import arm, swing

from irtwin.effects.effect import Predicted
from irtwin.effects.friction import ChangedFrictionWithTemperature, TemperatureDependentFriction
from irtwin.effects.load import CableDrag, ExternalContact, Payload
from irtwin.gap.regression.candidate_columns import Candidates
from irtwin.gap.regression.hypotheses import CHANGED, MISSING, Hypothesis, Variant, in_scope
from irtwin.gap.screening.contact import contact
from irtwin.gap.screening.remainder import RunResidual
from irtwin.signals.filter import low_pass

ROBOT = arm(6)
NOISE = np.array([1.0, 0.9, 0.6, 0.3, 0.3, 0.2])
FORCE = np.array([9.0, -7.0, 6.0])


def remainder(seed, added=None, observed=True):
    """Noise of a run, as coloured as a filter leaves it, and what is `added`, N m."""
    motion = replace(swing(ROBOT, seed, seconds=8.0, rate=50.0), run=f"run_{seed}")
    white = np.random.default_rng(seed).standard_normal(motion.q.shape)
    residual = NOISE * low_pass(white, motion.rate, 8.0) * np.sqrt(motion.rate / 2 / 8.0)
    if added is not None:
        residual = residual + added(motion)
    return RunResidual(motion, residual, observed)


def push(motion):
    return ExternalContact(3.0, 4.5).contribution(ROBOT, motion, FORCE)


def runs(touched, added=push, count=8):
    return [remainder(seed, added if seed in touched else None) for seed in range(count)]


@pytest.mark.parametrize("touched", [(2,), (1, 4, 6)])
def test_a_contact_is_found_in_its_runs_and_its_time(touched):
    found = contact(ROBOT, runs(touched), NOISE)
    assert found.runs == tuple(f"run_{seed}" for seed in touched)
    assert found.start == pytest.approx(3.0, abs=0.2)
    assert found.stop == pytest.approx(4.5, abs=0.2)


def test_an_arm_of_two_joints_has_none():
    assert contact(arm(2), [], NOISE[:2]) is None


def test_a_contact_of_a_reference_run_is_nobodys():
    left = [remainder(2, push, observed=False), *(remainder(seed) for seed in range(10, 17))]
    assert "run_2" not in contact(ROBOT, left, NOISE).runs


def test_undecided_samples_are_left_out():
    left = runs((1, 4, 6))
    for one in left:
        one.residual[100:120, 2] = np.nan
        one.residual[:5] = np.nan
    assert contact(ROBOT, left, NOISE).runs == ("run_1", "run_4", "run_6")


def test_candidates_are_zero_in_runs_in_which_they_do_not_act():
    shape = ExternalContact(3.0, 4.5, runs=("run_2",))
    candidates = Candidates(ROBOT, [shape], np.ones((6, 3), dtype=bool), lambda whole: Predicted(whole.q))
    for seed, acts in ((1, False), (2, True)):
        motion = replace(swing(ROBOT, seed, seconds=8.0, rate=50.0), run=f"run_{seed}")
        assert np.any(np.concatenate(candidates.part(motion), axis=1)) == acts


def test_beside_reference_runs_what_acts_in_some_runs_is_a_change():
    def hypothesis(scope, *effects):
        return Hypothesis(effects[0].id, None, scope, tuple(Variant(e, (k,), ()) for k, e in enumerate(effects)))

    everywhere, some = Payload(), Payload(runs=("run_1",))
    tried = [hypothesis(MISSING, everywhere, some), hypothesis(MISSING, some), hypothesis(CHANGED, some)]
    assert in_scope(tried, both=False) == tried
    kept = in_scope(tried, both=True)
    assert [(one.scope, [v.effect for v in one.variants]) for one in kept] == [
        (MISSING, [everywhere]),
        (CHANGED, [some]),
    ]


@pytest.mark.parametrize(
    ("standing", "changes", "both"),
    [
        (TemperatureDependentFriction(), [ChangedFrictionWithTemperature()], slice(None)),
        (CableDrag(), CableDrag().changes(), slice(1, None)),  # its standing shape never changes
    ],
    ids=["a shape that a change alone has", "a shape that gives way to that of its changes"],
)
def test_what_is_missing_has_no_shape_of_a_change(standing, changes, both):
    variants = tuple(Variant(one, (k,), ()) for k, one in enumerate((standing, *changes)))
    tried = [Hypothesis(standing.id, "joint_1", scope, variants) for scope in (MISSING, CHANGED)]
    missing, changed = in_scope(tried, both=True)
    assert [missing.variants, changed.variants] == [variants[:1], variants[both]]
