"""The flow of energy: what each node gets it gives on, as wide as its energy."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.html_elements import plain

from irtwin.report.energy.flows import Flows, flows

EFFECTS = ("coulomb_friction", "copper_loss", "mechanical_power", "standby_power")


def row(joint, effect, energy, lower=None, upper=None):
    effect = f"https://w3id.org/irtwin#{effect}"
    return {"joint": joint, "effect": effect, "label": None, "energy_j": energy, "lower_j": lower, "upper_j": upper}


ROWS = [
    row("joint_1", "coulomb_friction", 600.0),
    row("joint_1", "mechanical_power", -100.0),
    row("joint_2", "copper_loss", 300.0, 288.0, 312.0),
    row("joint_2", "coulomb_friction", 1.0),
    row("joint_2", "iron_loss", 1.0),
    row(None, "standby_power", 200.0, 90.0, 310.0),
]


def test_what_is_given_back_goes_on_the_bus_beside_the_supply():
    found = flows(ROWS)
    height = {node.name: node.height for node in found.nodes}
    for name, energy in (("given back by joints", 100), ("supply", 1002), ("whole robot", 200)):
        assert height[name] / height["bus"] == pytest.approx(energy / 1102)


def test_effects_that_take_little_are_one_and_the_largest_is_first():
    nodes = flows(ROWS).nodes
    effects = [node.name for node in nodes if node.x == max(each.x for each in nodes)]
    assert effects == ["coulomb friction", "copper loss", "standby power", "other effects"]


def test_ribbons_say_from_where_to_where_and_how_much():
    words = [plain(ribbon.words) for ribbon in flows(ROWS).ribbons]
    assert "joint_1 to coulomb friction: 0.167 Wh" in words
    assert not [one for one in words if one.startswith("joint_1 to mechanical power")]


def test_ribbons_say_how_sure_they_are_and_are_pale_where_half_of_it_may_not_be():
    ribbons = {plain(one.words): one.unsure for one in flows(ROWS).ribbons}
    assert ribbons["joint_2 to copper loss: 0.0833 Wh, between 0.0800 Wh and 0.0867 Wh"] is False
    assert ribbons["whole robot to standby power: 0.0556 Wh, between 0.0250 Wh and 0.0861 Wh"] is True
    assert ribbons["joint_1 to coulomb friction: 0.167 Wh"] is False


def test_a_joint_may_be_called_like_a_node():
    found = flows([row("supply", "copper_loss", 1.0), row("bus", "copper_loss", 2.0)])
    assert sorted(node.name for node in found.nodes) == ["bus", "bus", "copper loss", "supply", "supply"]


def test_without_energy_taken_there_is_no_flow():
    assert flows([]) is None
    assert flows([row("joint_1", "mechanical_power", -5.0)]) is None


@given(
    st.dictionaries(
        st.tuples(st.sampled_from(["a", "b", None]), st.sampled_from(EFFECTS)),
        st.one_of(st.floats(-1e6, -1e-3), st.floats(1e-3, 1e7)),
        min_size=1,
    )
)
def test_each_node_is_as_tall_as_what_flows_in_and_out(taken):
    found = flows([row(joint, effect, energy) for (joint, effect), energy in taken.items()])
    if found is None:
        return
    columns = sorted({node.x for node in found.nodes})
    heights = [sum(node.height for node in found.nodes if node.x == x) for x in columns]
    assert max(heights) <= Flows.size[1] + len(found.nodes)  # a hair's height for what is next to nothing
    assert heights == pytest.approx([max(heights)] * len(heights), abs=len(found.nodes))
    assert all(re.fullmatch(r"M[-\d., C]+ L[-\d., C]+ Z", ribbon.path) for ribbon in found.ribbons)
