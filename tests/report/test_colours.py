"""One colour an effect, on every page."""

from __future__ import annotations

import re

from tests.report.robots import answers, six_axis

from irtwin.effects.catalogue import catalogue
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.report.colours import effect_colour
from irtwin.report.energy.figures import figures


def test_each_effect_has_a_colour_of_its_own() -> None:
    colours = {name: effect_colour(name) for name in catalogue()}
    assert all(re.fullmatch("#[0-9A-F]{6}", colour) for colour in colours.values())
    assert len(set(colours.values())) == len(colours)
    assert effect_colour("nobody_knows") not in colours.values()


def test_figures_of_a_page_take_them(graph: KnowledgeGraph) -> None:
    drawn = figures(answers(graph, six_axis(graph)))
    for name in ("energy_per_effect", "energy_per_joint_and_effect"):
        found = {bars["name"]: bars["marker"]["color"] for bars in drawn[name]["data"]}
        assert found["Coulomb friction"] == effect_colour("coulomb_friction")
        assert found["standby power"] == effect_colour("standby_power")
