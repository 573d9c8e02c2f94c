"""Causes of one family at joints that overlap make one branch."""

from __future__ import annotations

from types import SimpleNamespace

from irtwin.effects.catalogue import catalogue
from irtwin.gap.isolation.closing import Closing
from irtwin.gap.isolation.finding import branches, joined


def cause(effect, *joints, scope="missing"):
    return SimpleNamespace(
        effect=effect, scope=scope, joints=joints, variants=(SimpleNamespace(effect=catalogue()[effect]),)
    )


STRIBECK, LOADED = cause("stribeck_friction", "j5"), cause("load_dependent_friction", "j4", "j5")
ELSEWHERE, RIPPLE = cause("asymmetric_friction", "j1"), cause("torque_ripple", "j5")


def test_one_family_at_joints_that_overlap_is_one_branch():
    assert joined([STRIBECK, RIPPLE, LOADED]) == [[RIPPLE], [STRIBECK, LOADED]]
    assert joined([STRIBECK, ELSEWHERE]) == [[STRIBECK], [ELSEWHERE]]


def test_a_cause_joins_what_stood_apart():
    bridge = cause("viscous_friction", "j1", "j5")
    assert joined([STRIBECK, ELSEWHERE, bridge]) == [[STRIBECK, ELSEWHERE, bridge]]


def test_what_changed_stands_apart_from_what_the_twin_lacks():
    changed = cause("coulomb_friction", "j5", scope="changed")
    assert joined([STRIBECK, changed]) == [[STRIBECK], [changed]]


def test_effects_of_the_whole_robot_stand_apart_from_those_of_joints():
    payload, cable = cause("payload"), cause("cable_drag", "j1")
    assert joined([payload, cable]) == [[payload], [cable]]


def test_branches_and_their_causes_stand_by_what_they_close():
    sizes = {"stribeck_friction": 1.0, "load_dependent_friction": 2.0, "torque_ripple": 2.5}
    finding = SimpleNamespace(
        causes=(STRIBECK, RIPPLE, LOADED),
        closing=lambda some: Closing(0.1, (0.0, 0.2), 1.0, sum(sizes[one.effect] for one in some)),
    )
    friction, ripple = branches(finding)
    assert (friction.family, friction.causes) == ("friction", (LOADED, STRIBECK))
    assert (ripple.family, ripple.causes) == ("transmission", (RIPPLE,))
