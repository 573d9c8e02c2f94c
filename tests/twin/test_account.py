"""Where the energy of a motion goes, and what of that data cannot part."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.synthetic import arm, measure, swing, with_constants

from irtwin.effects.catalogue import BASELINE
from irtwin.twin.account import _joined, account
from irtwin.twin.identify import identify
from irtwin.twin.price import price

ROBOT = with_constants(arm(2))
HEAT = (*BASELINE, "copper_loss", "inverter_loss")


def fitted(effects=BASELINE, held_out=7, noise=0.5, seconds=10.0):
    """A twin of two runs, and a motion."""
    runs = [measure(ROBOT, swing(ROBOT, of, seconds=seconds), noise, seed=of) for of in (1, 2)]
    return identify(ROBOT, runs, effects), swing(ROBOT, held_out)


@pytest.mark.parametrize("effects", [HEAT, (*BASELINE, "no_regeneration", "meter_gain")])
def test_entries_sum_to_the_energy_and_hold_each_share_once(effects):
    twin, motion = fitted(effects)
    entries = account(twin, motion)
    shares = [(share.effect, share.joint) for entry in entries for share in entry.shares]
    assert sorted(shares, key=str) == sorted(((one.effect, one.joint) for one in twin.ledger(motion)), key=str)
    assert sum(entry.energy for entry in entries) == pytest.approx(twin.energy(motion), rel=1e-9)


def test_what_data_cannot_part_is_one_entry_that_they_tell():
    """Of slow joints that carry much, the square of a current looks like its size."""
    runs = [measure(ROBOT, swing(ROBOT, of, seconds=4.0), 2.0, seed=of) for of in (1, 2)]
    twin, motion = identify(ROBOT, runs, HEAT), swing(ROBOT, 7)
    entries = [entry for entry in account(twin, motion) if len(entry.shares) > 1]
    assert entries
    for entry in entries:
        widths = [share.upper - share.lower for share in entry.shares]
        assert entry.lower <= entry.energy <= entry.upper
        assert entry.upper - entry.energy < sum(widths)
    told = {(share.effect, share.joint) for entry in entries for share in entry.shares}
    assert told & {(effect, joint) for effect in ("copper_loss", "inverter_loss") for joint in ROBOT.joint_names}


def test_a_share_is_not_told_because_the_whole_energy_is_less_sure():
    """What lasts of the remainder is standby's: it makes no winding's heat surer."""
    runs = [measure(ROBOT, swing(ROBOT, of, seconds=4.0), 2.0, seed=of) for of in (1, 2)]
    twin, motion = identify(ROBOT, runs, HEAT), swing(ROBOT, 7)
    vague = replace(twin, remainder=replace(twin.remainder, mean=500.0))
    together, still = (
        {tuple((share.effect, share.joint) for share in entry.shares) for entry in account(one, motion)}
        for one in (twin, vague)
    )
    assert {shares for shares in together if ("standby_power", None) not in shares} <= still


def test_not_all_that_shares_make_up_for_each_other_is_believed():
    runs = [measure(ROBOT, swing(ROBOT, of, seconds=4.0), 2.0, seed=of) for of in (1, 2)]
    twin, motion = identify(ROBOT, runs, HEAT), swing(ROBOT, 7)
    for entry in account(twin, motion):
        apart = sum((share.upper - share.energy) ** 2 for share in entry.shares)
        assert entry.upper - entry.energy >= 0.999 * np.sqrt(0.2 * apart)


def test_what_hardly_makes_up_for_another_is_an_entry_of_its_own():
    energies, variances = np.array([1.0, 1.0, 1.0]), np.eye(3)
    variances[0, 1] = variances[1, 0] = -0.9
    variances[1, 2] = variances[2, 1] = -0.01
    assert _joined(energies, variances) == [[0, 1], [2]]


@pytest.mark.slow
@pytest.mark.parametrize(("more", "set_to"), [("copper_loss", {}), ("no_regeneration", {"burnt": 1, "Fc": 0, "Fv": 0})])
def test_a_share_is_as_unsure_as_its_parameters(more, set_to):
    """Parameters drawn from their covariance spread each share as its interval says; those that are set are sure."""
    twin, motion = fitted((*BASELINE, more), noise=3.0)
    known = np.array([one.name in set_to for one in twin.parameters])
    numbers = tuple(replace(one, value=set_to.get(one.name, one.value)) for one in twin.parameters)
    sure = np.where(known | known[:, None], 0.0, twin.covariance)
    twin = replace(twin, parameters=numbers, covariance=sure, remainder=None)
    root = np.linalg.cholesky(twin.covariance + 1e-12 * np.eye(len(twin.covariance)))
    random = np.random.default_rng(0)
    drawn = []
    for _ in range(60):
        moved = root @ random.standard_normal(len(root))
        each = zip(twin.parameters, moved, strict=True)
        other = replace(twin, parameters=tuple(replace(one, value=one.value + by) for one, by in each))
        drawn.append([entry.energy for entry in other.ledger(motion)])
    keys = [(one.effect, one.joint) for one in twin.ledger(motion)]
    spread = dict(zip(keys, 1.96 * np.std(drawn, axis=0), strict=True))
    for entry in account(twin, motion):
        for share in entry.shares:
            assert share.upper - share.energy == pytest.approx(spread[share.effect, share.joint], rel=0.4, abs=0.05)


def test_what_is_drawn_at_rest_holds_what_lasts_of_the_remainder():
    twin, motion = fitted()
    (sure,), (unsure,) = (
        [share for entry in account(one, motion) for share in entry.shares if share.effect == "standby_power"]
        for one in (replace(twin, remainder=None), replace(twin, remainder=replace(twin.remainder, mean=5.0)))
    )
    assert unsure.upper - unsure.energy > 1.9 * 5.0 * motion.time[-1] > sure.upper - sure.energy


def test_a_twin_of_an_older_file_has_no_intervals():
    twin, motion = fitted()
    entries = account(replace(twin, covariance=None), motion)
    assert all(len(entry.shares) == 1 and entry.lower is None for entry in entries)
    assert price(twin, [motion]).energy.value == pytest.approx(sum(entry.energy for entry in entries))
