"""Which shapes of effects a search that is repeated tries, and that it finds with them what all of them show."""

from __future__ import annotations

import numpy as np
from tests.gap.test_structure_search import ROWS, RUNS, block, equation

from irtwin.effects.catalogue import catalogue
from irtwin.effects.effect import Effect, Term
from irtwin.gap.isolation.shortlist import NO_SEARCH, Shortlist
from irtwin.gap.isolation.structure_search import Attribution, attribute
from irtwin.gap.regression.hypotheses import MISSING, CandidateColumn, hypotheses
from irtwin.gap.thresholds import DEFAULT

CONSTANT = (catalogue()["torque_drift"], Term("constant", "1"))
SHAPES = catalogue()["torque_ripple"].candidates()[:8]
TRUE, JOINTS = 4, ("joint_1", "joint_2")  # the first joint has the shape


def searched(shapes: list[Effect], before: Shortlist = NO_SEARCH) -> Attribution:
    """What a search finds in a ripple of one joint, tried in some orders at two joints."""
    generator, blocks = np.random.default_rng(5), []
    for run in range(RUNS):
        angles = dict(zip(JOINTS, generator.uniform(-np.pi, np.pi, (2, ROWS)), strict=True))
        columns = [
            wave(shape.shape["N"] * angles[joint]) for shape in shapes for joint in JOINTS for wave in (np.sin, np.cos)
        ]
        measured = 3.0 * np.sin(SHAPES[TRUE].shape["N"] * angles[JOINTS[0]]) + generator.standard_normal(ROWS)
        blocks.append(block(run, np.ones(ROWS), np.column_stack(columns), measured))
    terms = [Term(f"A {wave}", "N m", joint, spread=5.0) for joint in JOINTS for wave in ("sin", "cos")]
    candidates = [CandidateColumn(shape, k, term) for shape in shapes for k, term in enumerate(terms)]
    system = equation(blocks, [CONSTANT], candidates)
    named = hypotheses(system.columns, system.base, MISSING)
    return attribute(system, named, DEFAULT.criterion, before=before)


def test_shapes_that_data_spoke_for_are_tried_again_and_one_of_each_hypothesis() -> None:
    shortlist = searched(list(SHAPES)).shortlist
    assert SHAPES[TRUE] in shortlist.kept < set(SHAPES) == shortlist.tried
    new = catalogue()["torque_drift"]
    assert shortlist.among([*SHAPES, new]) == [*(shape for shape in SHAPES if shape in shortlist.kept), new]
    assert shortlist.among([SHAPES[TRUE].on("joint_2")]) == [SHAPES[TRUE].on("joint_2")]


def test_a_repeated_search_finds_the_same_as_surely() -> None:
    first = searched(list(SHAPES))
    again = searched(first.shortlist.among(SHAPES), first.shortlist)
    (cause,), (same,) = first.causes, again.causes
    assert (same.effect, same.joints, same.variants[0].effect) == (cause.effect, cause.joints, cause.variants[0].effect)
    assert abs(same.log_odds - cause.log_odds) < 0.5  # what was tried is paid for
    assert [hypothesis.place for hypothesis in again.hypotheses] == [
        hypothesis.place for hypothesis in first.hypotheses
    ]
    assert again.shortlist.counts == first.shortlist.counts
