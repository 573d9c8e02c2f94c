"""Motions from a file of Fourier coefficients."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np

from irtwin.demo.plant.motion import PlantMotion


def fourier(file: Path, step: float, speed: float = 1.0) -> PlantMotion:
    """Read a finite Fourier series from a TOML file and return one period of it, slowed down to `speed`.

    `period` (s), `centre` (n,), `sine` and `cosine` (K, n), rad:
    q = centre + sum_k sine_k sin(k w t) + cosine_k cos(k w t).
    """
    table = tomllib.loads(file.read_text(encoding="utf-8"))
    sine, cosine = np.array(table["sine"]), np.array(table["cosine"])
    period = table["period"] / speed
    time = step * np.arange(round(period / step) + 1)
    w = 2 * np.pi / period * np.arange(1, len(sine) + 1)
    sin, cos = np.sin(np.outer(time, w)), np.cos(np.outer(time, w))
    return PlantMotion(
        np.array(table["centre"]) + sin @ sine + cos @ cosine,
        (cos * w) @ sine - (sin * w) @ cosine,
        -(sin * w**2) @ sine - (cos * w**2) @ cosine,
    )
