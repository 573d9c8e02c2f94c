"""The colours of figures, on every page: one for what was measured, one for each effect, whatever robot it is of."""

from __future__ import annotations

import colorsys
from functools import cache

from irtwin.effects.catalogue import catalogue

# Okabe and Ito's palette, told apart with every kind of colour blindness; yellow last, it is weak on white.
PALETTE = ("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#D55E00", "#7F8C99", "#F0E442")
MEASURED, MODELLED, RESIDUAL, HELD_OUT = "#7A8794", "#D55E00", "#009E73", "#0072B2"
OF_LINES = {"measured": MEASURED, "modelled": MODELLED, "residual": RESIDUAL, "held_out": HELD_OUT}  # of scripts
LIMIT = "#C2410C"  # of a line that something is held against
_OTHER = "#7F8C99"  # of an effect that is in no catalogue
_LIGHTEST, _DARKEST = 0.72, 0.32  # lightness of the shades of a family
_GOLDEN = 0.618  # neighbours of a family get shades far from each other


def effect_colour(effect: str) -> str:
    """Return the colour of an effect by its id: the hue is its family's, the shade its own."""
    return _effects().get(effect, _OTHER)


@cache
def _effects() -> dict[str, str]:
    families: dict[str, list[str]] = {}
    for name, effect in catalogue().items():
        families.setdefault(effect.family, []).extend((name, *effect.entries))
    return {
        name: _shade(PALETTE[place % len(PALETTE)], number)
        for place, family in enumerate(sorted(families))
        for number, name in enumerate(families[family])
    }


def _shade(colour: str, number: int) -> str:
    red, green, blue = (int(colour[start : start + 2], 16) / 255 for start in (1, 3, 5))
    hue, _, saturation = colorsys.rgb_to_hls(red, green, blue)
    lightness = _DARKEST + (_LIGHTEST - _DARKEST) * ((0.3 + number * _GOLDEN) % 1)
    return "#" + "".join(f"{round(255 * part):02X}" for part in colorsys.hls_to_rgb(hue, lightness, saturation))
