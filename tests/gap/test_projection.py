"""What a fit leaves of columns is the same as by the rows themselves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from irtwin.effects.catalogue import catalogue
from irtwin.effects.effect import Term
from irtwin.gap.regression import projection
from irtwin.gap.regression.evidence import evidence
from irtwin.gap.regression.hypotheses import CandidateColumn, Variant
from irtwin.gap.regression.normal_equations import System
from irtwin.gap.regression.projection import Projection
from irtwin.identification.accumulate import Block

EFFECT, ROWS, GROUPS, BASE = catalogue()["cable_drag"], 40, 4, 3
NOISE = np.array([0.5, 2.0])
VARIANTS = [Variant(EFFECT, columns, ()) for columns in ((3,), (4, 5), (6,), (11, 12), (8,), (4,))]


def system(*, shaken: bool) -> System:
    """Two equations of three terms and five columns, each of which one equation lacks; half of the groups observed."""
    rng = np.random.default_rng(3)
    pattern = np.array([[1, 1, 1, 1, 1, 0, 1, 1], [0, 1, 1, 0, 1, 1, 1, 1]], dtype=bool)
    blocks = []
    for k in range(GROUPS):
        factors = tuple(rng.standard_normal((ROWS, row.sum() + 1)) for row in pattern)
        blocks.append(Block(f"run_{k}", 0.0, 1.0, np.full(2, ROWS), factors))
    terms = tuple((EFFECT, Term(f"t{k}", "1", spread=2.0)) for k in range(BASE))
    columns = tuple(CandidateColumn(EFFECT, k, Term(f"k{k}", "1", spread=0.5)) for k in range(5))
    parts = [rng.standard_normal((9, row.sum() + 1)) for row in pattern]
    noise = tuple(0.1 * part.T @ part / len(part) for part in parts) if shaken else None
    observed = np.arange(GROUPS) >= GROUPS // 2
    return System(terms, columns, pattern, tuple(blocks), np.arange(GROUPS), observed, shaken=noise, apart=shaken)


@pytest.mark.parametrize("chosen", [(), (7,), (7, 10, 6)])
@pytest.mark.parametrize(("shaken", "most"), [(False, 10**6), (True, 10**6), (True, 0)])
def test_it_is_what_a_fit_to_all_rows_leaves(
    chosen: tuple[int, ...], shaken: bool, most: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(projection, "MOST_HELD", most)
    own = system(shaken=shaken)
    moments = [one.of(np.arange(one.size)) for one in own.moments(NOISE)]
    inside = [*range(BASE), *chosen]
    total, prior = sum(moments), np.eye(len(inside))
    fit = np.linalg.solve(total[np.ix_(inside, inside)] + prior, total[inside])
    if shaken:
        left = np.append(np.zeros(own.size), 1.0)
        left[inside] = -fit[:, -1]
        less = own.shaken_products(left, NOISE)
        assert less is not None and np.abs(less).max() > 0.1
        for one, off in zip(moments, less, strict=True):
            one[:-1, -1] -= off[:-1]
            one[-1, :-1] -= off[:-1]
        total = sum(moments)
        fit = np.linalg.solve(total[np.ix_(inside, inside)] + prior, total[inside])
    some = [one for one in VARIANTS if not set(one.columns) & set(chosen)]
    beside = Projection(own, NOISE, [*VARIANTS, Variant(EFFECT, (7, 10), ())]).beside(chosen)
    seen = 0
    for which, columns, whole, parts in beside.batches(some):
        values = np.random.default_rng(1).standard_normal(columns.shape)
        squares, measured = beside.in_parts(columns, parts, values)
        for place, found, value, in_parts, product in zip(which, whole, values, squares.T, measured.T, strict=True):
            asked = [*some[place].columns, own.size]
            expected = total[np.ix_(asked, asked)] - total[np.ix_(asked, inside)] @ fit[:, asked]
            np.testing.assert_allclose(found, expected[:-1], atol=1e-9)
            off = np.zeros((own.size + 1, len(asked)))
            off[asked] = np.eye(len(asked))
            off[inside] -= fit[:, asked]
            each = [(off.T @ one @ off) for one in moments]
            np.testing.assert_allclose(in_parts, [value @ one[:-1, :-1] @ value for one in each], atol=1e-9)
            np.testing.assert_allclose(product, [value @ one[:-1, -1] for one in each], atol=1e-9)
            seen += 1
    assert seen == len(some)


@pytest.mark.parametrize("chosen", [(), (7, 10)])
@pytest.mark.parametrize("shaken", [False, True])
def test_what_is_nearer_is_the_prior_of_both_fits(
    chosen: tuple[int, ...], shaken: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    own = system(shaken=shaken)
    total = sum(one.of(np.arange(one.size)) for one in own.moments(NOISE))
    inside = [*range(BASE), *chosen]

    def imitated(right: np.ndarray) -> np.ndarray:
        return np.linalg.solve(total[np.ix_(inside, inside)] + np.eye(len(inside)), right[inside])

    measured = total[:, -1].copy()
    if shaken:
        left = np.append(np.zeros(own.size), 1.0)
        left[inside] = -imitated(measured)
        less = own.shaken_products(left, NOISE)
        measured -= less.sum(axis=0)
    monkeypatch.setattr(type(EFFECT), "prior_tells", True)
    beside = Projection(own, NOISE, [*VARIANTS, Variant(EFFECT, (7, 10), ())]).beside(chosen)
    for which, columns, *_ in beside.batches(VARIANTS[:2]):
        tried = 0.7 * total[:, VARIANTS[which[0]].columns].sum(axis=1)
        before, after = imitated(measured)[:BASE], imitated(measured - tried)[:BASE]
        nearer = beside.nearer(columns, np.full(columns.shape, 0.7))
        np.testing.assert_allclose(nearer, [before @ before - after @ after], atol=1e-9)


def test_what_is_visible_is_what_the_twin_does_not_imitate() -> None:
    own = system(shaken=False)
    total = sum(one.of(np.arange(one.size)) for one in own.moments(NOISE))
    base = np.arange(BASE)
    left = total - total[:, base] @ np.linalg.solve(total[np.ix_(base, base)] + np.eye(BASE), total[base])
    visible = Projection(own, NOISE, VARIANTS).visible(VARIANTS)
    places = [list(one.columns) for one in VARIANTS]
    squares = np.array([[np.trace(products[np.ix_(k, k)]) for k in places] for products in (left, total)])
    np.testing.assert_allclose(visible.T, [squares[0] / (GROUPS * ROWS), squares[0] / squares[1]], rtol=1e-9)


def test_the_twin_may_have_no_terms() -> None:
    own = system(shaken=False)
    lost, pattern = own.pattern[:, :BASE].sum(axis=1), own.pattern[:, BASE:]
    blocks = tuple(
        replace(block, factors=tuple(factor[:, count:] for factor, count in zip(block.factors, lost, strict=True)))
        for block in own.blocks
    )
    shaken = tuple(np.eye(int(row.sum()) + 1) for row in pattern)
    own = replace(own, terms=(), pattern=pattern, blocks=blocks, shaken=shaken, apart=True)
    some = [Variant(EFFECT, (k,), (Term("k", "1", spread=0.5),)) for k in (0, 1)]
    found = evidence(Projection(own, NOISE, [*some, Variant(EFFECT, (2,), ())]), (2,), some)
    total = sum(one.of(np.arange(one.size)) for one in own.moments(NOISE))
    left = total[0, 0] - total[0, 2] ** 2 / (total[2, 2] + 1)
    assert found.coefficients[0].information[0, 0, 0] == pytest.approx(left)


def test_nothing_may_be_asked_for() -> None:
    assert evidence(Projection(system(shaken=True), NOISE, []), (), []).variants == ()
