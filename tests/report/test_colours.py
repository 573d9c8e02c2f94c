"""One colour an effect, on every page."""

from __future__ import annotations

import re

from irtwin.effects.catalogue import catalogue
from irtwin.report.colours import effect_colour


def test_each_effect_has_a_colour_of_its_own() -> None:
    colours = {name: effect_colour(name) for name in catalogue()}
    assert all(re.fullmatch("#[0-9A-F]{6}", colour) for colour in colours.values())
    assert len(set(colours.values())) == len(colours)
    assert effect_colour("nobody_knows") not in colours.values()
