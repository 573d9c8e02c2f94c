"""Curves as a picture that Jupyter and the guide show: SVG, without a package."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

COLOURS = ("#3f8fd2", "#d9822b")  # both read on white and on black
WIDTH, HEIGHT, LEFT, BELOW = 560, 240, 72, 44


@dataclass(frozen=True)
class Curves:
    """Curves over one axis: `curves` are `y` by name, each as long as `x`; the axes are named with their units."""

    x: Sequence[float]
    curves: Mapping[str, Sequence[float]]
    x_name: str
    y_name: str

    def _repr_html_(self) -> str:
        ends = [(min(map(min, rows)), max(map(max, rows))) for rows in ([self.x], self.curves.values())]
        (left, right), (low, high) = ends
        corners = [(LEFT, HEIGHT - BELOW, left, "middle"), (WIDTH - 30, HEIGHT - BELOW, right, "middle")]
        ticks = [f'<text x="{x}" y="{y + 16}" text-anchor="{at}">{number:.3g}</text>' for x, y, number, at in corners]
        for y, number in ((HEIGHT - BELOW, low), (24, high)):
            ticks.append(f'<text x="{LEFT - 8}" y="{y + 4}" text-anchor="end">{number:.4g}</text>')
        for number, (name, values) in enumerate(self.curves.items()):
            across = np.interp(self.x, (left, right), (LEFT, WIDTH - 30))
            up = np.interp(values, (low, high), (HEIGHT - BELOW, 24))
            points = " ".join(f"{x:.1f},{y:.1f}" for x, y in zip(across, up, strict=True))
            colour = COLOURS[number]
            ticks.append(f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="2"/>')
            ticks.append(f'<text x="{LEFT + 150 * number}" y="14" style="fill:{colour}">{name}</text>')
        names = f'<text x="{WIDTH / 2}" y="{HEIGHT - 8}" text-anchor="middle">{self.x_name}</text>'
        names += f'<text transform="translate(16,{HEIGHT / 2}) rotate(-90)" text-anchor="middle">{self.y_name}</text>'
        axes = f'<path d="M{LEFT} 24V{HEIGHT - BELOW}H{WIDTH - 30}" fill="none" stroke="currentColor"/>'
        label = f"{self.y_name} over {self.x_name}: {', '.join(self.curves)}"
        return (
            f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{label}" style="max-width:45rem"'
            ' font-size="15" fill="currentColor">'
            f"{axes}{''.join(ticks)}{names}</svg>"
        )
